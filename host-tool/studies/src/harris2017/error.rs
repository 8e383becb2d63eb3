//! What cannot be studied.

use hal_sim::body::bench::InvalidBench;
use host_core::run::OpenError;

/// Why a study of ramps does not come about.
#[derive(Debug, thiserror::Error)]
pub enum RampsError {
    /// Its declaration.
    #[error("E690 the declaration of harris-ramps: {0}")]
    Declaration(String),
    /// A drawn person.
    #[error("E691 a drawn elbow cannot be; change that field's range in the declaration")]
    Bench(#[from] InvalidBench),
    /// A test on a device: which, and why.
    #[error("E692 {0}: the device does not put it out: {1}")]
    Device(String, String),
    /// The device is not there.
    #[error(transparent)]
    Open(#[from] OpenError),
}
