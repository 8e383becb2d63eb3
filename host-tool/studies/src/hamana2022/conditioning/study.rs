//! The conditioning as a study of the laboratory, which can be resumed and divided into shards.

use super::conditioned::JudgedForearm;
use super::data::PrintedVoltages;
use super::declaration::{DECLARED, Declaration};
use super::mechanism::Mechanism;
use super::outcome;
use super::prior::Prior;
use crate::hamana2022::population::{self, Population};
use crate::hamana2022::wearers::Participants;
use crate::hamana2022::{Participant, TwoPointsError};
use crate::laboratory::{self, Outcome, StudyIdentity};
use host_core::record::sha256;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Names of the studies on the command line.
pub const PARTICIPANTS: &str = "hamana-participants";
pub const MECHANISMS: &str = "hamana-mechanisms";

/// Conditions forearms on the printed voltages, under the model as it stands or under single changes
/// of it.
pub struct ConditioningStudy {
    pub(super) declaration: Declaration,
    pub(super) population: Population,
    pub(super) participants: Vec<Participant>,
    pub(super) mechanisms: Vec<Mechanism>,
    name: &'static str,
    arguments: String,
    pub(super) seed: u64,
    /// Number of forearms of each participant and mechanism.
    pub(super) draws: u64,
    pub(super) as_declared: bool,
}

/// One judged forearm.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Unit {
    /// Change of the model.
    pub mechanism: Mechanism,
    /// The forearm.
    pub judged: JudgedForearm,
}

impl ConditioningStudy {
    /// Creates the conditioning, or with `is_of_mechanisms` that under each single change of the
    /// model. `who` is a participant's letter; `None` stands for all. `None` for seed and draws
    /// takes the declared ones.
    ///
    /// # Errors
    /// Returns E621 if the declaration is wrong or if printed voltages contradict each other, and
    /// E624 if there is no such participant.
    pub fn new(
        is_of_mechanisms: bool,
        who: Option<&str>,
        (seed, draws): (Option<u64>, Option<u64>),
    ) -> Result<Self, TwoPointsError> {
        let declaration = Declaration::load_embedded()?;
        let participants = Participants::load(who)?.all;
        let conflicts = participants.iter().flat_map(|participant| {
            PrintedVoltages::of(participant).conflicts(&participant.name, &declaration)
        });
        let conflicts: Vec<String> = conflicts.collect();
        if !conflicts.is_empty() {
            return Err(TwoPointsError::Declaration(conflicts.join("; ")));
        }
        let (name, mechanisms, declared_draws) = match is_of_mechanisms {
            true => (
                MECHANISMS,
                Mechanism::ALL.to_vec(),
                declaration.mechanism_draws,
            ),
            false => (PARTICIPANTS, vec![Mechanism::Default], declaration.draws),
        };
        let (seed, draws) = (
            seed.unwrap_or(declaration.seed),
            draws.unwrap_or(declared_draws),
        );
        let is_whole = who.is_none_or(|who| who == "all");
        Ok(Self {
            as_declared: is_whole
                && (seed == declaration.seed || seed == declaration.again)
                && draws == declared_draws,
            population: Population::load_embedded()?,
            participants,
            mechanisms,
            name,
            arguments: who.map_or_else(String::new, |who| format!("--participant {who} ")),
            seed,
            draws,
            declaration,
        })
    }

    /// Returns the prior of a participant under a change of the model.
    pub(super) const fn prior<'a>(
        &'a self,
        participant: &'a Participant,
        mechanism: Mechanism,
    ) -> Prior<'a> {
        Prior {
            declaration: &self.declaration,
            population: &self.population,
            participant,
            mechanism,
            seed: self.seed,
        }
    }

    /// Returns mechanism, participant and forearm of a unit; `None` if there is no such unit.
    fn place(&self, unit: u64) -> Option<(Mechanism, &Participant, u64)> {
        let draws = self.draws.max(1);
        let (group, index) = (unit / draws, unit % draws);
        let group = usize::try_from(group).ok()?;
        let count = self.participants.len();
        let mechanism = self.mechanisms.get(group / count.max(1))?;
        Some((*mechanism, self.participants.get(group % count)?, index))
    }

    pub(super) fn command(&self) -> String {
        let Self {
            name,
            arguments,
            draws,
            ..
        } = self;
        format!("experiment {name} {arguments}--draws {draws}")
    }

    pub(super) const fn name(&self) -> &'static str {
        self.name
    }

    pub(super) fn sha256(&self) -> BTreeMap<String, String> {
        let files = [
            ("hamana-participants.toml", DECLARED),
            ("population.toml", population::DECLARED),
        ];
        let sums = files.map(|(file, text)| (file.to_owned(), sha256(text.as_bytes())));
        BTreeMap::from(sums)
    }
}

impl laboratory::Study for ConditioningStudy {
    type Unit = Unit;

    fn metadata(&self) -> StudyIdentity<'_> {
        StudyIdentity {
            name: self.name,
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
        let Some((mechanism, participant, index)) = self.place(index).filter(|_| goes_on()) else {
            return Ok(None);
        };
        let judged = self.prior(participant, mechanism).judge(index)?;
        Ok(Some(Unit { mechanism, judged }))
    }

    fn outcome(&self, units: &[Unit], cut_short: Option<String>) -> anyhow::Result<Outcome> {
        Ok(outcome::outcome(self, units, cut_short))
    }

    fn files(&self, units: &[Unit]) -> anyhow::Result<Vec<(String, String)>> {
        let rows = outcome::posterior_csv(self, units);
        Ok(vec![("posterior.csv".to_owned(), rows)])
    }

    fn progress_text(&self, done: u64) -> String {
        format!("{done} of {} forearms", laboratory::Study::units(self))
    }
}
