//! The study as the laboratory's runner runs it: studies, then what decides.

use super::deciding::{Sensitivity, compute_sensitivity};
use super::declaration::{DECLARED, HEIGHTS, Metric, Study};
use super::error::LiftError;
use super::outcome::{NAME, RunInfo, outcome};
use super::replication::{Replication, replication};
use crate::laboratory::{self, Outcome, StudyIdentity};
use serde::{Deserialize, Serialize};
use std::fmt::Write;

/// The study with its seed and draws.
pub struct Run {
    study: Study,
    seed: u64,
    draws: u64,
}

/// What a unit of work became.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Part {
    /// A study.
    Study(Replication),
    /// Which assumption decides.
    Decides(Sensitivity),
}

impl Run {
    /// With this seed and so many studies, or the declaration's own.
    ///
    /// # Errors
    /// E760: the declaration.
    pub fn new((seed, draws): (Option<u64>, Option<u64>)) -> Result<Self, LiftError> {
        let study = Study::load_embedded()?;
        Ok(Self {
            seed: seed.unwrap_or(study.seed),
            draws: draws.unwrap_or(study.studies),
            study,
        })
    }

    /// Whether it asks which assumption decides: a quick look does not.
    const fn has_deciding(&self) -> bool {
        self.draws >= self.study.studies
    }
}

/// The studies of these units, and what decides.
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

/// A row for each condition of each person.
fn csv(all: &[Replication]) -> String {
    let heights = |name: &'static str| (1..=HEIGHTS).map(move |nth| format!(",{name}_{nth}"));
    let mut text = "study,person,condition,power_w_per_kg".to_owned();
    text.extend(heights("error_m"));
    text.extend(heights("sparc"));
    text.push('\n');
    for (index, study) in all.iter().enumerate() {
        for (nth, person) in (1..).zip(&study.people) {
            for result in &person.conditions {
                let power = result.value(Metric::Power, None);
                // A formatted `String` takes every byte.
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
        let told = RunInfo {
            seed: self.seed,
            draws: self.draws,
            command: format!("experiment {NAME} --draws {}", self.draws),
            cut_short,
        };
        Ok(outcome(&self.study, &studies, decides, told)?)
    }

    fn files(&self, parts: &[Part]) -> anyhow::Result<Vec<(String, String)>> {
        let (studies, decides) = split_parts(parts);
        let lines = studies.iter().map(laboratory::line);
        let mut files = vec![
            ("draws.csv".to_owned(), csv(&studies)),
            ("studies.jsonl".to_owned(), lines.collect()),
        ];
        files.extend(decides.map(|decision| {
            // Structs of numbers, words and lists always have a text.
            let text = serde_json::to_string_pretty(decision).unwrap_or_default() + "\n";
            ("deciding.json".to_owned(), text)
        }));
        Ok(files)
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{} of {} studies", done.min(self.draws), self.draws)
    }
}
