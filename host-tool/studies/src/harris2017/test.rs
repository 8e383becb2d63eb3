//! The tests of section 3.3: what is stimulated, at which angle.

use super::declared::Protocol;
use hal_sim::body::bench::CellSide;
use hal_sim::body::bench::elbow::{BICEPS, TRICEPS};
use hal_sim::body::{Drive, Pulse};
use serde::{Deserialize, Serialize};

/// Below this no stage plays a pulse, µs (docs/protocol.md).
pub const LEAST_WIDTH_US: u32 = 10;

/// What is stimulated in a test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Stimulation {
    /// Current from 0 to the ramp's end, at this width, µs.
    Current(u32),
    /// Width from 0 to the ramp's end, at this current, mA.
    Width(f64),
    /// The pair on the biceps, as the wall experiment's co-contraction.
    Biceps,
}

/// A test.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Test {
    /// Its place among a person's tests, from 0.
    pub nth: u64,
    /// What is stimulated.
    pub stimulation: Stimulation,
    /// Angle meant, °.
    pub included_deg: f64,
}

impl Stimulation {
    /// For people.
    #[must_use]
    pub fn in_words(self) -> String {
        match self {
            Self::Current(width_us) => format!("current ramp at {width_us} µs"),
            Self::Width(current_ma) => format!("width ramp at {current_ma} mA"),
            Self::Biceps => "biceps".to_owned(),
        }
    }

    /// For machines.
    #[must_use]
    pub fn id(self) -> String {
        match self {
            Self::Current(width_us) => format!("current-{width_us}us"),
            Self::Width(current_ma) => format!("width-{current_ma}mA"),
            Self::Biceps => "biceps".to_owned(),
        }
    }

    /// The pair that stimulates.
    #[must_use]
    pub const fn pair(self) -> usize {
        match self {
            Self::Biceps => BICEPS,
            _ => TRICEPS,
        }
    }

    /// Which way the cell is mounted for it.
    #[must_use]
    pub const fn holds(self) -> CellSide {
        match self {
            Self::Biceps => CellSide::Flexion,
            _ => CellSide::Extension,
        }
    }

    /// Current, mA, and width, µs, `t_s` after the ramp's begin.
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

    /// What is ramped, of this pulse: mA or µs; of the biceps, mA.
    #[must_use]
    pub const fn ramped_value(self, current_ma: f64, width_us: f64) -> f64 {
        match self {
            Self::Width(_) => width_us,
            _ => current_ma,
        }
    }

    /// What is held, with its unit.
    #[must_use]
    pub fn constant_value(self) -> String {
        match self {
            Self::Current(width_us) => format!("{width_us} µs"),
            Self::Width(current_ma) => format!("{current_ma} mA"),
            Self::Biceps => String::new(),
        }
    }

    /// What is ramped, and its unit.
    #[must_use]
    pub const fn axis(self) -> &'static str {
        match self {
            Self::Width(_) => "pulse width (µs)",
            _ => "current (mA)",
        }
    }

    /// The pulses of a test as they are meant: in whole thousandths of a milliampere and
    /// whole microseconds, each with what is ramped when it comes; none shorter than a stage
    /// plays, none without a current.
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
    /// All of a person's: width ramps and current ramps at each angle, then the biceps at the
    /// middle one.
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

/// The ramps, those of width first, as figure 6 has them.
#[must_use]
pub fn stimulations(protocol: &Protocol) -> Vec<Stimulation> {
    let widths = protocol.width_ramp_currents_ma.iter();
    let currents = protocol.current_ramp_widths_us.iter();
    let widths = widths.map(|&width| Stimulation::Width(width));
    widths
        .chain(currents.map(|&current| Stimulation::Current(current)))
        .collect()
}

/// From pulse to pulse, µs.
#[must_use]
pub fn period_us(protocol: &Protocol) -> u64 {
    (1e6 / protocol.frequency_hz).round() as u64
}

/// Whole microseconds.
#[must_use]
pub fn micros(s: f64) -> u64 {
    (1e6 * s).round() as u64
}
