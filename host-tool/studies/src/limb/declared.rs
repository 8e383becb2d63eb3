//! What was declared before it was looked at.

use super::LimbError;
use serde::{Deserialize, Serialize};

/// The file itself.
pub const DECLARED: &str = include_str!("../../../experiments/recruitments.toml");

/// host-tool/experiments/recruitments.toml.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LimbDeclaration {
    /// Of all that is drawn.
    pub seed: u64,
    /// Of the device's numbers.
    pub numbers: Numbers,
    /// Who is drawn.
    pub arms: Arms,
    /// What is wanted one by one.
    pub targets: Targets,
    /// What is wanted in turn.
    pub walk: WalkSpec,
    /// What is judged.
    pub claim: Vec<Claim>,
}

/// Of the device's numbers.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Numbers {
    /// How many.
    pub postures: u64,
}

/// Arms around the nominal one, even either way.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Arms {
    /// How many.
    pub draws: u64,
    /// Lengths.
    pub bones_percent: f64,
    /// Each coordinate of each point.
    pub points_mm: f64,
    /// Gains.
    pub gains_percent: f64,
    /// Each angle.
    pub posture_deg: f64,
}

/// Six directions by these.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Targets {
    /// Of what the nearest neighbour can make.
    pub shares: Vec<f64>,
}

/// Around the three planes.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WalkSpec {
    /// Answers once around.
    pub steps: u32,
    /// Answers that one is held for.
    pub hold: u32,
}

/// A claim.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// By which its verdict is found.
    pub name: String,
    /// In words.
    pub says: String,
}

impl LimbDeclaration {
    /// As committed, with other draws where asked.
    ///
    /// # Errors
    /// [`LimbError::Declaration`]: a build of this program with a committed file that
    /// cannot be read.
    pub fn load_embedded() -> Result<Self, LimbError> {
        toml::from_str(DECLARED).map_err(LimbError::Declaration)
    }
}
