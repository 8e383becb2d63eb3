//! Why a campaign cannot be played. What a fault does is no error.

use hal_sim::chip::board::BoardError;
use host_core::run::ChipError;

/// What stands against a campaign.
#[derive(Debug, thiserror::Error)]
pub enum FaultsError {
    /// What is flashed has not what is to be broken.
    #[error(
        "E616 {image} has no variable `{symbol}`, whose memory is to be flipped: it is not the \
         stimulator's image, or it was stripped; name another with --image"
    )]
    NoSymbol {
        /// The image.
        image: String,
        /// What is missing.
        symbol: String,
    },
    /// Before anything was broken.
    #[error("E617 without any fault the board does not come to stimulate: {0}")]
    NeverStimulates(String),
    /// Before anything was broken.
    #[error("E618 without any fault the judge calls the output severe: {0}")]
    SevereItself(String),
    /// Of the simulators only one has it.
    #[error(
        "E620 --class {0} needs --device chip: the native simulator has no memory or registers"
    )]
    ChipOnly(&'static str),
    /// The program's own files.
    #[error("E619 what the campaigns declare cannot be read: {0}")]
    Declaration(String),
    /// Cases of a program from before campaigns were kept as every study is.
    #[error(
        "E790 {0} has a campaign that an earlier program kept in faults.jsonl; only that program \
         goes on with it: name another folder with --out (report and compare still read it)"
    )]
    Earlier(String),
    /// The chip simulator or its image.
    #[error(transparent)]
    Chip(#[from] ChipError),
}

impl From<BoardError> for FaultsError {
    fn from(error: BoardError) -> Self {
        Self::Chip(error.into())
    }
}

/// Before anything broke.
pub(super) fn never_runs(why: impl ToString) -> FaultsError {
    FaultsError::NeverStimulates(why.to_string())
}
