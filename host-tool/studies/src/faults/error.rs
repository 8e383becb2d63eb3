//! Errors that prevent a campaign; the effect of an injected fault is not an error.

use hal_sim::chip::board::BoardError;
use host_core::run::ChipError;

/// Reason why a campaign cannot run.
#[derive(Debug, thiserror::Error)]
pub enum FaultsError {
    /// The image lacks a variable whose memory should be flipped.
    #[error(
        "E616 {image} has no variable `{symbol}`, whose memory is to be flipped: it is not the \
         stimulator's image, or it was stripped; name another with --image"
    )]
    NoSymbol {
        /// Path of the image.
        image: String,
        /// Name of the missing variable.
        symbol: String,
    },
    /// The board does not stimulate even without a fault.
    #[error("E617 without any fault the board does not come to stimulate: {0}")]
    NeverStimulates(String),
    /// The judge calls the output severe even without a fault.
    #[error("E618 without any fault the judge calls the output severe: {0}")]
    SevereItself(String),
    /// Only the chip simulator can simulate this class.
    #[error(
        "E620 --class {0} needs --device chip: the native simulator has no memory or registers"
    )]
    ChipOnly(&'static str),
    /// A built-in campaign file is invalid.
    #[error("E619 what the campaigns declare cannot be read: {0}")]
    Declaration(String),
    /// The folder contains cases in the format of an earlier version.
    #[error(
        "E790 {0} has a campaign that an earlier program kept in faults.jsonl; only that program \
         goes on with it: name another folder with --out (report and compare still read it)"
    )]
    Earlier(String),
    /// The chip simulator or its image failed.
    #[error(transparent)]
    Chip(#[from] ChipError),
}

impl From<BoardError> for FaultsError {
    fn from(error: BoardError) -> Self {
        Self::Chip(error.into())
    }
}

/// Creates the error for a board that fails before any fault.
pub(super) fn never_runs(why: impl ToString) -> FaultsError {
    FaultsError::NeverStimulates(why.to_string())
}
