//! What was written before any result was looked at: `distributed.toml`.

use super::error::DistributedError;
use crate::laboratory::{DrawClaim, Range};
use serde::Deserialize;

/// The declaration, as the program has it.
pub const DECLARED: &str = include_str!("../../../experiments/distributed.toml");

/// The declaration.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DistributedDeclaration {
    /// The page's heading.
    pub title: String,
    /// Papers.
    pub source: String,
    /// Of every draw.
    pub seed: u64,
    /// Persons drawn.
    pub draws: u64,
    /// The muscle.
    pub muscle: MuscleOf,
    /// A held force.
    pub hold: Hold,
    /// A constant amplitude.
    pub open: Open,
    /// Along which a middle person goes.
    pub axes: Axes,
    /// How electrodes are driven.
    #[serde(rename = "condition")]
    pub conditions: Vec<Condition>,
    /// What is drawn of a person.
    #[serde(rename = "range")]
    pub ranges: Vec<Range>,
    /// What is judged of each person.
    #[serde(rename = "claim")]
    pub claims: Vec<DrawClaim>,
}

/// What every person's muscle is.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MuscleOf {
    /// Of motor units.
    pub groups: usize,
    /// Of each group.
    pub units_per_group: usize,
    /// At which the whole muscle's mean force is a person's strength, Hz.
    pub strength_hz: f64,
}

/// How a force is held, and when it is not any more.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hold {
    /// Part of the person's strength.
    pub wanted: f64,
    /// From one amplitude to the next, s.
    pub window_s: f64,
    /// For a relative error of 1, mA.
    pub gain_ma: f64,
    /// The wanted force is reached within so long, or it is not held, s.
    pub reach_within_s: f64,
    /// Part of the wanted force below which it is held no more.
    pub below: f64,
    /// Windows over which that is judged.
    pub average_windows: usize,
    /// Longest, s.
    pub most_s: f64,
    /// Ripple is judged so long after the force is reached, s.
    pub ripple_from_s: f64,
    /// For so long, s.
    pub ripple_for_s: f64,
}

/// A constant amplitude.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Open {
    /// From one amplitude to the next while it is looked for, s.
    pub window_s: f64,
    /// For a relative error of 1, mA.
    pub gain_ma: f64,
    /// It is looked for so long, s.
    pub settle_s: f64,
    /// Part of the wanted force that feedback is to have found.
    pub reached: f64,
    /// Then constant for, s.
    pub for_s: f64,
    /// Mean of the first, s.
    pub first_s: f64,
    /// Mean of the last, s.
    pub last_s: f64,
}

/// Values along each axis.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Axes {
    /// Of the range of that name.
    pub crosstalk: Vec<f64>,
    /// Of the range of that name.
    pub reach: Vec<f64>,
    /// Of the range of that name, here up to 1.
    pub activation: Vec<f64>,
    /// Of each of four electrodes, Hz.
    pub rate_hz: Vec<f64>,
    /// Part of the person's strength that is held.
    pub wanted: Vec<f64>,
}

/// How electrodes are driven.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// For machines.
    pub id: String,
    /// For people.
    pub says: String,
    /// 1, 2 or 4.
    pub electrodes: usize,
    /// Of each, Hz.
    pub rate_hz: f64,
    /// When they pulse.
    pub phase: Phase,
    /// What decides amplitudes.
    pub drive: Drive,
}

/// When electrodes pulse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    /// Spread over a period.
    Even,
    /// At once.
    Together,
}

/// What decides amplitudes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Drive {
    /// The host, by measured force.
    Feedback,
    /// The device, by muscles that do not tire. Nothing is measured.
    CalciumForce,
    /// The device, by muscles that tire. Nothing is measured.
    CalciumForceFatigue,
    /// Nothing, once feedback has found one.
    Open,
}

impl Drive {
    /// The device's model of each electrode's muscle.
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
    /// The program's own.
    ///
    /// # Errors
    /// E722: it cannot be read.
    pub fn load_embedded() -> Result<Self, DistributedError> {
        toml::from_str(DECLARED).map_err(|e| DistributedError::Declaration(e.to_string()))
    }

    /// The condition of this name.
    ///
    /// # Errors
    /// E722: there is none.
    pub fn condition(&self, id: &str) -> Result<&Condition, DistributedError> {
        let found = self.conditions.iter().find(|condition| condition.id == id);
        found.ok_or_else(|| DistributedError::Declaration(format!("no condition `{id}`")))
    }
}
