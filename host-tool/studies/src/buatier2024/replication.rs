//! Simulates one study of eight participants.

use super::declaration::{HEIGHTS, Metric, Study};
use super::error::LiftError;
use super::participant::{Participant, participant};
use super::person::{LiftWearer, draw_values};
use super::tests::{Tested, test_metric};
use hal_sim::random;
use serde::{Deserialize, Serialize};

/// Random stream of the participants' own seeds.
const PERSONS: u64 = 0x11F7;

/// Results of one simulated study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Replication {
    pub people: Vec<Participant>,
    /// Tests of power; then of the error at each height and of its mean; then of the smoothness at
    /// each height and of its mean.
    pub tests: Vec<Tested>,
}

/// Returns the tested metrics in the order of [`Replication::tests`], each with a height, or with
/// `None` for the mean over heights.
#[must_use]
pub(super) fn families() -> Vec<(Metric, Option<usize>)> {
    let by_height = |metric| (0..HEIGHTS).map(move |height| (metric, Some(height)));
    let mut metrics = vec![(Metric::Power, None)];
    for metric in [Metric::Error, Metric::Smoothness] {
        metrics.extend(by_height(metric));
        metrics.push((metric, None));
    }
    metrics
}

/// Returns participant `nth` of study `index`.
///
/// # Errors
/// Fails with E760 if a range is missing.
pub(super) fn person(
    study: &Study,
    seed: u64,
    (index, nth): (u64, usize),
) -> Result<LiftWearer, LiftError> {
    let number = index * study.protocol.persons as u64 + nth as u64;
    let own = random::word(random::word(seed, PERSONS), number);
    LiftWearer::new(study, draw_values(study, seed, number), own)
}

/// Simulates study `index`. `is_asked` is called before each participant and returns whether to
/// end.
///
/// # Errors
/// Fails if a participant is invalid, if the device refuses its settings, if a sample cannot be
/// tested, or if asked to end.
pub fn replication(
    study: &Study,
    seed: u64,
    index: u64,
    is_asked: &(dyn Fn() -> bool + Sync),
) -> Result<Replication, LiftError> {
    let simulated_person = |nth| {
        if is_asked() {
            return Err(LiftError::Asked);
        }
        let person = person(study, seed, (index, nth))?;
        participant(study, &person, study.protocol.target_sets)
    };
    let people = (0..study.protocol.persons).map(simulated_person);
    let people = people.collect::<Result<Vec<_>, LiftError>>()?;
    let level = study.protocol.level;
    let test = |family| test_metric(&people, family, level);
    let tests = families()
        .into_iter()
        .map(test)
        .collect::<Result<_, LiftError>>()?;
    Ok(Replication { people, tests })
}
