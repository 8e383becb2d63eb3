//! Errors of the study of distributed electrodes.

use hal_sim::body::shared::InvalidShared;
use host_core::run::OpenError;

/// The reason why the study cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum DistributedError {
    /// The declaration is invalid.
    #[error("E722 the declaration distributed.toml is invalid: {0}")]
    Declaration(String),
    /// A random wearer's muscle is invalid.
    #[error("E723 a random muscle is invalid; change the range of its field in the declaration")]
    Muscle(#[from] InvalidShared),
    /// The device does not play a condition: its description, and the reason.
    #[error("E724 the device cannot run the condition \"{0}\": {1}")]
    Device(String, String),
    /// The device cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
}
