//! Reads the preregistered declaration `harris-ramps.toml`.

use super::error::RampsError;
use crate::laboratory::{DrawClaim as JudgedClaim, Range};
use serde::Deserialize;

/// Text of the declaration `host-tool/experiments/harris-ramps.toml`.
pub const DECLARED: &str = include_str!("../../../experiments/harris-ramps.toml");

/// Content of `host-tool/experiments/harris-ramps.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RampsDeclaration {
    /// Heading of the report page.
    pub title: String,
    /// Paper and sections on which the study is based.
    pub source: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of random wearers.
    pub draws: u64,
    /// Protocol of section 3.3.
    pub protocol: Protocol,
    /// Criteria for the evaluation of torque traces.
    pub judged: TraceCriteria,
    /// Search for thresholds with the test rig.
    pub strength_duration: Thresholds,
    /// Two pulses that are equivalent for a chronaxie of 200 µs. No device of this program can play
    /// both.
    pub beyond: EqualPulses,
    /// Ranges of the wearers' random parameters.
    #[serde(rename = "range")]
    pub ranges: Vec<Range>,
    /// Claims that are judged for each wearer.
    #[serde(rename = "claim")]
    pub claims: Vec<JudgedClaim>,
}

/// Angles, ramps and rests of the tests.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Angles between forearm and upper arm, °.
    pub angles_deg: Vec<f64>,
    /// Largest error of a test's angle, uniformly distributed, °.
    pub setting_error_deg: f64,
    /// End of the current ramps, mA.
    pub current_ramp_ma: f64,
    /// Constant pulse widths of the current ramps, µs.
    pub current_ramp_widths_us: Vec<u32>,
    /// End of the width ramps, µs.
    pub width_ramp_us: u32,
    /// Constant currents of the width ramps, mA.
    pub width_ramp_currents_ma: Vec<f64>,
    /// Constant pulse of the electrode pair on the biceps.
    pub biceps: PulseOf,
    /// Rest between tests, s.
    pub rest_s: f64,
    /// Duration of a ramp, s.
    pub ramp_s: f64,
    /// Time without pulses before a ramp, s.
    pub settle_s: f64,
    /// Pulse rate, Hz.
    pub frequency_hz: f64,
}

/// Current and width of a pulse.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PulseOf {
    pub current_ma: f64,
    pub width_us: u32,
}

/// Criteria for the evaluation of torque traces.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TraceCriteria {
    /// Length of the moving mean over the cell's signal, ms.
    pub average_ms: f64,
    /// Torque from which on a contraction counts as detected, N·m.
    pub detected_nm: f64,
    /// Share of the reachable fibres from which on a muscle counts as responding.
    pub recruited: f64,
    /// Torque from which on another muscle counts as stimulated, N·m.
    pub others_nm: f64,
    /// Excited share from which on a muscle without a torque at the elbow counts as stimulated.
    pub others_part: f64,
    /// Tolerance of a rising torque: the fraction by which its end may lie below its peak.
    pub falls_by: f64,
    /// Largest relative difference of torques that count as alike.
    pub same_within: f64,
    /// Significance level of tests.
    pub level: f64,
}

/// Search for thresholds with the test rig, and the assumed recommended maximum.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thresholds {
    /// Pulse widths of the search, µs.
    pub widths_us: Vec<u32>,
    /// Step of the coarse search, mA.
    pub coarse_ma: f64,
    /// Step of the fine search, mA.
    pub step_ma: f64,
    /// Duration of each step, s.
    pub step_s: f64,
    /// Torque from which on a step counts as a response, N·m.
    pub detected_nm: f64,
    /// Assumed points of the recommended maximum, µs and mA.
    pub upper: Vec<(u32, f64)>,
    /// Upper bound of the recommended maximum, mA.
    pub upper_most_ma: f64,
}

/// Two pulses that are equivalent under a strength–duration law with a chronaxie of 200 µs.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EqualPulses {
    /// Long and weak pulse.
    pub first: PulseOf,
    /// Short and strong pulse.
    pub second: PulseOf,
}

impl RampsDeclaration {
    /// Parses the declaration `harris-ramps.toml` that is part of the program.
    ///
    /// # Errors
    /// Returns E690 if the declaration cannot be parsed.
    pub fn load_embedded() -> Result<Self, RampsError> {
        toml::from_str(DECLARED).map_err(|e| RampsError::Declaration(e.to_string()))
    }

    /// Generates the random parameters of wearer `index`, one for each range in their order. They
    /// depend only on the seed and the index.
    #[must_use]
    pub fn draw_values(&self, seed: u64, index: u64) -> Vec<f64> {
        Range::draw_values(&self.ranges, seed, index)
    }

    /// Returns the value in `drawn` that belongs to the range `field`.
    ///
    /// # Errors
    /// Returns E690 if there is no such range.
    pub fn value(&self, drawn: &[f64], field: &str) -> Result<f64, RampsError> {
        let value = Range::value(&self.ranges, drawn, field);
        value.ok_or_else(|| RampsError::Declaration(format!("no range for `{field}`")))
    }
}
