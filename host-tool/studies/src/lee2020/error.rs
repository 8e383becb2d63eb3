//! What cannot be studied.

use hal_sim::body::bench::InvalidBench;
use host_core::identify::IdentifyError;
use host_core::run::OpenError;

/// Why Lee's protocol does not come about.
#[derive(Debug, thiserror::Error)]
pub enum LeeError {
    /// Its declaration.
    #[error("E646 lee.toml: {0}")]
    Declaration(String),
    /// A train on a device: which, and why.
    #[error("E647 {0}: the device does not put it out as the body alone is given it: {1}")]
    PutOut(String, String),
    /// A wearer file.
    #[error("E648 {0} cannot be a wearer file: {1}")]
    Wearer(String, String),
    /// The bench.
    #[error("E649 a bench cannot be made: a mistake of the program")]
    Bench(#[from] InvalidBench),
    /// What was measured.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The device is not there.
    #[error(transparent)]
    Device(#[from] OpenError),
}
