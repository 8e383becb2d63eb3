//! Reads the preregistered declaration `distributed.toml`.

use super::error::DistributedError;
use crate::laboratory::{DrawClaim, Range};
use serde::Deserialize;

/// Text of the committed declaration.
pub const DECLARED: &str = include_str!("../../../experiments/distributed.toml");

/// Content of `host-tool/experiments/distributed.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DistributedDeclaration {
    /// Heading of the report page.
    pub title: String,
    /// Papers on which the study is based.
    pub source: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of random wearers.
    pub draws: u64,
    /// Size and strength of every wearer's muscle.
    pub muscle: MuscleOf,
    /// Test that holds a force.
    pub hold: Hold,
    /// Test with a constant amplitude.
    pub open: Open,
    /// Values of the axes along which the nominal wearer is varied.
    pub axes: Axes,
    /// Arrangements of electrodes that are compared.
    #[serde(rename = "condition")]
    pub conditions: Vec<Condition>,
    /// Ranges of the wearers' random parameters.
    #[serde(rename = "range")]
    pub ranges: Vec<Range>,
    /// Claims that are judged for each wearer.
    #[serde(rename = "claim")]
    pub claims: Vec<DrawClaim>,
}

/// Properties that the muscles of all wearers share.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MuscleOf {
    /// Number of groups of motor units.
    pub groups: usize,
    /// Number of motor units in each group.
    pub units_per_group: usize,
    /// Pulse rate at which the mean force of the whole muscle defines a wearer's strength, Hz.
    pub strength_hz: f64,
}

/// How a force is held, and when the hold ends.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hold {
    /// Reference force as a fraction of the wearer's strength.
    pub wanted: f64,
    /// Time from one amplitude to the next, s.
    pub window_s: f64,
    /// Change of the amplitude for a relative error of 1, mA.
    pub gain_ma: f64,
    /// Time within which the reference force must be reached, s. Otherwise it counts as not held.
    pub reach_within_s: f64,
    /// Fraction of the reference force below which the hold ends.
    pub below: f64,
    /// Number of windows in the moving mean that is compared with `below`.
    pub average_windows: usize,
    /// Longest hold, s.
    pub most_s: f64,
    /// Delay of the ripple measurement after the force is reached, s.
    pub ripple_from_s: f64,
    /// Duration of the ripple measurement, s.
    pub ripple_for_s: f64,
}

/// How feedback finds an amplitude, which then stays constant.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Open {
    /// Time from one amplitude to the next during the search, s.
    pub window_s: f64,
    /// Change of the amplitude for a relative error of 1, mA.
    pub gain_ma: f64,
    /// Duration of the search, s.
    pub settle_s: f64,
    /// Fraction of the reference force that the search must reach.
    pub reached: f64,
    /// Duration of the constant amplitude, s.
    pub for_s: f64,
    /// Length of the mean at the start of the constant amplitude, s.
    pub first_s: f64,
    /// Length of the mean at the end of the constant amplitude, s.
    pub last_s: f64,
}

/// Values of the nominal wearer along each axis.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axes {
    /// Values in place of the range `crosstalk`.
    pub crosstalk: Vec<f64>,
    /// Values in place of the range `reach`.
    pub reach: Vec<f64>,
    /// Values in place of the range `activation`, here up to 1.
    pub activation: Vec<f64>,
    /// Pulse rates of each of four electrodes, Hz.
    pub rate_hz: Vec<f64>,
    /// Reference forces as fractions of the wearer's strength.
    pub wanted: Vec<f64>,
}

/// Number, timing and drive of the electrodes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Key in results and claims.
    pub id: String,
    /// Description for the report.
    pub says: String,
    /// Number of electrodes: 1, 2 or 4.
    pub electrodes: usize,
    /// Pulse rate of each electrode, Hz.
    pub rate_hz: f64,
    /// Timing of the electrodes' pulses relative to each other.
    pub phase: Phase,
    /// Source of the amplitudes.
    pub drive: Drive,
}

/// Timing of the electrodes' pulses relative to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Spread evenly over a period.
    Even,
    /// All at the same time.
    Together,
}

/// Source of the amplitudes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// The host adjusts them to the measured force.
    Feedback,
    /// The device computes them from muscle models without fatigue. No force is measured.
    CalciumForce,
    /// The device computes them from muscle models with fatigue. No force is measured.
    CalciumForceFatigue,
    /// They stay constant after feedback has found a value.
    Open,
}

impl Drive {
    /// Returns the name of the device's muscle model for each electrode, or `None` if it uses no
    /// model.
    #[must_use]
    pub const fn model(self) -> Option<&'static str> {
        match self {
            Self::CalciumForce => Some("calcium-force"),
            Self::CalciumForceFatigue => Some("calcium-force-fatigue"),
            Self::Feedback | Self::Open => None,
        }
    }
}

impl DistributedDeclaration {
    /// Parses the committed declaration.
    ///
    /// # Errors
    /// Returns E722 if the declaration cannot be parsed.
    pub fn load_embedded() -> Result<Self, DistributedError> {
        toml::from_str(DECLARED).map_err(|e| DistributedError::Declaration(e.to_string()))
    }

    /// Returns the condition with this id.
    ///
    /// # Errors
    /// Returns E722 if there is no such condition.
    pub fn condition(&self, id: &str) -> Result<&Condition, DistributedError> {
        let found = self.conditions.iter().find(|condition| condition.id == id);
        found.ok_or_else(|| DistributedError::Declaration(format!("no condition `{id}`")))
    }
}
