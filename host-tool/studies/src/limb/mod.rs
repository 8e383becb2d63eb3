//! Study of how well recruitment methods reach a force at the hand, how abruptly they switch
//! muscles, and how much error the device's number format adds.
//!
//! Takes the declaration `host-tool/experiments/recruitments.toml`. Returns a [`Study`], from which
//! rows and verdicts are computed. It generates the random arms, compares the nearest neighbour
//! method with least squares, and measures the share of the error that micromath adds. The methods
//! themselves are in `firmware::limb` and `host_core::limb`. No body or person is simulated.

mod arms;
mod compared;
mod declared;
mod method;
mod numbers;
mod pace;
mod table;

pub use compared::{ArmScore, ArmScores, compare_arms};
pub use declared::{DECLARED, LimbDeclaration};
pub use method::{Arm, Method, Recruiter, choices, forces_of_choices};
pub use numbers::{Numbers, Spread, numbers};
pub use pace::{Pace, pace};
pub use table::{Row, Verdict};

use host_core::limb::RecruitmentError;

/// Reason why the study cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum LimbError {
    /// The committed declaration cannot be parsed.
    #[error("E707 the declaration host-tool/experiments/recruitments.toml is invalid: {0}")]
    Declaration(toml::de::Error),
    /// The arm or a posture is invalid, or no forces can be computed for it.
    #[error(transparent)]
    Trouble(#[from] RecruitmentError),
}

/// Result of the study, from which tables and verdicts follow.
#[derive(Clone, Debug)]
pub struct Study {
    /// Declaration of the study; its number of arms is the one that was used.
    pub declared: LimbDeclaration,
    /// Errors that the device's number format adds.
    pub numbers: Numbers,
    /// Scores of the methods, one entry per random arm.
    pub arms: Vec<ArmScores>,
}

/// Carries out the preregistered study. If `draws` is given, it replaces the declared number of
/// random arms.
///
/// # Errors
/// Returns [`LimbError`] if the declaration cannot be parsed, or an arm or posture is refused.
pub fn study(draws: Option<u64>) -> Result<Study, LimbError> {
    let mut declared = LimbDeclaration::load_embedded()?;
    declared.arms.draws = draws.unwrap_or(declared.arms.draws);
    Ok(Study {
        numbers: numbers(&declared)?,
        arms: compare_arms(&declared)?,
        declared,
    })
}
