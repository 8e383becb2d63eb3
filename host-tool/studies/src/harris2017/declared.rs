//! What was written before any result was looked at: `harris-ramps.toml`.

use super::error::RampsError;
use crate::laboratory::{DrawClaim as JudgedClaim, Range};
use serde::Deserialize;

/// The declaration, as the program has it.
pub const DECLARED: &str = include_str!("../../../experiments/harris-ramps.toml");

/// The declaration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RampsDeclaration {
    /// The page's heading.
    pub title: String,
    /// Paper and sections.
    pub source: String,
    /// Of every draw.
    pub seed: u64,
    /// Persons drawn.
    pub draws: u64,
    /// As section 3.3 has it.
    pub protocol: Protocol,
    /// How traces are judged.
    pub judged: TraceCriteria,
    /// Thresholds of the bench.
    pub strength_duration: Thresholds,
    /// Beyond the device's limits.
    pub beyond: EqualPulses,
    /// What is drawn of a person.
    #[serde(rename = "range")]
    pub ranges: Vec<Range>,
    /// What is judged of each person.
    #[serde(rename = "claim")]
    pub claims: Vec<JudgedClaim>,
}

/// Ramps, angles, rests.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Between forearm and upper arm, °.
    pub angles_deg: Vec<f64>,
    /// A test's angle is off by at most so much, evenly, °.
    pub setting_error_deg: f64,
    /// Where current ramps end, mA.
    pub current_ramp_ma: f64,
    /// Their widths, µs.
    pub current_ramp_widths_us: Vec<u32>,
    /// Where width ramps end, µs.
    pub width_ramp_us: u32,
    /// Their currents, mA.
    pub width_ramp_currents_ma: Vec<f64>,
    /// Of the pair on the biceps.
    pub biceps: PulseOf,
    /// Between tests, s.
    pub rest_s: f64,
    /// From 0 to a ramp's end, s.
    pub ramp_s: f64,
    /// Without pulses before a ramp, s.
    pub settle_s: f64,
    /// Of the pulses, Hz.
    pub frequency_hz: f64,
}

/// A pulse.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PulseOf {
    /// mA.
    pub current_ma: f64,
    /// µs.
    pub width_us: u32,
}

/// How traces are judged.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TraceCriteria {
    /// Of the cell's signal, ms.
    pub average_ms: f64,
    /// Where a torque begins, N·m.
    pub detected_nm: f64,
    /// A muscle answers from this part of what can be reached on.
    pub recruited: f64,
    /// Another muscle counts as stimulated from this torque on, N·m.
    pub others_nm: f64,
    /// Or, of one without a torque, from this part on.
    pub others_part: f64,
    /// By how much a torque that falls ends below its peak, as a part.
    pub falls_by: f64,
    /// Within what part torques are alike.
    pub same_within: f64,
    /// Of tests.
    pub level: f64,
}

/// How thresholds of the bench are looked for.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thresholds {
    /// µs.
    pub widths_us: Vec<u32>,
    /// First steps, mA.
    pub coarse_ma: f64,
    /// Last steps, mA.
    pub step_ma: f64,
    /// Of each step, s.
    pub step_s: f64,
    /// From this torque on a step answers, N·m.
    pub detected_nm: f64,
    /// Assumed points of the recommended maximum, µs and mA.
    pub upper: Vec<(u32, f64)>,
    /// Nothing above it is recommended, mA.
    pub upper_most_ma: f64,
}

/// Two pulses that a strength–duration law of 200 µs makes equal.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EqualPulses {
    /// Long and weak.
    pub first: PulseOf,
    /// Short and strong.
    pub second: PulseOf,
}

impl RampsDeclaration {
    /// The program's own.
    ///
    /// # Errors
    /// E690: it cannot be read.
    pub fn load_embedded() -> Result<Self, RampsError> {
        toml::from_str(DECLARED).map_err(|e| RampsError::Declaration(e.to_string()))
    }

    /// What is drawn for person `index`, a number for each range in their order: every one of
    /// the same seed has the same numbers, whatever is drawn beside.
    #[must_use]
    pub fn draw_values(&self, seed: u64, index: u64) -> Vec<f64> {
        Range::draw_values(&self.ranges, seed, index)
    }

    /// What is `draw_values` for the range of this field.
    ///
    /// # Errors
    /// E690: there is no such range.
    pub fn value(&self, drawn: &[f64], field: &str) -> Result<f64, RampsError> {
        let value = Range::value(&self.ranges, drawn, field);
        value.ok_or_else(|| RampsError::Declaration(format!("no range for `{field}`")))
    }
}
