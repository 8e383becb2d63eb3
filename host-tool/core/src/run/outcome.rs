//! The result of a session.

use super::RunError;
use crate::record::Trial;
use firmware::link::HelloInfo;

/// The result of a session, complete or not.
pub struct Outcome {
    /// Everything recorded.
    pub trial: Trial,
    /// Who ran it.
    pub device: Option<HelloInfo>,
    /// Epoch of the trains in the port's own time, µs.
    pub epoch_us: Option<u64>,
    /// Requests refused while it ran.
    pub refused: usize,
    /// Why it ended early, if it did.
    pub error: Option<RunError>,
}
