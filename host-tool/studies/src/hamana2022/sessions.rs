//! Sessions of experiments 1 to 3 and posture, and helpers that turn their numbers and claims into
//! rows and shares.

use super::experiments::{Condition, StimulationResult};
use crate::laboratory::{Row, Share};
use host_core::statistics;
use serde::{Deserialize, Serialize};

/// Session of one participant in one draw.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Session {
    /// Name of the participant: P, Q, R or S, or that of a wearer file.
    pub participant: String,
    /// Whether the declaration has printed results of this participant; R has none.
    pub is_printed: bool,
    /// Index of the draw.
    pub draw: u64,
    /// Conditions of the session, to which [`StimulationResult::condition`] is an index.
    pub conditions: Vec<Condition>,
    /// Stimulations in the order in which they were applied.
    pub stimulated: Vec<StimulationResult>,
}

/// Builds a row with the median and the 5th and 95th percentile of `values`.
pub(super) fn row(
    id: &str,
    quantity: String,
    unit: &str,
    paper: Option<f64>,
    values: Vec<f64>,
) -> Row {
    Row::from_numbers(id.to_owned(), quantity, unit, paper, values)
}

/// Counts in how many of the judged cases the claim holds; `None` stands for a case that cannot be
/// judged.
pub(super) fn claim(
    id: &str,
    claim: String,
    paper: Option<bool>,
    verdicts: impl IntoIterator<Item = Option<bool>>,
) -> Share {
    let judged: Vec<bool> = verdicts.into_iter().flatten().collect();
    let (holds, total) = (
        judged.iter().filter(|flag| **flag).count() as u64,
        judged.len() as u64,
    );
    Share::from_counts(id.to_owned(), claim, paper, (holds, total))
}

/// Level of the intervals of [`percent_text`].
const LEVEL: f64 = 0.95;

/// Returns the share of `holds` among `of` in percent with its 95 % interval (Wilson 1927), such as
/// `40 [31 50]`; `-` if `of` is 0. The interval is that of at most `effective` cases, where cases
/// repeat each other.
pub(super) fn percent_text((holds, of): (u64, u64), effective: f64) -> String {
    let independent = of.min(effective.max(1.0) as u64);
    let holds = holds as f64 * independent as f64 / of.max(1) as f64;
    let Ok(share) = statistics::wilson_share(holds, independent, LEVEL) else {
        return "-".to_owned();
    };
    let [share, low, high] = [share.share, share.low, share.high].map(|part| 100.0 * part);
    format!("{share:.0} [{low:.0} {high:.0}]")
}

/// Returns the mean of `measure` over all stimulations whose condition satisfies `is`; `None` if there
/// are none.
pub(super) fn mean(
    session: &Session,
    is: impl Fn(&Condition) -> bool,
    measure: impl Fn(&StimulationResult) -> f64,
) -> Option<f64> {
    let stimulations = session.stimulated.iter();
    let own = stimulations.filter(|stimulation| is(&session.conditions[stimulation.condition]));
    statistics::mean(own.map(measure))
}

/// Returns the name of each participant, in the order of the sessions, and whether the paper prints
/// their results.
pub(super) fn people(sessions: &[Session]) -> Vec<(&str, bool)> {
    let mut participants: Vec<(&str, bool)> = Vec::new();
    for session in sessions {
        if !participants
            .iter()
            .any(|(name, _)| *name == session.participant)
        {
            participants.push((&session.participant, session.is_printed));
        }
    }
    participants
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Replications that repeat 20 forearms are no more certain than 20 replications.
    #[test]
    fn an_interval_counts_effective_cases() {
        assert_eq!(percent_text((40, 200), f64::INFINITY), "20 [15 26]");
        assert_eq!(percent_text((40, 200), 20.4), "20 [8 42]");
        assert_eq!(percent_text((3, 15), 20.4), percent_text((3, 15), 1e9));
        assert_eq!(percent_text((0, 0), 20.0), "-");
    }
}
