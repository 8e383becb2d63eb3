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
    /// Seed from which all wearers are generated.
    pub seed: u64,
    pub draws: u64,
    /// Structure and strength of every wearer's muscle.
    pub muscle: MuscleOf,
    /// Settings of the test in which a force is held as long as possible.
    pub hold: Hold,
    /// Settings of the test in which the force decays at a constant amplitude.
    pub open: Open,
    /// Values for the nominal wearer, one parameter varied at a time.
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
    /// Number of groups of motor units; with as many electrodes as groups, one lies under each
    /// electrode.
    pub groups: usize,
    /// Number of motor units in each group; a unit contracts entirely or not at all.
    pub units_per_group: usize,
    /// Pulse rate that defines a wearer's strength, Hz: strength is the mean force of the whole
    /// muscle at this rate.
    pub strength_hz: f64,
}

/// Settings of the test that holds a force: how feedback adjusts the amplitude, and when the force
/// counts as no longer held.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hold {
    /// Reference force as a fraction of the wearer's strength.
    pub wanted: f64,
    /// Length of a feedback window, s. Its mean force determines the amplitude of the next window.
    pub window_s: f64,
    /// Change of the amplitude per window for a relative force error of 1, mA.
    pub gain_ma: f64,
    /// Time within which the reference force must be reached, s. Otherwise the endurance is 0.
    pub reach_within_s: f64,
    /// Fraction of the reference force below which the force counts as no longer held.
    pub below: f64,
    /// Number of windows in the moving mean that is compared with `below`.
    pub average_windows: usize,
    /// Longest test, s; a force that is still held then counts as held at least as long.
    pub most_s: f64,
    /// Delay of the ripple measurement after the force is reached, s.
    pub ripple_from_s: f64,
    /// Duration of the ripple measurement, s.
    pub ripple_for_s: f64,
}

/// Settings of the test at constant amplitude. Feedback first searches the amplitude that reaches
/// the reference force.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Open {
    /// Length of a window, s. During the search, its mean force determines the next amplitude.
    pub window_s: f64,
    /// Change of the amplitude per window for a relative force error of 1, mA.
    pub gain_ma: f64,
    /// Duration of the search for the amplitude, s.
    pub settle_s: f64,
    /// Fraction of the reference force that the last two windows of the search must reach;
    /// otherwise the wearer is not compared.
    pub reached: f64,
    /// Duration of stimulation at the constant amplitude, s.
    pub for_s: f64,
    /// Time over which the initial force is averaged, s, from the start of the constant amplitude.
    pub first_s: f64,
    /// Time over which the remaining force is averaged, s, up to the end of the constant amplitude.
    pub last_s: f64,
}

/// Values that replace one parameter of the nominal wearer or of a condition at a time; all other
/// parameters stay in the middle of their ranges.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axes {
    /// Values of the wearer's parameter `crosstalk`: the part of a foreign group that an electrode
    /// reaches.
    pub crosstalk: Vec<f64>,
    /// Values of the wearer's parameter `reach`: the part of every group that a single electrode
    /// reaches.
    pub reach: Vec<f64>,
    /// Values of the wearer's parameter `activation`, 0 to 1: the part of the fatigue of A that
    /// pulses cause; force causes the rest.
    pub activation: Vec<f64>,
    /// Pulse rate of each electrode in condition `four`, Hz.
    pub rate_hz: Vec<f64>,
    /// Reference force as a fraction of the wearer's strength.
    pub wanted: Vec<f64>,
}

/// One arrangement of electrodes, with its pulse timing and the source of its amplitudes.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Key of the condition in results and claims.
    pub id: String,
    /// Description that the report shows.
    pub says: String,
    /// Number of electrodes: 1, 2 or 4.
    pub electrodes: usize,
    /// Pulse rate of each electrode, Hz.
    pub rate_hz: f64,
    /// Timing of one electrode's pulses relative to those of the others.
    pub phase: Phase,
    /// How the amplitudes are determined.
    pub drive: Drive,
}

/// Timing of one electrode's pulses relative to those of the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Interleaved: the pulses of the electrodes are spread evenly over a period.
    Even,
    /// Simultaneous: all electrodes emit their pulses at the same time.
    Together,
}

/// How the amplitudes of the electrodes are determined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// The host measures the force and adjusts the amplitudes to it.
    Feedback,
    /// The device computes the amplitudes from a muscle model without fatigue for each electrode.
    /// No force is measured.
    CalciumForce,
    /// The device computes the amplitudes from a muscle model with fatigue for each electrode. No
    /// force is measured.
    CalciumForceFatigue,
    /// Feedback searches the amplitude first; then it stays constant.
    Open,
}

impl Drive {
    /// Returns the name of the muscle model that the device uses for each electrode, or `None` if
    /// the device uses none.
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
