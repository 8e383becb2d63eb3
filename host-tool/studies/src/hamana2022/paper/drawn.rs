//! Draws the wearer of a participant from the forearms that the study's command selects.

use super::{Kind, Study};
use crate::hamana2022::conditioning::{AcceptedForearm, Mechanism, Prior, Table};
use crate::hamana2022::error::TwoPointsError;
use crate::hamana2022::experiments::Experiment;
use crate::hamana2022::participant::Participant;
use crate::hamana2022::wearers::Wearer;
use std::sync::PoisonError;

/// Forearms that the participants of a study have.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Source {
    /// Forearms that agree with all voltages that the paper prints for the participant.
    Posterior,
    /// The same, with P's index finger fully flexed by one point at its greatest voltage
    /// (experiment 3).
    Strict,
    /// Forearms of the prior, which agree with the thresholds of table 7 in its session.
    Prior,
    /// Forearms of the prior whose greatest voltages lie below the end of the search.
    Below,
    /// Forearms with fixed scatter, skin, return, limiter and rule of search, which agree with the
    /// thresholds in every session.
    Fixed,
}

impl Source {
    /// All sources, in the order of a table of claims.
    pub const ALL: [Self; 5] = [
        Self::Posterior,
        Self::Strict,
        Self::Prior,
        Self::Below,
        Self::Fixed,
    ];

    /// Returns the name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Posterior => "posterior",
            Self::Strict => "strict",
            Self::Prior => "prior",
            Self::Below => "below",
            Self::Fixed => "fixed",
        }
    }

    /// Returns the source with this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|source| source.name() == name)
    }

    /// Describes the forearms for the report page.
    pub(super) const fn note(self) -> &'static str {
        match self {
            Self::Posterior => {
                "Forearms: conditioned on the thresholds and the greatest selective voltages of \
                 tables 2, 3 and 7 (flexor experiment hamana-participants). These are no result of \
                 this study."
            }
            Self::Strict => {
                "Forearms: conditioned as the posterior; P's also on one point at its greatest \
                 voltage flexing the index finger fully (experiment 3)."
            }
            Self::Prior => {
                "Forearms: the prior, which meets the thresholds of table 7 in its session and no \
                 other printed voltage."
            }
            Self::Below => {
                "Forearms: those of the prior whose greatest voltages in table 7's session lie below \
                 the end of the search."
            }
            Self::Fixed => {
                "Forearms: fixed scatter, skin, return, limiter and search, as before the \
                 participants were conditioned on the printed greatest voltages, which these \
                 forearms do not meet."
            }
        }
    }
}

/// Number of different forearms below the ceiling. One in some hundred is, and later draws repeat
/// these.
const BELOW: u64 = 40;
const NOT_ACCEPTED: &str = "no accepted forearm";
const NOT_COMPLETE: &str = "no forearm of the prior has voltages in every session";

/// Forearm of a draw.
pub(super) enum ChosenForearm {
    /// Forearm of the posterior or of the prior, with a session of each table.
    WithSessions(AcceptedForearm),
    /// Number of a draw of the former population.
    Fixed(u64),
}

impl Kind {
    /// Returns the table whose session the experiment belongs to.
    const fn table(self) -> Table {
        match self {
            Self::Patterns(Experiment::Selectivity) => Table::Two,
            Self::Patterns(Experiment::Torque) => Table::Three,
            Self::Patterns(Experiment::Intensities | Experiment::Posture)
            | Self::Control
            | Self::Hold => Table::Seven,
        }
    }
}

impl Study {
    /// Returns the number of forearms of a participant that count as independent draws; infinite if
    /// every draw has its own.
    pub(super) fn effective_forearms(&self, participant: &Participant) -> f64 {
        let name = &participant.name;
        let is_strict =
            self.source == Source::Strict && *name == self.conditioning.strict.participant;
        match self.source {
            Source::Posterior | Source::Strict => self.posterior.effective(name, is_strict),
            Source::Below => BELOW as f64,
            Source::Prior | Source::Fixed => f64::INFINITY,
        }
    }

    /// Chooses the forearm of a participant for a draw, or returns the reason why there is none. All
    /// sessions of the draw have this forearm.
    pub(super) fn choose_forearm(
        &self,
        participant: &Participant,
        draw: u64,
    ) -> Result<Result<ChosenForearm, &'static str>, TwoPointsError> {
        let accepted = |is_strict: bool| {
            let is_strict = is_strict && participant.name == self.conditioning.strict.participant;
            let whose = (&*participant.name, is_strict);
            let chosen = self.posterior.choose(whose, (self.seed, draw));
            let chosen = chosen.cloned().map(ChosenForearm::WithSessions);
            chosen.ok_or(NOT_ACCEPTED)
        };
        let of_prior = |forearm: Option<AcceptedForearm>| {
            let chosen = forearm.map(ChosenForearm::WithSessions);
            chosen.ok_or(NOT_COMPLETE)
        };
        let prior = self.prior(participant, self.seed);
        match self.source {
            Source::Posterior => Ok(accepted(false)),
            Source::Strict => Ok(accepted(true)),
            Source::Prior => Ok(of_prior(prior.complete_forearm(draw, false)?)),
            Source::Below => Ok(of_prior(self.forearm_below(participant, draw % BELOW)?)),
            Source::Fixed => Ok(Ok(ChosenForearm::Fixed(draw))),
        }
    }

    /// Returns forearm `place` of the prior below the ceiling. A panic elsewhere cannot
    /// leave a wrong number behind, so that a poisoned lock is no obstacle.
    fn forearm_below(
        &self,
        participant: &Participant,
        place: u64,
    ) -> Result<Option<AcceptedForearm>, TwoPointsError> {
        let key = (participant.name.clone(), place);
        let known = self.below.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(forearm) = known.get(&key) {
            return Ok(forearm.clone());
        }
        drop(known);
        let prior = self.prior(participant, self.seed);
        let forearm = prior.complete_forearm(place, true)?;
        let mut known = self.below.lock().unwrap_or_else(PoisonError::into_inner);
        known.insert(key, forearm.clone());
        Ok(forearm)
    }

    /// Creates the wearer of a chosen forearm in this experiment's session, or returns the reason why
    /// there is none.
    pub(super) fn wearer_of(
        &self,
        participant: &Participant,
        chosen: &ChosenForearm,
    ) -> Result<Result<Wearer, &'static str>, TwoPointsError> {
        let table = self.kind.table();
        match chosen {
            ChosenForearm::WithSessions(forearm) => self
                .prior(participant, forearm.drawn.0)
                .accepted_wearer(forearm, table),
            ChosenForearm::Fixed(draw) => {
                let drawn = (self.seed, *draw);
                self.participants.draw(participant, &self.population, drawn)
            }
        }
    }

    /// Draws the wearer of a participant, or returns the reason why there is none.
    pub(super) fn draw_wearer(
        &self,
        participant: &Participant,
        draw: u64,
    ) -> Result<Result<Wearer, &'static str>, TwoPointsError> {
        match self.choose_forearm(participant, draw)? {
            Ok(chosen) => self.wearer_of(participant, &chosen),
            Err(why) => Ok(Err(why)),
        }
    }

    fn prior<'a>(&'a self, participant: &'a Participant, seed: u64) -> Prior<'a> {
        Prior {
            declaration: &self.conditioning,
            population: &self.population,
            participant,
            mechanism: Mechanism::Default,
            seed,
        }
    }
}
