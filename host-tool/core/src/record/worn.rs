//! Who a trial was played on, by a wearer file.

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
