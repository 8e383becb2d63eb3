//! Sessions of experiments 1 to 3 and posture, and how their numbers and claims are told.

use super::experiments::{Condition, StimulationResult};
use crate::laboratory::{Row, Share};
use host_core::statistics;
use serde::{Deserialize, Serialize};

/// One participant's session of one draw.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Session {
    /// Whose.
    pub participant: String,
    /// Whether the paper tells of them in the additional experiment.
    pub is_printed: bool,
    /// Which replication.
    pub draw: u64,
    /// What was stimulated.
    pub conditions: Vec<Condition>,
    /// In the order in which it was.
    pub stimulated: Vec<StimulationResult>,
}

/// Median, 5th and 95th percentile of `all`.
pub(super) fn row(
    id: &str,
    quantity: String,
    unit: &str,
    paper: Option<f64>,
    all: Vec<f64>,
) -> Row {
    Row::from_numbers(id.to_owned(), quantity, unit, paper, all)
}

/// In how many of `all` that could be judged it holds.
pub(super) fn claim(
    id: &str,
    claim: String,
    paper: Option<bool>,
    all: impl IntoIterator<Item = Option<bool>>,
) -> Share {
    let judged: Vec<bool> = all.into_iter().flatten().collect();
    let (holds, of) = (
        judged.iter().filter(|flag| **flag).count() as u64,
        judged.len() as u64,
    );
    Share::from_counts(id.to_owned(), claim, paper, (holds, of))
}

/// Mean over the trials of the condition that `is`.
pub(super) fn mean(
    session: &Session,
    is: impl Fn(&Condition) -> bool,
    of: impl Fn(&StimulationResult) -> f64,
) -> Option<f64> {
    let all = session.stimulated.iter();
    let own = all.filter(|stimulation| is(&session.conditions[stimulation.condition]));
    statistics::mean(own.map(of))
}

/// Whoever took part, in the order of the sessions.
pub(super) fn people(sessions: &[Session]) -> Vec<(&str, bool)> {
    let mut all: Vec<(&str, bool)> = Vec::new();
    for session in sessions {
        if !all.iter().any(|(name, _)| *name == session.participant) {
            all.push((&session.participant, session.is_printed));
        }
    }
    all
}
