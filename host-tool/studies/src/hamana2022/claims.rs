//! Judges the claims of `hamana-population.toml` for a wearer.

use super::pattern::Points;
use super::trials::{Outcome, Postures};
use super::voltages::{SELECTIVE, Voltages};
use host_core::statistics::mean;

/// Smallest ratio of two torques that counts as "exceeds".
const MORE: f64 = 1.05;
/// Ratios that count as equal.
const ALIKE: std::ops::RangeInclusive<f64> = 0.9..=1.15;
/// Phase difference from which on a pattern counts as long, µs. Patterns can be isolated from there
/// on (figure 5).
const LONG_US: u32 = 1_000;

/// Torques of a wearer that the claims compare, N·m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torques {
    /// Two points, conducted, with a phase difference of at least 1 ms.
    pub two: f64,
    /// Two points, isolated, with a phase difference of at least 1 ms.
    pub apart: f64,
    /// The stronger of the two points alone, conducted.
    pub one: f64,
    /// The stronger of the two points alone, isolated.
    pub one_isolated: f64,
}

impl Torques {
    /// Computes the torques from the outcomes of all 29 patterns.
    #[must_use]
    pub fn from_outcomes(outcomes: &[Outcome]) -> Self {
        let long = |isolated: bool| {
            let of = outcomes.iter().filter(|outcome| {
                outcome.pattern.isolated == isolated
                    && outcome
                        .pattern
                        .phase_difference_us()
                        .is_some_and(|after| after >= LONG_US)
            });
            mean(of.map(|outcome| outcome.torque_nm)).unwrap_or_default()
        };
        let alone = |isolated: bool| {
            let of = outcomes.iter().filter(|outcome| {
                outcome.pattern.isolated == isolated
                    && matches!(outcome.pattern.points, Points::One(_))
            });
            of.map(|outcome| outcome.torque_nm).fold(0.0, f64::max)
        };
        Self {
            two: long(false),
            apart: long(true),
            one: alone(false),
            one_isolated: alone(true),
        }
    }
}

/// Phase differences at which claims compare individuation, µs: both together, then all from 500 µs
/// on.
pub const PHASES_US: [u32; 6] = [0, 500, 1_000, 2_000, 5_000, 10_000];
/// Indices in [`PHASES_US`] of both points together and of 2000 µs.
pub(super) const TOGETHER: usize = 0;
pub(super) const LATE: usize = 3;

/// Mean individuation of the conducted patterns at each of [`PHASES_US`]; `None` if every trial was
/// left out.
pub type Individuations = [Option<f64>; PHASES_US.len()];

/// Computes the [`Individuations`] from the outcomes of all patterns.
pub(super) fn individuations(outcomes: &[Outcome]) -> Individuations {
    PHASES_US.map(|after_us| individuation(outcomes, after_us))
}

/// Returns the mean individuation of the conducted patterns with this phase difference.
fn individuation(outcomes: &[Outcome], after_us: u32) -> Option<f64> {
    let of = outcomes.iter().filter(|outcome| {
        !outcome.pattern.isolated && outcome.pattern.phase_difference_us() == Some(after_us)
    });
    mean(of.filter_map(|outcome| outcome.individuation))
}

/// Judges the claims of `hamana-population.toml` in their order; `None` stands for a claim that
/// cannot be judged. `postures` are those with one point and with two.
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
        is_selective.map(|all| all.iter().all(|value| *value > SELECTIVE)),
        ratio(torques.two, torques.one).map(|ratio| ratio > MORE),
        ratio(torques.two, torques.apart).map(|ratio| ratio > MORE),
        ratio(torques.apart, torques.one).map(|ratio| ALIKE.contains(&ratio)),
        ratio(torques.one, torques.one_isolated).map(|ratio| ALIKE.contains(&ratio)),
        Some(lower.unwrap_or(false)),
        Some(lost[1] < lost[0]),
    ]
}
