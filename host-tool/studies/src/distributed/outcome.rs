//! Assembles the study's outcome for `result.json` and the report page.

use super::declared::DECLARED;
use super::error::DistributedError;
use super::study::{AxisPoint, DrawResult, NAME, Study};
use crate::laboratory::{Outcome, Preregistration};
use host_core::record::sha256;
use std::collections::BTreeMap;

/// Notes for the reader that accompany every result of this study.
const NOTES: [&str; 6] = [
    "Simulated: random muscles with assumed parameters; no evidence about people.",
    "“Ours” is the median of the random wearers, low and high are their 5th and 95th percentiles. \
     Nothing was fitted to a published number. The endurance is 0 s for wearers who did not reach \
     the force, and the length of the study for those who held it to the end, so a median of \
     these is a bound.",
    "Buckmire 2018 stimulated at 25 Hz. The abstract does not say whether the four electrodes \
     shared this rate or each had it, and it explains the gain by a larger stimulated volume, not \
     by a lower rate. Both readings are simulated and compared with the paper's numbers.",
    "The pulses are those of the device, from the native simulator, and stimulate a model of the \
     muscle. The host closes the loop: the mean force of each frame sets one amplitude for all \
     electrodes.",
    "The factors that decide the ratio are assumed and varied here: above all the part of the \
     muscle that the single electrode reaches; then crosstalk, which reaches more fibres and makes \
     them fire more often; least the part of fatigue that depends on pulses instead of force. At a \
     quarter of 25 Hz, a fifth of the strength is more than the whole muscle can produce in many \
     wearers, because its dynamics are those of forearm muscles (Lee 2020).",
    "The device's models know the muscle of each electrode as a calibration of that electrode \
     alone would find it. They know neither crosstalk nor that only recruited units fatigue.",
];

/// Information about the run that only the command line knows.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Command line that repeats the run, without its seed.
    pub command: String,
    /// Description of what is missing if the run was interrupted; `None` for a complete run.
    pub cut_short: Option<String>,
}

impl Study {
    /// Assembles the outcome from these wearers and axis points, which are incomplete after an
    /// interruption.
    ///
    /// # Errors
    /// Returns E722 if a declared claim has no rule.
    pub fn outcome(
        &self,
        results: &[DrawResult],
        along: &[AxisPoint],
        run_info: RunInfo,
    ) -> Result<Outcome, DistributedError> {
        let declared = &self.declared;
        let sha256 = [("distributed.toml".to_owned(), sha256(DECLARED.as_bytes()))];
        Ok(Outcome {
            name: NAME.to_owned(),
            title: declared.title.clone(),
            seed: self.seed,
            simulated: Some(true),
            cut_short: run_info.cut_short,
            declared: Preregistration {
                asked: NAME.to_owned(),
                command: Some(run_info.command),
                device: Some("native".to_owned()),
                sha256: BTreeMap::from(sha256),
                source: declared.source.clone(),
                draws: self.draws,
                drawn: None,
                as_declared: (self.seed, self.draws) == (declared.seed, declared.draws),
            },
            conditions: Vec::new(),
            rows: self.rows(results),
            shares: self.shares(results)?,
            decides: self.deciding_factors(results)?,
            sheets: self.sheets(results, along),
            notes: NOTES.map(str::to_owned).to_vec(),
        })
    }
}
