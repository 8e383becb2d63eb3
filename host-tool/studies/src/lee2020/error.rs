//! Errors of the study.

use hal_sim::body::bench::InvalidBench;
use host_core::identify::IdentifyError;
use host_core::run::OpenError;

/// Reason why the study cannot run.
#[derive(Debug, thiserror::Error)]
pub enum LeeError {
    /// The declaration is invalid.
    #[error("E646 lee.toml: {0}")]
    Declaration(String),
    /// A train on a device differs from the direct stimulation; contains the train and the
    /// difference.
    #[error("E647 {0}: the device does not put it out as the body alone is given it: {1}")]
    PutOut(String, String),
    /// The results cannot be written as a wearer file.
    #[error("E648 {0} cannot be a wearer file: {1}")]
    Wearer(String, String),
    /// The test rig is invalid.
    #[error("E649 a bench cannot be made: a mistake of the program")]
    Bench(#[from] InvalidBench),
    /// A record cannot be analysed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The device could not be opened.
    #[error(transparent)]
    Device(#[from] OpenError),
}
