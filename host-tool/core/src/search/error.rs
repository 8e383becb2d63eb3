//! Reasons why a search cannot begin, or ended early.

use super::device::DeviceError;
use super::milli::Milli;
use super::stair::{Finding, SearchEnd};
use crate::session::SessionError;
use std::path::PathBuf;

/// Reason why a search did not begin, or ended early.
#[derive(Debug, thiserror::Error)]
pub enum SearchError {
    /// The search file has these mistakes (E527).
    #[error("E527 the search file {} has mistakes: {}", .0.display(), .1.join("\n  "))]
    Mistakes(PathBuf, Vec<String>),
    /// The session of the search, or the file itself, cannot be used.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The operator did not allow the first level; the search had reached the second (E536).
    #[error(
        "E536 the operator did not allow the level {0}, so the search ended; it had reached {1}"
    )]
    NotAllowed(Milli, Milli),
    /// The device failed, or a signal interrupted the search.
    #[error(transparent)]
    Device(#[from] DeviceError),
}

impl Finding<DeviceError> {
    /// Returns the reason why the search ended early.
    ///
    /// # Errors
    /// The operator did not allow a level, or the device failed.
    pub fn into_end(self) -> Result<(), SearchError> {
        match self.ended {
            SearchEnd::Found | SearchEnd::Limit => Ok(()),
            SearchEnd::Refused(level) => Err(SearchError::NotAllowed(level, self.low)),
            SearchEnd::Failed(error) => Err(error.into()),
        }
    }
}
