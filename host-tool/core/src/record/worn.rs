//! Wearer file of a trial: for whom the session was run.

use super::Trial;
use crate::session::{Session, SessionError, builtin_wearer_text};
use serde::{Deserialize, Serialize};

/// Wearer file whose thresholds and limits a trial kept, and the source of its numbers.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct TrialWearer {
    /// Path of the file, as the session names it.
    pub file: String,
    /// Pseudonym of the wearer.
    pub name: String,
    /// Source of the wearer's numbers: "printed", "simulated", "measured" or "assumed". It says
    /// nothing about the device that stimulated.
    pub evidence: String,
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub sha256: String,
    /// Text of the wearer file.
    #[serde(skip)]
    pub text: String,
}

impl Trial {
    /// Returns the session that was run, with the wearer file that the record keeps.
    ///
    /// # Errors
    /// The record keeps no session file, or one that this version of the program refuses.
    pub fn session(&self) -> Result<Session, SessionError> {
        let kept = self.wearer.as_ref();
        Session::parse_with_wearers(&self.session_file, &self.session_text, &|file| match kept {
            Some(wearer) => Ok(wearer.text.clone()),
            None => builtin_wearer_text(file),
        })
    }
}
