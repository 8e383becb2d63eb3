//! The head of a journal, whose parts must agree before the journal is continued.

use super::CalibrationError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the journal format that this program writes.
pub(super) const FORMAT: u32 = 1;

/// First entry of each run in a journal: the wearer, the plan, the operator and the device.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Version of the journal format in which the run was written.
    pub format: u32,
    /// Pseudonym of the wearer.
    pub wearer: String,
    /// SHA-256 of the text of the plan, by which a changed plan is noticed.
    pub plan: String,
    /// Name of the operator.
    pub operator: String,
    /// Date, as the operator gave it or as the computer's clock shows it; "simulated" on
    /// simulators.
    pub at: String,
    /// Kind of the device, as the device reports it.
    pub device: String,
    /// Firmware version of the device.
    pub firmware: String,
    /// Name of the simulated wearer; `None` for a person.
    pub body: Option<String>,
    /// Seed of the simulated wearer; `None` for a person.
    pub seed: Option<u64>,
    /// Whether the device's wearer is simulated.
    pub simulated: bool,
}

impl Head {
    /// Creates a head in the present format for a wearer and for the text of a plan. The fields for
    /// operator, date and device are empty.
    #[must_use]
    pub fn new(wearer: &str, plan: &str) -> Self {
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

    /// Checks that a run with the head `next` may continue the journal at `path`, whose head this
    /// is.
    ///
    /// # Errors
    /// The wearer, the plan or the simulated wearer is another one.
    pub fn check_continuation(&self, path: &Path, next: &Self) -> Result<(), CalibrationError> {
        let known = |body: &Option<String>, seed: Option<u64>| match (body, seed) {
            (Some(body), Some(seed)) => format!("the simulated {body} with seed {seed}"),
            _ => "the wearer of a device".to_owned(),
        };
        let why = if self.wearer != next.wearer {
            format!(
                "it is the journal of {}, but the plan is for {}; give the --out of that wearer",
                self.wearer, next.wearer
            )
        } else if self.plan != next.plan {
            "the plan has changed since; restore the old plan, or start a new calibration with \
             another --out"
                .to_owned()
        } else if (&self.body, self.seed) != (&next.body, next.seed) {
            let (was, is) = (known(&self.body, self.seed), known(&next.body, next.seed));
            format!(
                "it belongs to {was}, but this is {is}; give the same --device, --body and --seed"
            )
        } else {
            return Ok(());
        };
        Err(CalibrationError::NotResumable(path.to_owned(), why))
    }
}
