//! Errors of the study of distributed electrodes.

use hal_sim::body::shared::InvalidShared;
use host_core::run::OpenError;

/// The reason why the study cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum DistributedError {
    /// The built-in declaration is invalid; contains the mistake.
    #[error("E722 the declaration distributed.toml is invalid: {0}")]
    Declaration(String),
    /// A random wearer's muscle has parameters that the simulation refuses.
    #[error(
        "E723 a randomly generated muscle is impossible: {0}; change the range of this field in \
         distributed.toml"
    )]
    Muscle(InvalidShared),
    /// The device does not play a condition: its description, and the reason.
    #[error("E724 the device cannot run the condition \"{0}\": {1}")]
    Device(String, String),
    /// The device cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
}

// There is no `#[from]`: the message contains this error in full, so the error must not be listed
// again as its cause.
impl From<InvalidShared> for DistributedError {
    fn from(error: InvalidShared) -> Self {
        Self::Muscle(error)
    }
}
