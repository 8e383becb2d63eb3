//! True properties of hardware and wearer, independent of the device's setup.

use super::Event;
use crate::trace::levels::{CHANNELS, Levels};
use serde::Serialize;

/// Kind of an output stage, and its amplitude at DAC code 65 535.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Stage {
    /// Sets the current, up to its compliance voltage.
    Current {
        /// Current at full scale, mA.
        full_scale_ma: f64,
    },
    /// Sets the voltage, up to the current of its limiter.
    Voltage {
        /// Output voltage at full scale, V.
        full_scale_v: f64,
    },
}

/// Stage, electrode and wearer's limits of one channel.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Channel {
    /// Actual stage on the board, which a setup may state wrongly.
    pub stage: Stage,
    /// Loads, Ω, each with its start time, µs, in ascending order. `None` is a detached electrode,
    /// as is any time before the first entry.
    pub loads: Vec<(u64, Option<f64>)>,
    /// Limit of the wearer, mA; the rule allows 5 % more.
    pub limit_ma: f64,
    /// Maximum number of pulses that may begin within any second.
    pub pulses_per_s: usize,
    /// Relative excess of the anodic phase's charge over the cathodic one's: 0.01 is the 1 % that
    /// hardware.md allows as phase match.
    pub mismatch: f64,
    /// Trip level of the stage's comparator, mA. hardware.md, Pump and over-current: 105–120 for a
    /// 100 mA stage, 22–30 for a voltage stage.
    pub trip_ma: f64,
}

impl Channel {
    /// Creates a stage with no electrode connected.
    #[must_use]
    pub const fn unconnected() -> Self {
        Self {
            stage: Stage::Current { full_scale_ma: 0.0 },
            loads: Vec::new(),
            limit_ma: 0.0,
            pulses_per_s: 0,
            mismatch: 0.0,
            trip_ma: 120.0,
        }
    }

    /// Creates a stage as specified in hardware.md with a constant load: the phases match, and the
    /// comparator trips at its upper bound.
    #[must_use]
    pub fn steady(stage: Stage, ohm: f64, limit_ma: f64, pulses_per_s: usize) -> Self {
        let trip_ma = match stage {
            Stage::Current { .. } => 120.0,
            Stage::Voltage { .. } => 30.0,
        };
        Self {
            stage,
            loads: vec![(0, Some(ohm))],
            limit_ma,
            pulses_per_s,
            mismatch: 0.0,
            trip_ma,
        }
    }
}

/// Logic by which a stage converts its two lines into a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum StageLogic {
    /// Logic of hardware.md: a direction is not driven again before the other direction or
    /// grounding has given the charge back, and a phase that the one-shot ends is latched.
    Interlocked,
    /// Simpler logic, for comparison only. The two lines select one of four states, and each line
    /// has a one-shot that starts whenever the line rises. If one line is broken, the stage drives
    /// current at each grounding.
    TwoBit,
}

/// Analogue part of every stage: docs/reference/hardware.md, What each stage must do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hardware {
    /// Logic of the stage's two lines.
    pub logic: StageLogic,
    /// Time after which a one-shot ends a direction, µs: 600, parts 550–650.
    pub one_shot_us: u64,
    /// Series capacitor, F: 4 µF.
    pub capacitor_f: f64,
    /// Bleed resistor across the capacitor, Ω: 10 MΩ, so that 10 V of bias pass 1 µA.
    pub bleed_ohm: f64,
    /// Maximum voltage of a current stage across load and capacitor, V: 120.
    pub compliance_v: f64,
    /// Maximum current of a voltage stage, mA: 20.
    pub limiter_ma: f64,
    /// Time from the last pump edge to the loss of the high voltage, µs: 300.
    pub pump_hold_us: u64,
    /// Time without pump edges after which latches clear, µs: 10 ms.
    pub latch_clear_us: u64,
    /// Delay of a comparator from exceeding its level to opening its switch, µs: 1.
    pub comparator_us: u64,
    /// Delay of the banks' comparators, whose levels the device sets, µs: 10.
    pub bank_comparator_us: u64,
    /// Trip level of the banks' comparators at code 65 535, mA: 125.
    pub bank_full_scale_ma: f64,
}

impl Hardware {
    /// The reference board (docs/reference/hardware.md).
    pub const REFERENCE: Self = Self {
        logic: StageLogic::Interlocked,
        one_shot_us: 600,
        capacitor_f: 4e-6,
        bleed_ohm: 10e6,
        compliance_v: 120.0,
        limiter_ma: 20.0,
        pump_hold_us: 300,
        latch_clear_us: 10_000,
        comparator_us: 1,
        bank_comparator_us: 10,
        bank_full_scale_ma: 125.0,
    };
}

/// One of a channel's two lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Line {
    /// Line `c`; if it alone is high, the stage drives cathodic current.
    Cathodic,
    /// Line `a`; if it alone is high, the stage drives anodic current.
    Anodic,
}

/// A broken line: its stage sees a fixed level instead of the pin's level. It counts as a fault of
/// its channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StuckLine {
    /// Channel number, 0…9.
    pub channel: u8,
    /// The broken one of the channel's two lines.
    pub line: Line,
    /// Level that the stage sees.
    pub high: bool,
    /// Time from which the line is broken, µs.
    pub from_us: u64,
}

/// An injected fault. On each channel, the first truncated or prolonged pulse after the fault is
/// excused, up to 650 µs and 65 µC, and listed ([`super::Truncated`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// Time of the fault, µs.
    pub t_us: u64,
}

/// Interval in which nothing may be driven. It begins at the deadline of a stop, of host silence or
/// of a fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct QuietInterval {
    /// Start of the interval: the deadline of the event, µs.
    pub from_us: u64,
    /// First instant at which output is allowed again, µs.
    pub until_us: u64,
}

/// True properties and events against which the output is judged.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// True properties of each channel.
    pub channels: [Channel; CHANNELS],
    /// Properties that all stages share.
    pub hardware: Hardware,
    /// Broken lines between pins and stages.
    pub stuck: Vec<StuckLine>,
    /// Injected faults, with their times.
    pub faults: Vec<Fault>,
    /// Intervals in which nothing may be driven.
    pub quiet: Vec<QuietInterval>,
}

impl Default for Truth {
    /// Returns the reference board with nothing connected.
    fn default() -> Self {
        Self {
            channels: std::array::from_fn(|_| Channel::unconnected()),
            hardware: Hardware::REFERENCE,
            stuck: Vec::new(),
            faults: Vec::new(),
            quiet: Vec::new(),
        }
    }
}

impl Truth {
    /// Returns the levels that reach the stages at `t_us` if the pins have the levels `pins`.
    pub(super) fn levels_at_stages(&self, pins: Levels, t_us: u64) -> Levels {
        let mut word = pins.0;
        for stuck in self.stuck.iter().filter(|stuck| stuck.from_us <= t_us) {
            let line = match stuck.line {
                Line::Cathodic => 0,
                Line::Anodic => 1,
            };
            let bit = 1 << (2 * u32::from(stuck.channel) + line);
            word = if stuck.high { word | bit } else { word & !bit };
        }
        Levels(word)
    }

    /// Returns the times of this channel's faults, µs, in ascending order.
    pub(super) fn faults_of(&self, channel: u8) -> Vec<u64> {
        let stuck = self.stuck.iter().filter(|stuck| stuck.channel == channel);
        let mut faults: Vec<_> = self.faults.iter().map(|fault| fault.t_us).collect();
        faults.extend(stuck.map(|stuck| stuck.from_us));
        faults.sort_unstable();
        faults
    }
}

/// Times at which the charge pump's pin PB10 toggled.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub enum Pump {
    /// Toggles all the time: assumed for a recording that does not contain the pump.
    Throughout,
    /// First and last edge of each run of edges, µs, in ascending order; the edges of a run are
    /// closer together than the detector's hold time.
    Runs(Vec<(u64, u64)>),
}

impl Pump {
    /// Creates the runs from the times of edges, in ascending order; a gap of `hold_us` or more
    /// ends a run.
    pub fn from_edges(edges: impl IntoIterator<Item = u64>, hold_us: u64) -> Self {
        let mut pump = Self::Runs(Vec::new());
        for t_us in edges {
            pump.edge(t_us, hold_us);
        }
        pump
    }

    /// Adds an edge, which must not be earlier than the last.
    pub fn edge(&mut self, t_us: u64, hold_us: u64) {
        let Self::Runs(runs) = self else { return };
        match runs.last_mut() {
            Some(run) if t_us < run.1 + hold_us => run.1 = t_us,
            _ => runs.push((t_us, t_us)),
        }
    }

    /// Returns the edges of this pump before `at_us`, and those of `other` from then on; both must
    /// have the same last edge before `at_us`.
    #[must_use]
    pub fn followed_by(&self, other: &Self, at_us: u64) -> Self {
        let (Self::Runs(own), Self::Runs(then)) = (self, other) else {
            return other.clone();
        };
        let own = own.iter().filter(|run| run.0 < at_us);
        let mut runs: Vec<_> = own.copied().collect();
        for &(first, last) in then.iter().filter(|run| run.1 >= at_us) {
            match runs.last_mut() {
                Some(run) if first < at_us => run.1 = last,
                _ => runs.push((first, last)),
            }
        }
        Self::Runs(runs)
    }

    /// Returns the time of the last edge, if there is one.
    #[must_use]
    pub fn last_edge(&self) -> Option<u64> {
        match self {
            Self::Throughout => None,
            Self::Runs(runs) => runs.last().map(|run| run.1),
        }
    }

    /// Passes the events of the pump's detectors to `give`: supply on or off, pump at rest.
    pub(super) fn report_supply(&self, hardware: &Hardware, mut give: impl FnMut(u64, Event)) {
        let Self::Runs(runs) = self else {
            return give(0, Event::Supply(true));
        };
        give(0, Event::PumpRests);
        for (index, &(first, last)) in runs.iter().enumerate() {
            let next = runs.get(index + 1).map_or(u64::MAX, |run| run.0);
            give(first, Event::Supply(true));
            give(last, Event::PumpRests);
            if last + hardware.pump_hold_us <= next {
                give(last + hardware.pump_hold_us, Event::Supply(false));
            }
        }
    }
}
