//! Errors of the study of current and width ramps.

use hal_sim::body::bench::InvalidBench;
use host_core::run::OpenError;

/// The reason why the study cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum RampsError {
    /// The declaration is invalid.
    #[error("E690 the declaration harris-ramps.toml is invalid: {0}")]
    Declaration(String),
    /// A random wearer's elbow is invalid.
    #[error(
        "E691 a random elbow is impossible; change the range of this field in harris-ramps.toml"
    )]
    Bench(#[from] InvalidBench),
    /// The device does not play a test: its description, and the reason.
    #[error("E692 {0}: the device did not play this stimulation: {1}")]
    Device(String, String),
    /// The device cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
}
