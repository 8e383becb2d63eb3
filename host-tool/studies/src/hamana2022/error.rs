//! What cannot be studied.

use crate::laboratory::LaboratoryError;
use hal_sim::body::hand::{InvalidHand, network::InvalidSegment};
use host_core::run::OpenError;
use host_core::session::SessionError;

/// Why a study of two points does not come about.
#[derive(Debug, thiserror::Error)]
pub enum TwoPointsError {
    /// Its declaration.
    #[error("E621 the population's declaration: {0}")]
    Declaration(String),
    /// Nobody of this name.
    #[error("E624 there is no wearer `{0}`; there are P, Q, R and S, or a file that ends in .toml")]
    Nobody(String),
    /// No departure of this name.
    #[error("E627 there is no departure `{0}`; there are {1}")]
    NoDeparture(String, String),
    /// A wearer file of somebody who has not what these studies need.
    #[error("E625 {0}: {1}")]
    Wearer(String, String),
    /// A wearer file with mistakes, or none at all.
    #[error(transparent)]
    File(#[from] SessionError),
    /// A pattern on a device: which, and why.
    #[error("E628 {0}: the device does not put it out as the body alone is given it: {1}")]
    PutOut(String, String),
    /// The device is not there.
    #[error(transparent)]
    Device(#[from] OpenError),
    /// A hand.
    #[error("E622 a drawn hand cannot be; change its field in the population's declaration")]
    Hand(#[from] InvalidHand),
    /// Its circuit.
    #[error("E623 the circuit of a drawn hand cannot be solved: a mistake of the program")]
    Network(#[from] InvalidSegment),
    /// Its sweep.
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
}

impl TwoPointsError {
    /// The same for a command: mistakes of a wearer file are shown with their lines.
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
