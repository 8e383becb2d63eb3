//! Connects the study to the laboratory's runner.

use super::outcome::RunInfo;
use super::{Part, Study};
use crate::hamana2022::population::DECLARED;
use crate::laboratory::{self, Outcome, StudyIdentity};
use std::collections::BTreeMap;

impl laboratory::Study for Study {
    type Unit = Part;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: self.kind.name_and_title().0,
            arguments: self.typed.clone(),
            declaration: ("population.toml", DECLARED),
            seed: self.seed,
            draws: self.draws,
        }
    }

    fn hashes(&self) -> BTreeMap<String, String> {
        self.sha256()
    }

    fn units(&self) -> u64 {
        self.participants.all.len() as u64 * self.draws
    }

    fn compute(
        &self,
        index: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<Part>> {
        let draws = self.draws.max(1);
        let participant = usize::try_from(index / draws).unwrap_or(usize::MAX);
        Ok(self.compute_part((participant, index % draws), goes_on)?)
    }

    fn outcome(&self, parts: &[Part], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        let (name, arguments, draws) = (self.kind.name_and_title().0, &self.typed, self.draws);
        let run_info = RunInfo {
            command: format!("experiment {name} {arguments} --draws {draws}"),
            cut_short,
        };
        Ok(self.outcome(parts, run_info)?)
    }

    fn files(&self, parts: &[Part]) -> anyhow::Result<Vec<(String, String)>> {
        Ok(vec![("draws.csv".to_owned(), self.csv(parts))])
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} draws", laboratory::Study::units(self))
    }
}
