//! The result of a session.

use super::RunError;
use crate::record::Trial;
use firmware::link::HelloInfo;

/// Result of running a session, whether or not it ran to its end.
pub struct Outcome {
    /// Rows, events and counters that were recorded until the end of the run.
    pub trial: Trial,
    /// Answer of the device to `Hello`; `None` if no device answered.
    pub device: Option<HelloInfo>,
    /// Start of the trains in the port's own time, µs; `None` if they did not start.
    pub epoch_us: Option<u64>,
    /// Number of requests that the device refused while the session ran.
    pub refused: usize,
    /// Reason why the session ended early; `None` if it ran to its end.
    pub error: Option<RunError>,
}
