//! Connects the conditioning to the laboratory's runner.

use super::declaration::DECLARED;
use super::outcome;
use super::study::{Conditioning, ConditioningStudy, Unit};
use crate::laboratory::{self, Outcome, StudyIdentity};
use std::collections::BTreeMap;

impl laboratory::Study for ConditioningStudy {
    type Unit = Unit;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: self.name(),
            arguments: self.arguments.clone(),
            declaration: ("hamana-participants.toml", DECLARED),
            seed: self.seed,
            draws: self.draws,
        }
    }

    fn hashes(&self) -> BTreeMap<String, String> {
        self.sha256()
    }

    fn units(&self) -> u64 {
        (self.mechanisms.len() * self.participants.len()) as u64 * self.draws
    }

    fn compute(
        &self,
        index: u64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<Unit>> {
        if !goes_on() {
            return Ok(None);
        }
        let Some((mechanism, participant, index)) = self.place(index) else {
            return Ok(None);
        };
        let prior = self.prior(participant, mechanism);
        let mut unit = Unit {
            mechanism,
            judged: self.judge(&prior, index)?,
            torque: None,
            measured: None,
        };
        if self.is_of_mechanisms() {
            self.measure(participant, &mut unit)?;
        }
        Ok(Some(unit))
    }

    fn outcome(&self, units: &[Unit], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        Ok(outcome::outcome(self, units, cut_short))
    }

    fn files(&self, units: &[Unit]) -> anyhow::Result<Vec<(String, String)>> {
        Ok(match self.kind {
            Conditioning::Participants => {
                let rows = outcome::posterior_csv(self, units);
                vec![("posterior.csv".to_owned(), rows)]
            }
            Conditioning::Mechanisms => Vec::new(),
        })
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} forearms", laboratory::Study::units(self))
    }
}
