//! Assembles the study's outcome for `result.json` and the report page.

use super::declared::DECLARED;
use super::error::DistributedError;
use super::study::{AxisPoint, DrawResult, NAME, Study};
use crate::laboratory::{Outcome, Preregistration};
use host_core::record::sha256;
use std::collections::BTreeMap;

/// Notes that accompany every result.
const NOTES: [&str; 6] = [
    "Simulated: drawn muscles of assumed parameters; no evidence about people.",
    "Ours is the median, low and high the 5th and 95th percentile of the persons drawn. Nothing \
     was fitted to a published number. Endurance of who did not reach the force is 0 s, of who \
     held it to the end the length of the study: medians of both are bounds.",
    "Buckmire 2018 stimulated at 25 Hz; whether four electrodes shared that rate or had it each, \
     the abstract does not say, and it explains the gain by a larger volume reached, not by a \
     lower rate. Both readings are played. The paper's numbers stand beside both.",
    "Pulses are the device's own, from the native simulator, streamed into the muscle. Feedback is \
     the host's: the frame's mean force sets one amplitude for all electrodes.",
    "What decides the ratio is assumed, and an axis here: most of all the part of the muscle that \
     the single electrode reaches; then crosstalk, which reaches more fibres and fires them more \
     often; least the part of fatigue that goes by pulses instead of force. At a quarter of 25 Hz \
     a fifth of strength is more than the whole muscle gives in many persons: dynamics are those \
     of forearm muscles (Lee 2020).",
    "The device's models know each electrode's muscle as a calibration of it alone would: neither \
     crosstalk nor that recruited units tire and others do not.",
];

/// Information about the run that only the command knows.
#[derive(Clone, Debug)]
pub struct RunInfo {
    /// Command line that repeats the run, without its seed.
    pub command: String,
    /// Description of the missing part if the run was interrupted.
    pub cut_short: Option<String>,
}

impl Study {
    /// Assembles the outcome of these wearers and axis points, which may be incomplete after an
    /// interruption.
    ///
    /// # Errors
    /// Returns E722 if a declared claim has no rule.
    pub fn outcome(
        &self,
        all: &[DrawResult],
        along: &[AxisPoint],
        told: RunInfo,
    ) -> Result<Outcome, DistributedError> {
        let declared = &self.declared;
        let sha256 = [("distributed.toml".to_owned(), sha256(DECLARED.as_bytes()))];
        Ok(Outcome {
            name: NAME.to_owned(),
            title: declared.title.clone(),
            seed: self.seed,
            simulated: Some(true),
            cut_short: told.cut_short,
            declared: Preregistration {
                asked: NAME.to_owned(),
                command: Some(told.command),
                device: Some("native".to_owned()),
                sha256: BTreeMap::from(sha256),
                source: declared.source.clone(),
                draws: self.draws,
                drawn: None,
                as_declared: (self.seed, self.draws) == (declared.seed, declared.draws),
            },
            conditions: Vec::new(),
            rows: self.rows(all),
            shares: self.shares(all)?,
            decides: self.deciding_factors(all)?,
            sheets: self.sheets(all, along),
            notes: NOTES.map(str::to_owned).to_vec(),
        })
    }
}
