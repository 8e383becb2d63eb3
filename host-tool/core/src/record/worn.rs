//! Who a trial was played on, by a wearer file.

use super::Trial;
use crate::session::{Session, SessionError, shipped_text};
use serde::{Deserialize, Serialize};

/// Whose thresholds and limits a trial kept, and where these are from.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct TrialWearer {
    /// The file, as the session names it.
    pub file: String,
    /// The pseudonym.
    pub name: String,
    /// "printed", "simulated", "measured" or "assumed": where its numbers are from. What
    /// stimulated is another matter.
    pub evidence: String,
    /// The file's SHA-256, 64 hexadecimal digits.
    pub sha256: String,
    /// Its text.
    #[serde(skip)]
    pub text: String,
}

impl Trial {
    /// The session that was played, on the wearer file that the record keeps.
    ///
    /// # Errors
    /// The record keeps no session file, or one that this version of the program refuses.
    pub fn session(&self) -> Result<Session, SessionError> {
        let kept = self.wearer.as_ref();
        Session::parse_beside(&self.session_file, &self.session_text, &|file| match kept {
            Some(wearer) => Ok(wearer.text.clone()),
            None => shipped_text(file),
        })
    }
}
