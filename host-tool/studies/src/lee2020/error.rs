//! Errors of the study.

use hal_sim::body::bench::InvalidBench;
use host_core::identify::IdentifyError;
use host_core::run::OpenError;

/// Reason why the study cannot run.
#[derive(Debug, thiserror::Error)]
pub enum LeeError {
    /// The declaration `lee.toml` cannot be parsed, or no amplitude moves a subject's wrist: the
    /// mistake.
    #[error("E646 the declaration lee.toml is wrong: {0}")]
    Declaration(String),
    /// A train on a device differs from the direct stimulation; contains the train and the
    /// difference.
    #[error("E647 {0}: the device does not play this as the study intends: {1}")]
    PutOut(String, String),
    /// The results cannot be written as a wearer file: the file, and the reason.
    #[error("E648 the results do not make a valid wearer file {0}: {1}")]
    Wearer(String, String),
    /// The parameters of the test rig are impossible.
    #[error(
        "E649 the simulated test rig is impossible (an error in the program; please report it)"
    )]
    Bench(#[from] InvalidBench),
    /// A record cannot be analysed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The device could not be opened.
    #[error(transparent)]
    Device(#[from] OpenError),
}
