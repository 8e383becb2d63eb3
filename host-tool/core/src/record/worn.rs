//! Wearer file of a trial: for whom the session was run.

use super::Trial;
use crate::session::{Session, SessionError, builtin_wearer_text};
use serde::{Deserialize, Serialize};

/// Wearer file that the session of a trial names, as it was when the trial was run.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct TrialWearer {
    /// Path of the file, as the session names it.
    pub file: String,
    /// Pseudonym of the wearer.
    pub name: String,
    /// Where the wearer's thresholds and limits come from: "printed" (in a paper), "simulated",
    /// "measured" or "assumed". The device that stimulated may be of any kind.
    pub evidence: String,
    /// SHA-256 of the file, 64 hexadecimal digits.
    pub sha256: String,
    /// Text of the wearer file.
    #[serde(skip)]
    pub text: String,
}

impl Trial {
    /// Parses the recorded session file, with the recorded wearer file if the session names one.
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
