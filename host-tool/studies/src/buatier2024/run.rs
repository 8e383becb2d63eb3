//! Adapts the replication to the laboratory's runner: first the studies, then the sensitivity
//! analysis.

use super::deciding::{Sensitivity, compute_sensitivity};
use super::declaration::{DECLARED, HEIGHTS, Metric, Study};
use super::error::LiftError;
use super::outcome::{NAME, RunInfo, outcome};
use super::replication::{Replication, replication};
use crate::laboratory::{self, Outcome, StudyIdentity};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// The study with its seed and number of draws.
pub struct Run {
    study: Study,
    seed: u64,
    draws: u64,
}

/// Result of a unit of work.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Part {
    /// One simulated study.
    Study(Replication),
    /// The sensitivity analysis.
    Decides(Sensitivity),
}

impl Run {
    /// Creates a run with this seed and number of studies, or those of the declaration.
    ///
    /// # Errors
    /// Fails with E760 if the declaration is invalid.
    pub fn new((seed, draws): (Option<u64>, Option<u64>)) -> Result<Self, LiftError> {
        let study = Study::load_embedded()?;
        Ok(Self {
            seed: seed.unwrap_or(study.seed),
            draws: draws.unwrap_or(study.studies),
            study,
        })
    }

    /// Returns whether the run includes the sensitivity analysis; a quick run with fewer studies
    /// does not.
    const fn has_deciding(&self) -> bool {
        self.draws >= self.study.studies
    }
}

/// Separates the units into studies and the sensitivity analysis.
fn split_parts(parts: &[Part]) -> (Vec<Replication>, Option<&Sensitivity>) {
    let (mut studies, mut decides) = (Vec::new(), None);
    for part in parts {
        match part {
            Part::Study(replication) => studies.push(replication.clone()),
            Part::Decides(decision) => decides = Some(decision),
        }
    }
    (studies, decides)
}

/// Returns a CSV table with a row for each condition of each participant.
fn csv(studies: &[Replication]) -> String {
    let heights = |name: &'static str| (1..=HEIGHTS).map(move |nth| format!(",{name}_{nth}"));
    let mut text = "study,person,condition,power_w_per_kg".to_owned();
    text.extend(heights("error_m"));
    text.extend(heights("sparc"));
    text.push('\n');
    for (index, study) in studies.iter().enumerate() {
        for (nth, person) in (1..).zip(&study.people) {
            for result in &person.conditions {
                let power = result.value(Metric::Power, None);
                // Writing to a `String` cannot fail.
                let _ = write!(text, "{index},{nth},{},{power}", result.condition.name());
                for value in result.error_m.iter().chain(&result.sparc) {
                    let _ = write!(text, ",{value}");
                }
                text.push('\n');
            }
        }
    }
    text
}

impl laboratory::Study for Run {
    type Unit = Part;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: NAME,
            arguments: String::new(),
            declaration: ("study.toml", DECLARED),
            seed: self.seed,
            draws: self.draws,
        }
    }

    fn units(&self) -> u64 {
        self.draws + u64::from(self.has_deciding())
    }

    fn compute(
        &self,
        index: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<Part>> {
        let is_asked = || !goes_on();
        let found = match index < self.draws {
            true => replication(&self.study, self.seed, index, &is_asked).map(Part::Study),
            false => compute_sensitivity(&self.study, self.seed, &is_asked).map(Part::Decides),
        };
        match found {
            Err(LiftError::Asked) => Ok(None),
            found => Ok(Some(found?)),
        }
    }

    fn outcome(&self, parts: &[Part], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        let (studies, decides) = split_parts(parts);
        let run_info = RunInfo {
            seed: self.seed,
            draws: self.draws,
            command: format!("experiment {NAME} --draws {}", self.draws),
            cut_short,
        };
        Ok(outcome(&self.study, &studies, decides, run_info)?)
    }

    fn files(&self, parts: &[Part]) -> anyhow::Result<Vec<(String, String)>> {
        let (studies, decides) = split_parts(parts);
        let lines = studies.iter().map(laboratory::line);
        let mut files = vec![
            ("draws.csv".to_owned(), csv(&studies)),
            ("studies.jsonl".to_owned(), lines.collect()),
        ];
        files.extend(decides.map(|decision| {
            // Cannot fail: the type has only numbers, strings and lists.
            let text = serde_json::to_string_pretty(decision).unwrap_or_default() + "\n";
            ("deciding.json".to_owned(), text)
        }));
        Ok(files)
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{} of {} studies", done.min(self.draws), self.draws)
    }
}
