//! Errors of the study of distributed electrodes.

use hal_sim::body::shared::InvalidShared;
use host_core::run::OpenError;

/// The reason why the study cannot be carried out.
#[derive(Debug, thiserror::Error)]
pub enum DistributedError {
    /// The declaration is invalid.
    #[error("E722 the declaration of distributed: {0}")]
    Declaration(String),
    /// A random wearer's muscle is invalid.
    #[error("E723 a drawn muscle cannot be; change that field's range in the declaration")]
    Muscle(#[from] InvalidShared),
    /// The device does not play a condition: its description, and the reason.
    #[error("E724 {0}: the device does not play it: {1}")]
    Device(String, String),
    /// The device cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
}
