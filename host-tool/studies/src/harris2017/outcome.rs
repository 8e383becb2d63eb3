//! Assembles the study's outcome for `result.json` and the report page.

use super::claims::{deciding_factors, shares};
use super::declared::DECLARED;
use super::error::RampsError;
use super::found::DrawResult;
use super::study::{NAME, Study};
use crate::laboratory::{Outcome, Preregistration};
use host_core::record::sha256;
use std::collections::BTreeMap;

/// Note in every result that the elbows are simulated.
const SIMULATED: &str = "Simulated: random elbows with assumed parameters; no evidence about \
                         people.";
const MEANING: &str = "Each result is the median of the simulated wearers, with the 5th and 95th \
                       percentile. Participants 1 and 2 are the first two wearers: nothing was \
                       chosen to resemble figure 6 or 7, whose curves were not available and \
                       whose numbers the paper does not print.";
const ANGLES: &str = "The paper's angles are between forearm and upper arm: its 75° is 105° of \
                      flexion. The moment arms by Rankin & Neptune come from a secondary source; \
                      above 100° of flexion, their two fits differ (by 1.2 mm at 105°).";
const FATIGUE: &str = "Fatigue is not simulated, so the rests of five minutes and the order of \
                       the tests have no effect.";
const PAIN: &str = "The paper calls 80 mA at 45 µs uncomfortable, and states that no test \
                    exceeded the recommended maximum, so 35 mA at 300 µs did not. Both pulses lie \
                    on one curve I = b (1 + c/d) if c is 88 µs (our assumption). This curve is \
                    the assumed upper curve of figure 3.";

/// Information about the run that only the command knows.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Command line that repeats the run, without its seed.
    pub command: String,
    /// Description of the missing part if the run was interrupted.
    pub cut_short: Option<String>,
    /// Notes about the device and its latency.
    pub notes: Vec<String>,
}

impl Study {
    /// Assembles the outcome of these wearers; after an interruption, some may be missing.
    ///
    /// # Errors
    /// Returns E690 or E691 if the declaration or the test rig is invalid.
    pub fn outcome(&self, all: &[DrawResult], told: RunInfo) -> Result<Outcome, RampsError> {
        let declared = &self.declared;
        let sha256 = [("harris-ramps.toml".to_owned(), sha256(DECLARED.as_bytes()))];
        let said = [SIMULATED, MEANING, ANGLES, FATIGUE, PAIN].map(str::to_owned);
        Ok(Outcome {
            name: NAME.to_owned(),
            title: declared.title.clone(),
            seed: self.seed,
            simulated: Some(true),
            cut_short: told.cut_short,
            declared: Preregistration {
                asked: NAME.to_owned(),
                command: Some(told.command),
                device: Some(self.device.to_argument()),
                sha256: BTreeMap::from(sha256),
                source: declared.source.clone(),
                draws: self.draws,
                drawn: None,
                as_declared: (self.seed, self.draws) == (declared.seed, declared.draws),
            },
            conditions: Vec::new(),
            rows: self.rows(all)?,
            shares: (shares(declared, all)?.into_iter())
                .chain([self.significance_share(all), self.coverage_share(all)])
                .collect(),
            decides: deciding_factors(declared, all)?,
            sheets: self.sheets(all)?,
            notes: said.into_iter().chain(told.notes).collect(),
        })
    }
}
