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
    /// Settings of the study of the error that the device's number format adds.
    pub numbers: Numbers,
    /// Random arms on which the recruitment methods are compared.
    pub arms: Arms,
    /// Reference forces that are independent of each other.
    pub targets: Targets,
    /// Reference force that turns around a circle in steps, so that successive forces are similar.
    pub walk: WalkSpec,
    /// Claims that the study judges on every random arm.
    pub claim: Vec<Claim>,
}

/// Settings of the study of the device's number format.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Numbers {
    /// Number of random postures of the nominal arm.
    pub postures: u64,
}

/// Random arms. They differ from the nominal arm by random changes, uniform up to the given amount
/// in both directions.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Arms {
    pub draws: u64,
    /// Largest change of a bone's length, %.
    pub bones_percent: f64,
    /// Largest change of each coordinate of a point at which a muscle is attached or deflected, mm.
    pub points_mm: f64,
    /// Largest change of the force per current of a line, %.
    pub gains_percent: f64,
    /// Largest change of each joint angle from the nominal posture, °.
    pub posture_deg: f64,
}

/// Independent reference forces, in six directions.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Targets {
    /// Magnitudes of the reference forces, as fractions of the largest force that the nearest
    /// neighbour method can make in the same direction.
    pub shares: Vec<f64>,
}

/// Walks of the reference force: in each of the three coordinate planes it turns once around a
/// circle, in steps.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WalkSpec {
    /// Number of steps in which the reference force turns around the circle.
    pub steps: u32,
    /// Number of steps for which computed line forces are kept, to determine the error of a slower
    /// computation.
    pub hold: u32,
}

/// Claim that is judged on every random arm.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Key that selects the rule by which the claim is judged.
    pub name: String,
    /// The claim as a sentence.
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
