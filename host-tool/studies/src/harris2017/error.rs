//! Errors of the study of current and width ramps.

use hal_sim::body::bench::InvalidBench;
use host_core::run::OpenError;

/// The reason why the study cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum RampsError {
    /// The declaration `harris-ramps.toml` cannot be parsed or lacks a value: the mistake.
    #[error("E690 the declaration harris-ramps.toml is invalid: {0}")]
    Declaration(String),
    /// The random parameters of an elbow are impossible.
    #[error(
        "E691 a randomly generated elbow is impossible: {0}; change the range of this field in \
         harris-ramps.toml"
    )]
    Bench(InvalidBench),
    /// The device does not play a test: its description, and the reason.
    #[error("E692 {0}: the device did not play this stimulation: {1}")]
    Device(String, String),
    /// The device cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
}

// There is no `#[from]`: the message contains this error in full, so the error must not be listed
// again as its cause.
impl From<InvalidBench> for RampsError {
    fn from(error: InvalidBench) -> Self {
        Self::Bench(error)
    }
}
