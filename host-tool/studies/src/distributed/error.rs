//! What cannot be studied.

use hal_sim::body::shared::InvalidShared;
use host_core::run::OpenError;

/// Why a study of shared muscles does not come about.
#[derive(Debug, thiserror::Error)]
pub enum DistributedError {
    /// Its declaration.
    #[error("E722 the declaration of distributed: {0}")]
    Declaration(String),
    /// A drawn person.
    #[error("E723 a drawn muscle cannot be; change that field's range in the declaration")]
    Muscle(#[from] InvalidShared),
    /// A condition on the device: which, and why.
    #[error("E724 {0}: the device does not play it: {1}")]
    Device(String, String),
    /// The device is not there.
    #[error(transparent)]
    Open(#[from] OpenError),
}
