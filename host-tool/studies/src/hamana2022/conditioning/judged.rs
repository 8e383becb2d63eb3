//! Result of judging a forearm: with which probability its sessions meet the tables, and one session
//! of each.

use super::posterior::AcceptedForearm;
use super::setup::{Setup, Solved};
use super::weights::choose_by_weight;
use hal_sim::random::unit;
use serde::{Deserialize, Serialize};

/// Sessions of a table that meet its data.
#[derive(Clone, Debug)]
pub struct Accepted<T> {
    /// Probabilities that A meets the data, and that both A and B do.
    pub met: [f64; 2],
    /// Sessions that meet the data, with their weights.
    sessions: Vec<(T, f64)>,
}

/// How many sessions judge a forearm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Number of sessions of table 7.
    pub solved: u64,
    /// Number of sessions of table 7 that are chosen among those that meet it.
    pub chosen: u64,
    /// Number of sessions of each of tables 2 and 3 for each chosen session of table 7.
    pub unsolved: u64,
    /// Probability of meeting table 7 below which a forearm is kept by a chance in proportion.
    pub kept_from: f64,
}

/// A forearm with sessions that meet all data of its participant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    /// Chosen session of table 7.
    pub solved: Solved,
    /// Probability that a session of table 7 meets its data, divided by the probability with which
    /// the forearm was kept; for a participant without table 7, that its thresholds can be solved.
    pub probability: f64,
    /// Probability that sessions of both other tables meet their data, mean over sessions of table 7
    /// that meet theirs.
    pub joint: f64,
    /// The same for each of the other tables, at A, and at A and B. Table 3 is judged only with a
    /// session of table 7 for which table 2 is met.
    pub met: [[f64; 2]; 2],
    /// Chosen sessions of the other tables; `None` for a table that prints nothing of the participant,
    /// or without weight.
    pub unsolved: [Option<Setup>; 2],
}

/// Result of judging one forearm.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JudgedForearm {
    /// Name of the participant.
    pub participant: String,
    /// Number of the forearm, from 0.
    pub index: u64,
    /// Number of possible pairs of places; 0 if there are no two selective places.
    pub pairs: usize,
    /// Probabilities that a session of table 7 meets the data of A, and those of A and B.
    pub solved: [f64; 2],
    /// The forearm, if it has sessions that meet table 7.
    pub posterior: Option<Candidate>,
    /// The same under the second condition; `None` also for a participant to whom it does not
    /// apply.
    pub strict: Option<Candidate>,
}

impl JudgedForearm {
    /// Returns a forearm that is not judged.
    pub(super) fn unjudged(participant: &str, index: u64) -> Self {
        Self {
            participant: participant.to_owned(),
            index,
            pairs: 0,
            solved: [0.0; 2],
            posterior: None,
            strict: None,
        }
    }

    /// Returns the candidate under the first or the second condition as an accepted forearm; `seed`
    /// is that of the forearm, and the weight is not normalised.
    #[must_use]
    pub fn accepted(&self, seed: u64, is_strict: bool) -> Option<AcceptedForearm> {
        let candidate = self.candidate(is_strict)?;
        Some(AcceptedForearm {
            participant: self.participant.clone(),
            drawn: (seed, self.index),
            is_strict,
            weight: candidate.weight(),
            solved: candidate.solved,
            unsolved: candidate.unsolved,
        })
    }

    /// Returns the candidate under the first or the second condition.
    #[must_use]
    pub const fn candidate(&self, is_strict: bool) -> Option<&Candidate> {
        match is_strict {
            true => self.strict.as_ref(),
            false => self.posterior.as_ref(),
        }
    }
}

impl<T> Default for Accepted<T> {
    fn default() -> Self {
        Self {
            met: [0.0; 2],
            sessions: Vec::new(),
        }
    }
}

impl<T> Accepted<T> {
    /// Adds a session that meets the data at A, with its probability among all sessions.
    pub(super) fn add_a(&mut self, probability: f64) {
        self.met[0] += probability;
    }

    /// Adds a session that meets the data at A and B, with its probability among all sessions.
    pub(super) fn add(&mut self, session: T, probability: f64) {
        self.met[1] += probability;
        self.sessions.push((session, probability));
    }

    /// Returns the session at the fraction `part` of the weight, 0 to 1; `None` if there is none.
    pub(super) fn at(&self, part: f64) -> Option<&T> {
        choose_by_weight(&self.sessions, part)
    }

    /// Returns the probability of the sessions if the forearm is kept. A forearm less likely than
    /// `kept_from` is kept with a chance in proportion, and its probability divided by that chance,
    /// so that its weight is right on average; `part` is uniform in [0, 1).
    pub(super) fn with_chance(&self, kept_from: f64, part: f64) -> Option<f64> {
        let chance = (self.met[1] / kept_from).min(1.0);
        (part < chance).then(|| self.met[1] / chance)
    }
}

impl Candidate {
    /// Returns the weight of the forearm: the product of the probabilities that its sessions meet
    /// their tables.
    #[must_use]
    pub fn weight(&self) -> f64 {
        self.probability * self.joint
    }
}

/// Chooses one of many weighted items, which arrive one after the other.
pub(super) struct Choice<T> {
    stream: u64,
    count: u64,
    /// Sum of all weights.
    total: f64,
    pub chosen: Option<T>,
}

impl<T> Choice<T> {
    pub const fn new(stream: u64) -> Self {
        Self {
            stream,
            count: 0,
            total: 0.0,
            chosen: None,
        }
    }

    /// Takes one more item, which replaces the chosen one with a chance in proportion to its weight.
    pub fn offer(&mut self, weight: f64, item: T) {
        self.total += weight;
        if unit(self.stream, self.count) * self.total < weight {
            self.chosen = Some(item);
        }
        self.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chance of being kept changes a forearm's probability not on average, and keeps a likely one
    /// always.
    #[test]
    fn the_chance_of_being_kept_leaves_the_mean() {
        let accepted = |probability: f64| {
            let mut accepted = Accepted::default();
            accepted.add((), probability);
            accepted
        };
        let parts = (0..1_000).map(|place| (f64::from(place) + 0.5) / 1_000.0);
        for probability in [0.0, 0.001, 0.004, 0.1] {
            let own = accepted(probability);
            let kept = parts.clone().map(|part| own.with_chance(0.005, part));
            let mean = kept.flatten().sum::<f64>() / 1_000.0;
            assert!((mean - probability).abs() < 1e-12, "{probability}: {mean}");
        }
        assert_eq!(accepted(0.1).with_chance(0.005, 0.999), Some(0.1));
        assert_eq!(accepted(0.001).with_chance(0.005, 0.5), None);
    }
}
