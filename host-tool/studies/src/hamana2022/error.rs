//! Errors of the studies of Hamana 2022.

use crate::laboratory::LaboratoryError;
use hal_sim::body::hand::{InvalidHand, network::InvalidSegment};
use host_core::run::OpenError;
use host_core::session::SessionError;

/// The reason why a study of two points cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum TwoPointsError {
    /// A declaration file of these studies cannot be parsed or lacks a value: the mistake.
    #[error("E621 the declaration of the two-point study is wrong: {0}")]
    Declaration(String),
    /// No wearer has this name.
    #[error(
        "E624 there is no wearer `{0}`; choose P, Q, R, S or all, or give a wearer file that ends \
         in .toml"
    )]
    Nobody(String),
    /// No ablation has this name: the name, and those that exist.
    #[error("E627 --ablation `{0}` does not exist; choose one of {1}")]
    NoDeparture(String, String),
    /// A wearer file lacks values that these studies need: the file, and the values.
    #[error("E625 the wearer file {0} cannot be used here: {1}; complete it, or give another one")]
    Wearer(String, String),
    /// A wearer file or an ablation is used with conditioned forearms: the name of the forearms.
    #[error(
        "E813 --participants {0} has forearms of its own; leave out --wearer and --ablation, or \
         choose --participants fixed"
    )]
    Source(&'static str),
    /// A study that conditions forearms is asked for something else than one of the paper's
    /// participants: the name of the study.
    #[error(
        "E814 {0} conditions forearms on what the paper prints of P, Q, R and S; it accepts \
         --participant, and neither --wearer, --ablation nor --participants"
    )]
    Conditioned(String),
    /// A wearer file has mistakes or cannot be read.
    #[error(transparent)]
    File(#[from] SessionError),
    /// The device does not play a pattern as intended: the pattern, and the reason.
    #[error("E628 {0}: the device does not play this pattern as the study intends: {1}")]
    PutOut(String, String),
    /// The device cannot be opened.
    #[error(transparent)]
    Device(#[from] OpenError),
    /// The random parameters of a hand are impossible.
    #[error(
        "E622 a randomly generated hand is impossible: {0}; change the range of this field in \
         hamana-population.toml"
    )]
    Hand(InvalidHand),
    /// The circuit of a random hand cannot be solved.
    #[error(
        "E623 the circuit of a randomly generated hand cannot be solved (an error in the program; \
         please report it)"
    )]
    Network(#[from] InvalidSegment),
    /// A sweep cannot be run, stored or merged.
    #[error(transparent)]
    Laboratory(#[from] LaboratoryError),
}

// There is no `#[from]`: the message contains this error in full, so the error must not be listed
// again as its cause.
impl From<InvalidHand> for TwoPointsError {
    fn from(error: InvalidHand) -> Self {
        Self::Hand(error)
    }
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
