//! Reads the preregistered study of recruitment methods.

use super::LimbError;
use serde::{Deserialize, Serialize};

/// Text of the committed declaration.
pub const DECLARED: &str = include_str!("../../../experiments/recruitments.toml");

/// Content of `host-tool/experiments/recruitments.toml`.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LimbDeclaration {
    /// Seed of all random numbers of the study.
    pub seed: u64,
    /// Study of the error that the device's number format adds.
    pub numbers: Numbers,
    /// Random arms on which the methods are compared.
    pub arms: Arms,
    /// Forces that are asked for independently of each other.
    pub targets: Targets,
    /// Forces that are asked for one after the other along a circle.
    pub walk: WalkSpec,
    /// Claims that the study judges.
    pub claim: Vec<Claim>,
}

/// Size of the study of the device's number format.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Numbers {
    /// Number of random postures.
    pub postures: u64,
}

/// Random arms around the nominal one, with uniform changes in both directions.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Arms {
    /// Number of random arms.
    pub draws: u64,
    /// Largest change of a bone's length, %.
    pub bones_percent: f64,
    /// Largest change of each coordinate of each muscle point, mm.
    pub points_mm: f64,
    /// Largest change of a line's gain, %.
    pub gains_percent: f64,
    /// Largest change of each joint angle, °.
    pub posture_deg: f64,
}

/// Reference forces in six directions.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Targets {
    /// Magnitudes as shares of the largest force that the nearest neighbour method can make in that
    /// direction.
    pub shares: Vec<f64>,
}

/// Walks around a circle in each of the three coordinate planes.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WalkSpec {
    /// Number of steps in one round.
    pub steps: u32,
    /// Number of steps for which one answer is held.
    pub hold: u32,
}

/// Claim to be judged on the random arms.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Key by which the rule of the verdict is found.
    pub name: String,
    /// Wording of the claim.
    pub says: String,
}

impl LimbDeclaration {
    /// Parses the committed declaration.
    ///
    /// # Errors
    /// Returns [`LimbError::Declaration`] if the committed file that this program was built with
    /// cannot be parsed.
    pub fn load_embedded() -> Result<Self, LimbError> {
        toml::from_str(DECLARED).map_err(LimbError::Declaration)
    }
}
