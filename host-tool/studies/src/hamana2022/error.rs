//! Errors of the studies of Hamana 2022.

use crate::laboratory::LaboratoryError;
use hal_sim::body::hand::{InvalidHand, network::InvalidSegment};
use host_core::run::OpenError;
use host_core::session::SessionError;

/// The reason why a study of two points cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum TwoPointsError {
    /// The declaration is invalid.
    #[error("E621 the population's declaration: {0}")]
    Declaration(String),
    /// No wearer has this name.
    #[error("E624 there is no wearer `{0}`; there are P, Q, R and S, or a file that ends in .toml")]
    Nobody(String),
    /// No ablation has this name: the name, and those that exist.
    #[error("E627 there is no departure `{0}`; there are {1}")]
    NoDeparture(String, String),
    /// A wearer file lacks values that these studies need: the file, and the values.
    #[error("E625 {0}: {1}")]
    Wearer(String, String),
    /// A wearer file has mistakes or cannot be read.
    #[error(transparent)]
    File(#[from] SessionError),
    /// The device does not play a pattern as intended: the pattern, and the reason.
    #[error("E628 {0}: the device does not put it out as the body alone is given it: {1}")]
    PutOut(String, String),
    /// The device cannot be opened.
    #[error(transparent)]
    Device(#[from] OpenError),
    /// A random hand is invalid.
    #[error("E622 a drawn hand cannot be; change its field in the population's declaration")]
    Hand(#[from] InvalidHand),
    /// The circuit of a random hand cannot be solved.
    #[error("E623 the circuit of a drawn hand cannot be solved: a mistake of the program")]
    Network(#[from] InvalidSegment),
    /// The sweep failed.
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
}

impl TwoPointsError {
    /// Converts the error for a command, which then shows the mistakes of a wearer file with their
    /// lines.
    #[must_use]
    pub fn with_lines(self) -> anyhow::Error {
        match self {
            Self::File(error) => error.into(),
            error => error.into(),
        }
    }

    pub(super) fn missing(field: &str) -> Self {
        Self::Declaration(format!("no range for `{field}`"))
    }
}
