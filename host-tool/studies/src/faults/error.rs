//! Errors that prevent a campaign; the effect of an injected fault is not an error.

use hal_sim::chip::board::BoardError;
use host_core::run::ChipError;

/// Reason why a campaign cannot run.
#[derive(Debug, thiserror::Error)]
pub enum FaultsError {
    /// The image lacks a variable in whose memory bits are to be flipped.
    #[error(
        "E616 {image} has no variable `{symbol}`, in which bits are to be flipped: it is not the \
         stimulator's image, or it was stripped; give another image with --image"
    )]
    NoSymbol {
        image: String,
        /// Name of the missing variable.
        symbol: String,
    },
    /// The board does not stimulate even without a fault; contains the reason.
    #[error(
        "E617 the board does not stimulate even without an injected fault ({0}): correct the image, or the session of the campaign"
    )]
    NeverStimulates(String),
    /// The judge calls the output severe even without a fault; contains the finding.
    #[error(
        "E618 even without an injected fault a pulse exceeds what is allowed ({0}): correct the \
         image or the session of the campaign first"
    )]
    SevereItself(String),
    /// The class of faults needs the chip simulator; contains the name of the class.
    #[error(
        "E620 --class {0} needs --device chip: the native simulator has no memory or registers"
    )]
    ChipOnly(&'static str),
    /// The declaration of a campaign cannot be read; contains file and reason.
    #[error(
        "E619 the declaration of the fault campaigns is invalid: {0}; restore the file in host-tool/experiments/faults and build again"
    )]
    Declaration(String),
    /// The folder contains cases in the format of an earlier version.
    #[error(
        "E790 {0} has a campaign in faults.jsonl, the format of an earlier program; only that \
         program can continue it: give another folder with --out (report and compare still read \
         it)"
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
