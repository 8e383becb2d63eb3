//! Connects the study to the laboratory's runner.

use super::declaration::{DECLARED, Study};
use super::outcome::{NAME, RunInfo, outcome};
use super::sets::{METHODS, MissedForce, best, missed_forces};
use super::wearer::{MUSCLES, Wearer};
use crate::laboratory::{self, Outcome, StudyIdentity};
use crate::sierotowicz2023::EndpointError;
use std::fmt::Write;

/// The study with its seed and number of draws.
pub struct Run {
    study: Study,
    seed: u64,
    draws: u64,
}

impl Run {
    /// Creates the study with this seed and number of wearers; `None` takes the preregistered
    /// value.
    ///
    /// # Errors
    /// Fails if the declaration cannot be read.
    pub fn new((seed, draws): (Option<u64>, Option<u64>)) -> Result<Self, EndpointError> {
        let study = Study::load_embedded()?;
        Ok(Self {
            seed: seed.unwrap_or(study.seed),
            draws: draws.unwrap_or(study.draws),
            study,
        })
    }
}

/// Formats one row for each wearer, method and number of electrodes: the mean error of the set that
/// is best over all reference forces, %.
fn csv(all: &[MissedForce]) -> String {
    let mut text = "wearer,method,electrodes,missed_percent\n".to_owned();
    for (index, missed) in all.iter().enumerate() {
        for (nth, method) in METHODS.iter().enumerate() {
            let parts = missed.mean_by_set(nth);
            for count in 1..=MUSCLES.len() as u32 {
                let percent = 100.0 * f64::from(parts[best(&parts, count)]);
                // Writing to a string cannot fail.
                let _ = writeln!(text, "{index},{method},{count},{percent:.4}");
            }
        }
    }
    text
}

impl laboratory::Study for Run {
    type Unit = MissedForce;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: NAME,
            arguments: String::new(),
            declaration: ("electrodes.toml", DECLARED),
            seed: self.seed,
            draws: self.draws,
        }
    }

    fn compute(
        &self,
        index: u64,
        _: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<MissedForce>> {
        Ok(Some(missed_forces(
            &self.study,
            &Wearer::random(self.seed, index)?,
        )?))
    }

    fn outcome(&self, all: &[MissedForce], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        let told = RunInfo {
            seed: self.seed,
            draws: self.draws,
            cut_short,
        };
        Ok(outcome(&self.study, all, told))
    }

    fn files(&self, all: &[MissedForce]) -> anyhow::Result<Vec<(String, String)>> {
        Ok(vec![("draws.csv".to_owned(), csv(all))])
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} wearers", self.draws)
    }
}
