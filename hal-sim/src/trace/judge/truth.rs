//! What is true of hardware and wearer, whatever the device was told.

use super::Event;
use crate::trace::levels::{CHANNELS, Levels};
use serde::Serialize;

/// What an output stage is, and what DAC code 65 535 makes it drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub enum Stage {
    /// Sets the current, as far as its compliance allows.
    Current {
        /// At full scale, mA.
        full_scale_ma: f64,
    },
    /// Sets the voltage, as far as its limiter allows.
    Voltage {
        /// At full scale, V.
        full_scale_v: f64,
    },
}

/// One channel: its stage, its electrode, what its wearer may get.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Channel {
    /// The stage on the board, which a setup may declare otherwise.
    pub stage: Stage,
    /// From when (µs, ascending) which load in Ω; `None` is an electrode that is
    /// off, and so is every load before the first.
    pub loads: Vec<(u64, Option<f64>)>,
    /// The wearer's limit, mA; the rule allows 5 % more.
    pub limit_ma: f64,
    /// Most pulses that were checked to begin within any second.
    pub pulses_per_s: usize,
    /// How much more the anodic phase carries than the cathodic, as a part:
    /// 0.01 is the 1 % that hardware.md allows as phase match.
    pub mismatch: f64,
    /// Where the stage's comparator trips, mA. hardware.md, Pump and
    /// over-current: 105–120 for a 100 mA stage, 22–30 for a voltage stage.
    pub trip_ma: f64,
}

impl Channel {
    /// A stage with nothing connected to it.
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

    /// A stage as hardware.md has it at a steady load: phases match, the
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

/// Which logic a stage has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum StageLogic {
    /// hardware.md's: a direction is not driven again before the other direction
    /// or grounding gave back what it left, and what its one-shot ends is latched.
    Interlocked,
    /// Four states of two lines with a one-shot for each line, which runs from
    /// the line's rise and again after its fall: one broken line drives at each
    /// grounding. For comparison only.
    TwoBit,
}

/// The analogue part of every stage: docs/hardware.md, What each stage must do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Hardware {
    /// What the stage makes of its two lines.
    pub logic: StageLogic,
    /// A direction opens this long after it began, µs: 600, parts 550–650.
    pub one_shot_us: u64,
    /// Series capacitor, F: 4 µF.
    pub capacitor_f: f64,
    /// Bleed across it, Ω: 10 MΩ, so that 10 V of bias pass 1 µA.
    pub bleed_ohm: f64,
    /// What a current stage can put across load and capacitor, V: 120.
    pub compliance_v: f64,
    /// What a voltage stage lets through, mA: 20.
    pub limiter_ma: f64,
    /// High voltage is gone this long after the last pump edge, µs: 300.
    pub pump_hold_us: u64,
    /// Latches clear when the pump has been off for this long, µs: 10 ms.
    pub latch_clear_us: u64,
    /// A comparator opens its switch this long after its level was passed, µs: 1.
    pub comparator_us: u64,
    /// The same of the banks' comparators, whose levels the device sets, µs: 10.
    pub bank_comparator_us: u64,
    /// Their level at code 65 535, mA: 125.
    pub bank_full_scale_ma: f64,
}

impl Hardware {
    /// The reference board (docs/hardware.md).
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
    /// `c`.
    Cathodic,
    /// `a`.
    Anodic,
}

/// A line that no longer arrives at its stage as the pin has it; a fault of
/// its channel from then on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct StuckLine {
    /// Channel, 0…9.
    pub channel: u8,
    /// Which of its lines.
    pub line: Line,
    /// The level that the stage sees.
    pub high: bool,
    /// From when on, µs.
    pub from_us: u64,
}

/// Something that broke: each channel's first pulse after it that is cut or held
/// is excused, once, up to 650 µs and 65 µC, and listed ([`super::Truncated`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Fault {
    /// When, µs.
    pub t_us: u64,
}

/// A stretch of time in which nothing may be driven, because a stop, a silent
/// host or a fault came before it by its deadline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct QuietInterval {
    /// The deadline, µs.
    pub from_us: u64,
    /// First instant at which output is allowed again, µs.
    pub until_us: u64,
}

/// Everything the judge takes for true.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Truth {
    /// By channel.
    pub channels: [Channel; CHANNELS],
    /// What all stages have.
    pub hardware: Hardware,
    /// Broken lines between pins and stages.
    pub stuck: Vec<StuckLine>,
    /// What broke, and when.
    pub faults: Vec<Fault>,
    /// When nothing may be driven.
    pub quiet: Vec<QuietInterval>,
}

impl Default for Truth {
    /// The reference board with nothing connected.
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
    /// What arrives at the stages of what the pins have.
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

    /// When this channel's faults came, ascending.
    pub(super) fn faults_of(&self, channel: u8) -> Vec<u64> {
        let stuck = self.stuck.iter().filter(|stuck| stuck.channel == channel);
        let mut faults: Vec<_> = self.faults.iter().map(|fault| fault.t_us).collect();
        faults.extend(stuck.map(|stuck| stuck.from_us));
        faults.sort_unstable();
        faults
    }
}

/// When PB10 toggled.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub enum Pump {
    /// All the time: of a recording that does not have it. Assumed, not seen.
    Throughout,
    /// First and last edge of each run of edges, µs, ascending; between two
    /// edges of a run lies less than the detector's hold.
    Runs(Vec<(u64, u64)>),
}

impl Pump {
    /// Of the instants of edges, ascending; a gap of `hold_us` or more ends a run.
    pub fn from_edges(edges: impl IntoIterator<Item = u64>, hold_us: u64) -> Self {
        let mut pump = Self::Runs(Vec::new());
        for t_us in edges {
            pump.edge(t_us, hold_us);
        }
        pump
    }

    /// One more edge, not before the last.
    pub fn edge(&mut self, t_us: u64, hold_us: u64) {
        let Self::Runs(runs) = self else { return };
        match runs.last_mut() {
            Some(run) if t_us < run.1 + hold_us => run.1 = t_us,
            _ => runs.push((t_us, t_us)),
        }
    }

    /// Its edges before `at_us`, and those of `other` from then on; both had the same last
    /// edge before.
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

    /// When it last toggled.
    #[must_use]
    pub fn last_edge(&self) -> Option<u64> {
        match self {
            Self::Throughout => None,
            Self::Runs(runs) => runs.last().map(|run| run.1),
        }
    }

    /// What the detectors make of it.
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
