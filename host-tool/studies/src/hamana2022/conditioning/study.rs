//! The conditioning as a study of the laboratory, which can be resumed and divided into shards.

use super::data::{PrintedVoltages, Table};
use super::declaration::{DECLARED, Declaration};
use super::judged::{Effort, JudgedForearm};
use super::measurements::measure;
use super::mechanism::Mechanism;
use super::prior::Prior;
use crate::hamana2022::experiments::{Experiment, Protocol};
use crate::hamana2022::population::{self, Population};
use crate::hamana2022::replication::Averages;
use crate::hamana2022::wearers::Participants;
use crate::hamana2022::{Participant, TwoPointsError};
use host_core::record::sha256;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Names of the studies on the command line.
pub const PARTICIPANTS: &str = "hamana-participants";
pub const MECHANISMS: &str = "hamana-mechanisms";

/// Variant of the conditioning.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Conditioning {
    /// The model as it stands.
    Participants,
    /// Every single change of the model.
    Mechanisms,
}

impl Conditioning {
    /// Returns the kind of the study with this name on the command line.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let all = [Self::Participants, Self::Mechanisms];
        all.into_iter().find(|kind| kind.name() == name)
    }

    /// Returns the name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Participants => PARTICIPANTS,
            Self::Mechanisms => MECHANISMS,
        }
    }
}

/// Conditions forearms on the printed voltages, under the model as it stands or under single changes
/// of it.
pub struct ConditioningStudy {
    pub(super) declaration: Declaration,
    pub(super) population: Population,
    pub(super) protocol: Protocol,
    pub(super) participants: Vec<Participant>,
    pub(super) mechanisms: Vec<Mechanism>,
    pub(super) kind: Conditioning,
    pub(super) arguments: String,
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
    /// Result of judging it.
    pub judged: JudgedForearm,
    /// Experiment 2 of a forearm with weight; only in the study of mechanisms.
    #[serde(default)]
    pub torque: Option<Averages>,
    /// Further measurements of a forearm that meets table 7; only in the study of mechanisms.
    #[serde(default)]
    pub measured: Option<Vec<Option<f64>>>,
}

impl ConditioningStudy {
    /// Creates the study. `who` is a participant's letter; `None` stands for all. `None` for seed and draws
    /// takes the declared ones.
    ///
    /// # Errors
    /// Returns E621 if the declaration is wrong or if printed voltages contradict each other, and
    /// E624 if there is no such participant.
    pub fn new(
        kind: Conditioning,
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
        let (mechanisms, declared_draws) = match kind {
            Conditioning::Mechanisms => {
                let simulated = Mechanism::ALL.into_iter();
                // The mean of the points is another statistic of the same forearms.
                let simulated = simulated.filter(|own| *own != Mechanism::MeanOfPoints);
                (simulated.collect(), declaration.mechanism_draws)
            }
            _ => (vec![Mechanism::Default], declaration.draws),
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
            protocol: Protocol::load_embedded()?,
            participants,
            mechanisms,
            kind,
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
    pub(super) fn place(&self, unit: u64) -> Option<(Mechanism, &Participant, u64)> {
        let draws = self.draws.max(1);
        let (group, index) = (unit / draws, unit % draws);
        let group = usize::try_from(group).ok()?;
        let count = self.participants.len();
        let mechanism = self.mechanisms.get(group / count.max(1))?;
        Some((*mechanism, self.participants.get(group % count)?, index))
    }

    /// Judges a forearm by the declared numbers of sessions.
    pub(super) fn judge(
        &self,
        prior: &Prior<'_>,
        index: u64,
    ) -> Result<JudgedForearm, TwoPointsError> {
        let declaration = &self.declaration;
        let effort = Effort {
            solved: declaration.solved_sessions,
            chosen: declaration.chosen_sessions,
            unsolved: declaration.sessions,
            kept_from: declaration.kept_from,
        };
        prior.judge(index, effort)
    }

    /// Returns whether the study judges changes of the model.
    pub(super) fn is_of_mechanisms(&self) -> bool {
        self.kind == Conditioning::Mechanisms
    }

    /// Simulates experiment 2 and the further measurements of a forearm.
    pub(super) fn measure(
        &self,
        participant: &Participant,
        unit: &mut Unit,
    ) -> Result<(), TwoPointsError> {
        let Some(accepted) = unit.judged.accepted(self.seed, false) else {
            return Ok(());
        };
        let prior = self.prior(participant, unit.mechanism);
        if let Ok(wearer) = prior.accepted_wearer(&accepted, Table::Seven)? {
            unit.measured = Some(measure(&wearer)?.to_vec());
        }
        if accepted.weight > 0.0
            && let Ok(wearer) = prior.accepted_wearer(&accepted, Table::Three)?
        {
            let conditions = Experiment::Torque.conditions(&wearer.voltages, &self.protocol);
            let results =
                wearer.run_session(&self.population, &self.protocol, Experiment::Torque)?;
            let averages = Averages::from_session(Experiment::Torque, &conditions, &results);
            unit.torque = Some(averages);
        }
        Ok(())
    }

    pub(super) fn command(&self) -> String {
        let Self {
            arguments, draws, ..
        } = self;
        let name = self.name();
        format!("experiment {name} {arguments}--draws {draws}")
    }

    pub(super) const fn name(&self) -> &'static str {
        self.kind.name()
    }

    pub(super) fn sha256(&self) -> BTreeMap<String, String> {
        let files = [
            ("hamana-participants.toml", DECLARED),
            ("population.toml", population::DECLARED),
        ];
        files
            .into_iter()
            .map(|(file, text)| (file.to_owned(), sha256(text.as_bytes())))
            .collect()
    }
}
