//! Whose journal it is, and of what: what must agree to go on with it.

use super::CalibrationError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Format of the journal.
pub(super) const FORMAT: u32 = 1;

/// Whose journal it is, and of what.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Of the journal.
    pub format: u32,
    /// The wearer's pseudonym.
    pub wearer: String,
    /// SHA-256 of the plan's text.
    pub plan: String,
    /// Who operates.
    pub operator: String,
    /// When, as the operator or the program's clock says; "simulated" on simulators.
    pub at: String,
    /// The device, by its own word.
    pub device: String,
    /// Its firmware.
    pub firmware: String,
    /// The simulated wearer, by name.
    pub body: Option<String>,
    /// Its seed.
    pub seed: Option<u64>,
    /// Whether a simulated wearer stood behind it.
    pub simulated: bool,
}

impl Head {
    /// Of this format, the rest empty.
    #[must_use]
    pub fn of(wearer: &str, plan: &str) -> Self {
        Self {
            format: FORMAT,
            wearer: wearer.to_owned(),
            plan: crate::record::sha256(plan.as_bytes()),
            operator: String::new(),
            at: String::new(),
            device: String::new(),
            firmware: String::new(),
            body: None,
            seed: None,
            simulated: true,
        }
    }

    /// Whether `next` may go on with what this began, whose journal is at `path`.
    ///
    /// # Errors
    /// Another person, another plan, another simulated wearer.
    pub fn goes_on(&self, path: &Path, next: &Self) -> Result<(), CalibrationError> {
        let known = |body: &Option<String>, seed: Option<u64>| match (body, seed) {
            (Some(body), Some(seed)) => format!("the simulated {body} of seed {seed}"),
            _ => "a device's wearer".to_owned(),
        };
        let why = if self.wearer != next.wearer {
            format!(
                "it is the journal of {}, the plan is for {}; give that person's --out",
                self.wearer, next.wearer
            )
        } else if self.plan != next.plan {
            "the plan was changed since; give it as it was, or begin anew with another --out"
                .to_owned()
        } else if (&self.body, self.seed) != (&next.body, next.seed) {
            let (was, is) = (known(&self.body, self.seed), known(&next.body, next.seed));
            format!("it was {was}, and now it is {is}; give the same --device, --body and --seed")
        } else {
            return Ok(());
        };
        Err(CalibrationError::NotResumable(path.to_owned(), why))
    }
}
