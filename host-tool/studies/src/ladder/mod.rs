//! The judge of the choice of muscle models: drawn sessions that nothing was built on.
//!
//! Lives here: what is drawn (`draw`), the verdicts and their table (`judge`). Not
//! here: the choice (`host_core::choice`), the picture (`figures`).
//! In: a seed. Out: for each muscle of each session and tolerance, the model chosen on
//! one noise seed, its error on another, and the next cheaper one's.

pub mod draw;
pub mod judge;

use host_core::choice::ChoiceError;

/// A drawn session that cannot be.
#[derive(Debug, thiserror::Error)]
#[error("E551 drawn session {index} cannot be: {why}")]
pub struct DrawError {
    /// Which.
    pub index: usize,
    /// What the reader said.
    pub why: String,
}

/// Why nothing was judged.
#[derive(Debug, thiserror::Error)]
pub enum JudgeError {
    /// A mistake of the draw.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// A session that cannot be tried.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
}
