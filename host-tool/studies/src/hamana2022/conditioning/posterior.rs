//! The shipped posterior: accepted forearms with their weights and sessions.

use super::setup::{Setup, Solved};
use super::weights::{WeightSummary, choose_by_weight};
use crate::hamana2022::TwoPointsError;
use crate::hamana2022::participant::seed_of;
use hal_sim::random::unit;
use serde::Deserialize;

/// Text of `host-tool/experiments/hamana-posterior.csv`, which `flexor experiment
/// hamana-participants` writes at both declared seeds.
pub const SHIPPED: &str = include_str!("../../../../experiments/hamana-posterior.csv");

/// Random stream by which a forearm is chosen from the posterior.
const CHOSEN: u64 = 0x7133;

/// An accepted forearm of a participant.
#[derive(Clone, Debug, PartialEq)]
pub struct AcceptedForearm {
    /// Name of the participant.
    pub participant: String,
    /// Seed and number of the forearm.
    pub drawn: (u64, u64),
    /// Whether the second condition holds too; such a forearm has a row of its own.
    pub is_strict: bool,
    /// Weight among the forearms of the same participant, condition and seed, whose sum is 1.
    pub weight: f64,
    /// Session of table 7.
    pub solved: Solved,
    /// Sessions of tables 2 and 3.
    pub unsolved: [Option<Setup>; 2],
}

/// Forearms of all participants.
#[derive(Clone, Debug)]
pub struct Posterior {
    forearms: Vec<AcceptedForearm>,
}

/// Row of the file; the drawn parameters that follow are for readers.
#[derive(Deserialize)]
struct FileRow {
    participant: String,
    seed: u64,
    forearm: u64,
    condition: String,
    weight: f64,
    factor: f64,
    coupling_b: f64,
    coupling_e: f64,
    session_7: u64,
    a_7: usize,
    b_7: usize,
    session_2: Option<u64>,
    a_2: Option<usize>,
    b_2: Option<usize>,
    session_3: Option<u64>,
    a_3: Option<usize>,
    b_3: Option<usize>,
}

impl FileRow {
    fn into_forearm(self) -> AcceptedForearm {
        let setup = |session: Option<u64>, a: Option<usize>, b: Option<usize>| {
            let (session, points) = (session?, [a?, b?]);
            Some(Setup { session, points })
        };
        AcceptedForearm {
            drawn: (self.seed, self.forearm),
            is_strict: self.condition == "strict",
            weight: self.weight,
            solved: Solved {
                setup: Setup {
                    session: self.session_7,
                    points: [self.a_7, self.b_7],
                },
                factor: self.factor,
                coupling: [1.0, self.coupling_b, self.coupling_e],
            },
            unsolved: [
                setup(self.session_2, self.a_2, self.b_2),
                setup(self.session_3, self.a_3, self.b_3),
            ],
            participant: self.participant,
        }
    }
}

impl Posterior {
    /// Parses the posterior that is part of the program.
    ///
    /// # Errors
    /// Returns E621 if it cannot be parsed.
    pub fn load_embedded() -> Result<Self, TwoPointsError> {
        Self::parse(SHIPPED)
    }

    /// Parses the file that the study writes.
    ///
    /// # Errors
    /// Returns E621 with the first mistake.
    pub fn parse(text: &str) -> Result<Self, TwoPointsError> {
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let rows: Result<Vec<FileRow>, csv::Error> = reader.deserialize().collect();
        let rows = rows.map_err(|error| {
            TwoPointsError::Declaration(format!("hamana-posterior.csv: {error}"))
        })?;
        let forearms = rows.into_iter().map(FileRow::into_forearm).collect();
        Ok(Self { forearms })
    }

    /// Iterates over the forearms of a participant under the first or the second condition.
    pub fn of<'a>(
        &'a self,
        participant: &str,
        is_strict: bool,
    ) -> impl Iterator<Item = &'a AcceptedForearm> {
        let own = self.forearms.iter();
        own.filter(move |forearm| {
            forearm.participant == participant && forearm.is_strict == is_strict
        })
    }

    /// Returns the effective sample size of a participant's forearms.
    #[must_use]
    pub fn effective(&self, participant: &str, is_strict: bool) -> f64 {
        let weights: Vec<f64> = self
            .of(participant, is_strict)
            .map(|own| own.weight)
            .collect();
        WeightSummary::of(&weights).effective
    }

    /// Chooses a forearm by weight for draw `index`; `None` if the participant has none.
    #[must_use]
    pub fn choose(
        &self,
        (participant, is_strict): (&str, bool),
        (seed, index): (u64, u64),
    ) -> Option<&AcceptedForearm> {
        let own = self.of(participant, is_strict);
        let own: Vec<(&AcceptedForearm, f64)> = own.map(|own| (own, own.weight)).collect();
        let stream = seed_of(participant, seed ^ CHOSEN);
        choose_by_weight(&own, unit(stream, index)).copied()
    }
}
