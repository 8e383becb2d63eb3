//! What recruitments give and how they switch, and what the device's numbers add.
//!
//! Lives here: the arms drawn, the comparison of the nearest neighbour with least
//! squares, micromath's share of the error at the hand, the claims. Declared in
//! `host-tool/experiments/recruitments.toml`. Not here: the recruitments
//! (`firmware::limb`, `host_core::limb`), a body, a person.
//! In: the declaration. Out: a [`Study`] with its rows and shares.

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

/// Why there is no study.
#[derive(Debug, thiserror::Error)]
pub enum LimbError {
    /// The committed declaration.
    #[error("E707 host-tool/experiments/recruitments.toml cannot be read: {0}")]
    Declaration(toml::de::Error),
    /// An arm or a posture.
    #[error(transparent)]
    Trouble(#[from] RecruitmentError),
}

/// All that came.
#[derive(Clone, Debug)]
pub struct Study {
    /// What was declared.
    pub declared: LimbDeclaration,
    /// Of the device's numbers.
    pub numbers: Numbers,
    /// Every arm.
    pub arms: Vec<ArmScores>,
}

/// The declared study, with `draws` arms instead of the declared where some are named.
///
/// # Errors
/// [`LimbError`].
pub fn study(draws: Option<u64>) -> Result<Study, LimbError> {
    let mut declared = LimbDeclaration::load_embedded()?;
    declared.arms.draws = draws.unwrap_or(declared.arms.draws);
    Ok(Study {
        numbers: numbers(&declared)?,
        arms: compare_arms(&declared)?,
        declared,
    })
}
