//! Judges the claims of `hamana-population.toml` for a wearer.

use super::pattern::Points;
use super::trials::{Outcome, Postures};
use super::voltages::{SELECTIVE, Voltages};
use host_core::statistics::mean;

/// Ratio of two torques above which the first counts as larger.
const MORE: f64 = 1.05;
/// Ratios of two torques that count as equal.
pub(super) const ALIKE: std::ops::RangeInclusive<f64> = 0.9..=1.15;
/// Smallest phase difference of a pattern that the claims about torque use, µs. Isolated patterns
/// exist only from this phase difference on (figure 5).
const LONG_US: u32 = 1_000;

/// Torques of a wearer that the claims compare, N·m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torques {
    /// Mean over the conducted two-point patterns with a phase difference of at least 1 ms.
    pub two: f64,
    /// Mean over the isolated two-point patterns; their phase difference is at least 1 ms.
    pub apart: f64,
    /// Torque of A or B alone, conducted, whichever is larger.
    pub one: f64,
    /// Torque of A or B alone, isolated, whichever is larger.
    pub one_isolated: f64,
}

impl Torques {
    /// Computes the torques from the outcomes of all 29 patterns.
    #[must_use]
    pub fn from_outcomes(outcomes: &[Outcome]) -> Self {
        let long = |isolated: bool| {
            let selection = outcomes.iter().filter(|outcome| {
                outcome.pattern.isolated == isolated
                    && outcome
                        .pattern
                        .phase_difference_us()
                        .is_some_and(|after| after >= LONG_US)
            });
            mean(selection.map(|outcome| outcome.torque_nm)).unwrap_or_default()
        };
        let alone = |isolated: bool| {
            let selection = outcomes.iter().filter(|outcome| {
                outcome.pattern.isolated == isolated
                    && matches!(outcome.pattern.points, Points::One(_))
            });
            selection
                .map(|outcome| outcome.torque_nm)
                .fold(0.0, f64::max)
        };
        Self {
            two: long(false),
            apart: long(true),
            one: alone(false),
            one_isolated: alone(true),
        }
    }
}

/// Phase differences at which claims compare individuation, µs: 0, at which both points are pulsed
/// at the same time, then all phase differences of the paper from 500 µs on.
pub const PHASES_US: [u32; 6] = [0, 500, 1_000, 2_000, 5_000, 10_000];
/// Index in [`PHASES_US`] of 0 µs, at which both points are pulsed at the same time.
pub(super) const TOGETHER: usize = 0;
/// Index in [`PHASES_US`] of 2000 µs.
pub(super) const LATE: usize = 3;

/// Mean individuation index of the conducted patterns at each of [`PHASES_US`]; `None` where the
/// paper's rule excludes every trial.
pub type Individuations = [Option<f64>; PHASES_US.len()];

/// Computes the [`Individuations`] from the outcomes of all patterns.
pub(super) fn individuations(outcomes: &[Outcome]) -> Individuations {
    PHASES_US.map(|after_us| individuation(outcomes, after_us))
}

/// Returns the mean individuation of the conducted patterns with this phase difference.
fn individuation(outcomes: &[Outcome], after_us: u32) -> Option<f64> {
    let selection = outcomes.iter().filter(|outcome| {
        !outcome.pattern.isolated && outcome.pattern.phase_difference_us() == Some(after_us)
    });
    mean(selection.filter_map(|outcome| outcome.individuation))
}

/// Judges the claims of `hamana-population.toml` in their order; `None` stands for a claim that
/// cannot be judged. `postures` has the angles with one point, then those with two.
#[must_use]
pub fn judge_claims(
    torques: &Torques,
    individuations: &Individuations,
    voltages: &Voltages,
    postures: &[Postures; 2],
) -> [Option<bool>; 8] {
    let ratio = |a: f64, b: f64| (b > 0.0).then(|| a / b);
    let at = |place: usize| individuations[place];
    let apart = at(TOGETHER)
        .zip(at(LATE))
        .map(|(together, apart)| together < apart);
    let late = individuations.iter().skip(TOGETHER + 1).copied();
    let is_selective = late.collect::<Option<Vec<f64>>>();
    let lower = voltages.ratio.map(|r| {
        let points = voltages.most_v.into_iter().zip(voltages.threshold_v);
        points
            .into_iter()
            .all(|(most, threshold)| r * most < threshold)
    });
    let lost = postures.map(|bent| bent[0] - bent[2]);
    [
        apart,
        is_selective.map(|values| values.iter().all(|value| *value > SELECTIVE)),
        ratio(torques.two, torques.one).map(|ratio| ratio > MORE),
        ratio(torques.two, torques.apart).map(|ratio| ratio > MORE),
        ratio(torques.apart, torques.one).map(|ratio| ALIKE.contains(&ratio)),
        ratio(torques.one, torques.one_isolated).map(|ratio| ALIKE.contains(&ratio)),
        Some(lower.unwrap_or(false)),
        Some(lost[1] < lost[0]),
    ]
}
