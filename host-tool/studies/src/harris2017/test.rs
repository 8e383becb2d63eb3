//! Tests of section 3.3: stimulation and angle.

use super::declared::Protocol;
use hal_sim::body::bench::CellSide;
use hal_sim::body::bench::elbow::{BICEPS, TRICEPS};
use hal_sim::body::{Drive, Pulse};
use serde::{Deserialize, Serialize};

/// Shortest pulse that an output stage plays, µs (docs/protocol.md).
pub const LEAST_WIDTH_US: u32 = 10;

/// Stimulation of a test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Stimulation {
    /// Ramp of the current from 0 at this pulse width, µs.
    Current(u32),
    /// Ramp of the pulse width from 0 at this current, mA.
    Width(f64),
    /// Constant pulse of the pair on the biceps, as in the co-contraction of the wall experiment.
    Biceps,
}

/// One test of a wearer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Test {
    /// Index among the wearer's tests, from 0.
    pub nth: u64,
    pub stimulation: Stimulation,
    /// Intended angle between forearm and upper arm, °.
    pub included_deg: f64,
}

impl Stimulation {
    /// Returns the description for the report.
    #[must_use]
    pub fn in_words(self) -> String {
        match self {
            Self::Current(width_us) => format!("current ramp at {width_us} µs"),
            Self::Width(current_ma) => format!("width ramp at {current_ma} mA"),
            Self::Biceps => "biceps".to_owned(),
        }
    }

    /// Returns the identifier in results, such as `current-35us`.
    #[must_use]
    pub fn id(self) -> String {
        match self {
            Self::Current(width_us) => format!("current-{width_us}us"),
            Self::Width(current_ma) => format!("width-{current_ma}mA"),
            Self::Biceps => "biceps".to_owned(),
        }
    }

    /// Returns the index of the electrode pair that stimulates, [`TRICEPS`] or [`BICEPS`].
    #[must_use]
    pub const fn pair(self) -> usize {
        match self {
            Self::Biceps => BICEPS,
            _ => TRICEPS,
        }
    }

    /// Returns the direction in which the cell is mounted.
    #[must_use]
    pub const fn holds(self) -> CellSide {
        match self {
            Self::Biceps => CellSide::Flexion,
            _ => CellSide::Extension,
        }
    }

    /// Returns current, mA, and width, µs, at `t_s` after the start of the ramp.
    #[must_use]
    pub fn pulse_at(self, protocol: &Protocol, t_s: f64) -> (f64, f64) {
        let part = (t_s / protocol.ramp_s).clamp(0.0, 1.0);
        match self {
            Self::Current(width_us) => (part * protocol.current_ramp_ma, width_us.into()),
            Self::Width(ma) => (ma, part * f64::from(protocol.width_ramp_us)),
            Self::Biceps => {
                let pulse = protocol.biceps;
                (pulse.current_ma, pulse.width_us.into())
            }
        }
    }

    /// Returns the value of the ramped quantity: width, µs, in width ramps, otherwise current, mA.
    #[must_use]
    pub const fn ramped_value(self, current_ma: f64, width_us: f64) -> f64 {
        match self {
            Self::Width(_) => width_us,
            _ => current_ma,
        }
    }

    /// Returns the constant quantity with its unit; empty for the biceps.
    #[must_use]
    pub fn constant_value(self) -> String {
        match self {
            Self::Current(width_us) => format!("{width_us} µs"),
            Self::Width(current_ma) => format!("{current_ma} mA"),
            Self::Biceps => String::new(),
        }
    }

    /// Returns the axis label of the ramped quantity, with its unit.
    #[must_use]
    pub const fn axis(self) -> &'static str {
        match self {
            Self::Width(_) => "pulse width (µs)",
            _ => "current (mA)",
        }
    }

    /// Returns the intended pulses of a test, rounded to whole µA and µs. Each has the ramp's value
    /// at its own time; pulses without current or shorter than `LEAST_WIDTH_US` are left out.
    #[must_use]
    pub fn reference_pulses(self, protocol: &Protocol) -> Vec<Pulse> {
        let period_us = period_us(protocol);
        let begin_us = micros(protocol.settle_s);
        let count = micros(protocol.ramp_s) / period_us;
        let pulse = |nth: u64| {
            let (current_ma, width_us) = self.pulse_at(protocol, 1e-6 * (nth * period_us) as f64);
            let current_ma = (1e3 * current_ma).round() / 1e3;
            let width_us = width_us.round() as u32;
            let is_one = current_ma > 0.0 && width_us >= LEAST_WIDTH_US;
            is_one.then_some(Pulse {
                t_us: begin_us + nth * period_us,
                channel: self.pair(),
                drive: Drive::Milliamps(current_ma),
                width_us,
                conducted: false,
            })
        };
        (0..=count).filter_map(pulse).collect()
    }
}

impl Test {
    /// Lists all tests of a wearer: width ramps and current ramps at each angle, then the biceps at
    /// the middle angle.
    #[must_use]
    pub fn all(protocol: &Protocol) -> Vec<Self> {
        let ramps = stimulations(protocol);
        let angles = protocol.angles_deg.iter();
        let ramps =
            angles.flat_map(|&deg| ramps.iter().map(move |&stimulation| (stimulation, deg)));
        let middle = protocol.angles_deg.get(1).copied().unwrap_or(90.0);
        let all = ramps.chain([(Stimulation::Biceps, middle)]);
        let test = |(nth, (stimulation, included_deg))| Self {
            nth,
            stimulation,
            included_deg,
        };
        (0..).zip(all).map(test).collect()
    }
}

/// Lists the ramps, width ramps first as in figure 6.
#[must_use]
pub fn stimulations(protocol: &Protocol) -> Vec<Stimulation> {
    let widths = protocol.width_ramp_currents_ma.iter();
    let currents = protocol.current_ramp_widths_us.iter();
    let widths = widths.map(|&width| Stimulation::Width(width));
    widths
        .chain(currents.map(|&current| Stimulation::Current(current)))
        .collect()
}

/// Returns the pulse period, rounded to whole microseconds.
#[must_use]
pub fn period_us(protocol: &Protocol) -> u64 {
    (1e6 / protocol.frequency_hz).round() as u64
}

/// Converts seconds to whole microseconds.
#[must_use]
pub fn micros(s: f64) -> u64 {
    (1e6 * s).round() as u64
}
