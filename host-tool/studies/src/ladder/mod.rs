//! Judges the selection of muscle models on random sessions that were not used for its development.
//!
//! `draw` generates the sessions from a seed, `judge` computes the verdicts and their table: for
//! each muscle of each session and each tolerance, the model chosen with one noise seed, its error
//! with another, and the error of the next cheaper model. The selection itself is in
//! `host_core::choice`, the figure in `figures`.

pub mod draw;
pub mod judge;

use host_core::choice::ChoiceError;

/// Error for a generated session that the parser refuses.
#[derive(Debug, thiserror::Error)]
#[error(
    "E551 random session {index} is invalid: {why} (an error in the program; please report it)"
)]
pub struct DrawError {
    /// Index of the session, from 0.
    pub index: usize,
    /// Message with which the parser refuses the session.
    pub why: String,
}

/// Reason why a session was not judged.
#[derive(Debug, thiserror::Error)]
pub enum JudgeError {
    /// The generated session is invalid, which is a defect of the generator.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// The session cannot be simulated.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
}
