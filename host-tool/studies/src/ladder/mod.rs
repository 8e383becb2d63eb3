//! Judges the selection of muscle models on random sessions that were not used for its development.
//!
//! `draw` generates the sessions from a seed, `judge` computes the verdicts and their table: for
//! each muscle of each session and each tolerance, the model chosen with one noise seed, its error
//! with another, and the error of the next cheaper model. The selection itself is in
//! `host_core::choice`, the figure in `figures`.

pub mod draw;
pub mod judge;

use host_core::choice::ChoiceError;

/// A random session that is invalid.
#[derive(Debug, thiserror::Error)]
#[error("E551 random session {index} is invalid: {why}")]
pub struct DrawError {
    /// Index of the session.
    pub index: usize,
    /// Message of the parser.
    pub why: String,
}

/// The reason why a session was not judged.
#[derive(Debug, thiserror::Error)]
pub enum JudgeError {
    /// The session is invalid, a defect of the generator.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// The session cannot be simulated.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
}
