//! Judges whether a claim holds for a random wearer.

use super::error::DistributedError;
use super::held::Endurance;
use super::study::{DrawResult, Study};
use crate::laboratory::{DecidingClaim, Share};

/// Mean endurance published by Buckmire 2018, s: with four electrodes, then with one.
pub const PUBLISHED_S: [f64; 2] = [232.0, 84.0];
/// Relative difference up to which two endurances count as alike.
const ALIKE: f64 = 0.10;

/// Returns whether claim `id` holds for the wearer with these results, or `None` if the results do
/// not decide it.
///
/// # Errors
/// Returns E722 if there is no claim `id`.
pub fn holds(found: &DrawResult, id: &str) -> Result<Option<bool>, DistributedError> {
    let endurance = |id| {
        found
            .condition_result(id)
            .map(|measurement| measurement.endurance)
    };
    let longer = |a, b, times| exceeds(endurance(a)?, endurance(b)?, times);
    let published = PUBLISHED_S[0] / PUBLISHED_S[1];
    let left = |id| {
        let own = found.condition_result(id)?;
        own.left.filter(|_| own.is_found)
    };
    let more_left = |id| Some(left(id)? > left("one-open")?);
    Ok(match id {
        "quarter-reaches" => endurance("four").map(|endurance| endurance.seconds > 0.0),
        "quarter-longer" => longer("four", "one", 1.0),
        "quarter-as-published" => longer("four", "one", published),
        "half-longer" => longer("four-half", "one", 1.0),
        "half-as-published" => longer("four-half", "one", published),
        "fast-longer" => longer("four-fast", "one", 1.0),
        "fast-as-published" => longer("four-fast", "one", published),
        "half-beats-fast" => longer("four-half", "four-fast", 1.0),
        "two-longer" => longer("two", "one", 1.0),
        "interleaved-alike" => {
            let (a, b) = ("four", "four-together");
            let apart = |a, b| longer(a, b, 1.0 + ALIKE);
            match (apart(a, b), apart(b, a)) {
                (None, _) | (_, None) => None,
                (Some(first), Some(second)) => Some(!first && !second),
            }
        }
        "interleaved-smoother" => {
            let ripple = |id| found.condition_result(id)?.ripple;
            ripple("four-open")
                .zip(ripple("four-together-open"))
                .map(|(a, b)| a < b)
        }
        "quarter-more-left" => more_left("four-open"),
        "half-more-left" => more_left("four-half-open"),
        "fast-more-left" => more_left("four-fast-open"),
        "tiring-longer" => longer("two-tiring", "two-fresh", 1.0),
        "tiring-nearer" => {
            let distance = |id| found.condition_result(id)?.distance;
            distance("two-tiring")
                .zip(distance("two-fresh"))
                .map(|(a, b)| a < b)
        }
        _ => return Err(DistributedError::Declaration(format!("no claim `{id}`"))),
    })
}

/// Returns whether the first endurance is longer than `times` the second. Returns `None` if the
/// force was never reached in either condition. An endurance that lasted to the end of the study is
/// only a lower bound; the result is also `None` if the bound does not decide.
#[must_use]
pub fn exceeds(first: Endurance, second: Endurance, times: f64) -> Option<bool> {
    let is_more = first.seconds > times * second.seconds;
    match (first.is_longer, second.is_longer) {
        (false, false) if first.seconds + second.seconds == 0.0 => None,
        (false, false) => Some(is_more),
        // The true endurance is longer than the observed one.
        (true, false) => is_more.then_some(true),
        (false, true) => (!is_more).then_some(false),
        (true, true) => None,
    }
}

impl Study {
    fn verdicts(
        &self,
        results: &[DrawResult],
        id: &str,
    ) -> Result<Vec<Option<bool>>, DistributedError> {
        let verdicts = results.iter().map(|result| holds(result, id));
        verdicts.collect()
    }

    /// Computes for each claim the share of these wearers in whom it holds.
    pub(super) fn shares(&self, results: &[DrawResult]) -> Result<Vec<Share>, DistributedError> {
        let claims = self.declared.claims.iter();
        let share =
            claims.map(|judgement| Ok(judgement.share(&self.verdicts(results, &judgement.id)?)));
        share.collect()
    }

    /// Finds for each claim the random parameters that decide whether it holds.
    pub(super) fn deciding_factors(
        &self,
        results: &[DrawResult],
    ) -> Result<Vec<DecidingClaim>, DistributedError> {
        let drawn: Vec<&[f64]> = results.iter().map(|result| &*result.drawn).collect();
        let claims = self.declared.claims.iter();
        let decided = claims.map(|judgement| {
            let verdicts = self.verdicts(results, &judgement.id)?;
            Ok(judgement.deciding_fields(&self.declared.ranges, &verdicts, &drawn))
        });
        decided.collect()
    }
}
