//! The best possible result with a plant: one amplitude for each pulse, chosen offline with full
//! knowledge of the plant, without noise, inside the same limits.
//!
//! Damped Gauss-Newton on the true plant (norm-optimal iterative learning: Bristow, Tharayil &
//! Alleyne 2006). Each round runs the plant, compares its angle with the reference period by
//! period, and corrects the efforts by means of the plant's own response to one pulse; a correction
//! that does not help is undone. Learning starts from the efforts that would hold each angle, and
//! from those of the best law under test, so that the optimum is never worse than that law.

use super::TrackingError;
use super::plant::Plant;
use super::reach::volts_at;
use super::trial::{PULSE_EVERY_MS, pulse, rmse};
use super::wearer::{self, Points};
use firmware::control::Mapping;
use hal_sim::body::{Body, RandomFinger, RandomFingerSpec};

/// Number of pulse periods for which the effect of one pulse on the angle is followed: 1.2 s.
const MEMORY: usize = 60;
/// Approximate duration of delay and muscle response, in pulse periods. One of the starts of
/// learning anticipates the reference by this time.
const MUSCLE_PERIODS: usize = 10;
/// Largest number of learning rounds from each start.
const ROUNDS: u32 = 20;
/// Number of successive rounds that improve the cost by less than a hundredth, after which learning
/// ends.
const PATIENCE: u32 = 4;
/// Smallest slope of torque over effort that learning uses, as a fraction of the mean slope. It
/// prevents learning from getting stuck below a threshold, where the true slope is 0.
const LEAST_SLOPE: f64 = 0.3;

/// The best offline result that was found for a plant.
#[derive(Clone, PartialEq, Debug)]
pub struct Optimum {
    /// RMSE from the target over the scored time, °.
    pub rmse: f64,
    /// True angle at each millisecond, °.
    pub angles: Vec<f32>,
}

/// Searches the efforts with which this plant follows `target` best. `target` is the reachable
/// reference, one angle per millisecond. Learning starts three times from efforts computed from the
/// plant, and once from the efforts `known`, one per pulse from −1 to 1, if they are given.
///
/// # Errors
/// Fails if the plant's finger is invalid.
pub fn optimum(
    plant: &Plant,
    points: Points,
    target: &[f64],
    known: Option<Vec<f64>>,
) -> Result<Optimum, TrackingError> {
    let mapping = wearer::mapping(points)?;
    let play = |efforts: &[f64]| run(&plant.finger, &mapping, efforts, target.len());
    let torques = Torques::new(&plant.finger, &mapping);
    let wanted = by_period(target.iter().copied());
    let middle = wanted.iter().sum::<f64>() / wanted.len() as f64;
    let learner = Learner {
        kernel: kernel(
            &plant.finger,
            &mapping,
            torques.around(spring(&plant.finger, middle)),
        )?,
        wanted,
        torques,
    };
    let mut found = Vec::new();
    let friction = plant.finger.static_friction_nm;
    for (friction_nm, ahead) in [(0.0, 0), (friction, 0), (friction, MUSCLE_PERIODS)] {
        let first = learner.initial_efforts(&plant.finger, friction_nm, ahead);
        found.push(learn(&learner, &play, first, target)?);
    }
    if let Some(known) = known {
        found.push(learn(&learner, &play, known, target)?);
    }
    found.sort_by(|a, b| a.rmse.total_cmp(&b.rmse));
    Ok(found.swap_remove(0))
}

/// Learns from the given first efforts for at most [`ROUNDS`] rounds, and returns the best result
/// over the scored time. Learning itself uses the whole trial.
fn learn(
    learner: &Learner,
    play: &impl Fn(&[f64]) -> Result<Vec<f32>, TrackingError>,
    mut efforts: Vec<f64>,
    target: &[f64],
) -> Result<Optimum, TrackingError> {
    let mut angles = play(&efforts)?;
    let mut cost = learner.cost(&angles);
    let mut best = Optimum {
        rmse: rmse(&angles, target),
        angles: angles.clone(),
    };
    let mut damping = 0.1;
    let mut failures = 0;
    for _ in 0..ROUNDS {
        let tried = learner.correct_efforts(&efforts, &angles, damping);
        let after = play(&tried)?;
        let now = learner.cost(&after);
        let scored = rmse(&after, target);
        if scored < best.rmse {
            best = Optimum {
                rmse: scored,
                angles: after.clone(),
            };
        }
        failures = if now < 0.99 * cost { 0 } else { failures + 1 };
        if now < cost {
            (cost, efforts, angles) = (now, tried, after);
            damping = (damping * 0.4_f64).max(1e-5);
        } else {
            damping *= 6.0;
        }
        if failures == PATIENCE {
            break;
        }
    }
    Ok(best)
}

/// Simulates the plant with these efforts, one per pulse, for `ms` milliseconds, and returns the
/// true angle at each millisecond, °.
fn run(
    spec: &RandomFingerSpec,
    mapping: &Mapping,
    efforts: &[f64],
    ms: usize,
) -> Result<Vec<f32>, TrackingError> {
    let mut finger = RandomFinger::new(spec.clone(), 0)?;
    let mut angles = Vec::with_capacity(ms);
    for n in 0..ms {
        let now_us = n as u64 * 1000;
        if n % PULSE_EVERY_MS == 0 {
            let effort = efforts.get(n / PULSE_EVERY_MS).copied().unwrap_or(0.0);
            pulse(&mut finger, now_us, volts_at(mapping, effort));
        }
        finger.advance(now_us + 1000);
        angles.push(finger.angle_deg() as f32);
    }
    Ok(angles)
}

/// Returns the mean of the angles in each pulse period; `angles` has one per millisecond.
fn by_period(angles: impl Iterator<Item = f64>) -> Vec<f64> {
    let samples: Vec<f64> = angles.collect();
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    samples.chunks(PULSE_EVERY_MS).map(mean).collect()
}

/// Returns how one pulse with 1 N·m more steady torque changes the mean angle of its own and of
/// each following period, °. It is measured on the plant without dry friction, by changing one
/// pulse from effort `from` to effort `to`, whose torques differ by `more` N·m.
fn kernel(
    spec: &RandomFingerSpec,
    mapping: &Mapping,
    (from, to, more): (f64, f64, f64),
) -> Result<Vec<f64>, TrackingError> {
    let smooth = RandomFingerSpec {
        static_friction_nm: 0.0,
        coulomb_friction_nm: 0.0,
        ..spec.clone()
    };
    const SETTLED: usize = 150;
    let ms = (SETTLED + MEMORY) * PULSE_EVERY_MS;
    let mut efforts = vec![from; SETTLED + MEMORY];
    let before = run(&smooth, mapping, &efforts, ms)?;
    efforts[SETTLED] = to;
    let after = run(&smooth, mapping, &efforts, ms)?;
    let change = before.iter().zip(&after).map(|(b, a)| f64::from(a - b));
    // If nothing moves the wearer, nothing can be learned.
    let scale = if more > 1e-9 { 1.0 / more } else { 0.0 };
    Ok(by_period(change)[SETTLED..]
        .iter()
        .map(|c| c * scale)
        .collect())
}

/// Returns the torque of the joint's spring at this angle, N·m.
fn spring(spec: &RandomFingerSpec, degrees: f64) -> f64 {
    spec.finger.stiffness_nm_per_rad * (degrees - spec.finger.rest_deg).to_radians()
}

/// Steady torque, N·m, at equally spaced efforts from −1 to 1, with the joint half way through its
/// range.
struct Torques(Vec<f64>);

impl Torques {
    const STEPS: usize = 100;
    const WIDTH: f64 = 2.0 / Self::STEPS as f64;

    fn new(spec: &RandomFingerSpec, mapping: &Mapping) -> Self {
        let at = |n| spec.steady_torque_nm(volts_at(mapping, Self::effort(n)), 45.0);
        Self((0..=Self::STEPS).map(at).collect())
    }

    fn effort(n: usize) -> f64 {
        n as f64 * Self::WIDTH - 1.0
    }

    /// Returns the slope of torque over effort at this effort, N·m, and at least [`LEAST_SLOPE`] of
    /// the mean slope.
    fn slope(&self, effort: f64) -> f64 {
        let place = ((effort + 1.0) / Self::WIDTH) as usize;
        let n = place.min(Self::STEPS - 1);
        let mean_slope = (self.0[Self::STEPS] - self.0[0]) / 2.0;
        ((self.0[n + 1] - self.0[n]) / Self::WIDTH).max(LEAST_SLOPE * mean_slope)
    }

    /// Returns two efforts around the one for this torque, whose torques differ by about a
    /// thirtieth of the whole range, and that difference, N·m.
    fn around(&self, torque_nm: f64) -> (f64, f64, f64) {
        let range_nm = self.0[Self::STEPS] - self.0[0];
        let low = self.0.partition_point(|t| *t < torque_nm).saturating_sub(1);
        let higher = |t: &f64| *t < self.0[low] + range_nm / 30.0;
        let high = self.0.partition_point(higher).min(Self::STEPS);
        let more = self.0[high] - self.0[low];
        (Self::effort(low), Self::effort(high), more)
    }

    /// Returns the smallest effort that gives at least this torque; 1 if none does.
    fn effort_for(&self, torque_nm: f64) -> f64 {
        Self::effort(self.0.partition_point(|t| *t < torque_nm).min(Self::STEPS))
    }
}

struct Learner {
    kernel: Vec<f64>,
    torques: Torques,
    wanted: Vec<f64>,
}

impl Learner {
    /// Returns efforts from which learning starts: those that would hold each angle of the
    /// reference against the spring and against `friction_nm`, `ahead` pulse periods early.
    fn initial_efforts(&self, spec: &RandomFingerSpec, friction_nm: f64, ahead: usize) -> Vec<f64> {
        let last = self.wanted.len() - 1;
        let wanted = |n: usize| self.wanted[(n + ahead).min(last)];
        let held = (0..=last).map(|n| {
            let rising = (wanted(n + 1) - wanted(n)).signum();
            let torque = spring(spec, wanted(n)) + rising * friction_nm;
            self.torques.effort_for(torque)
        });
        held.collect()
    }

    fn errors(&self, angles: &[f32]) -> Vec<f64> {
        let reached = by_period(angles.iter().map(|a| f64::from(*a)));
        self.wanted
            .iter()
            .zip(reached)
            .map(|(w, r)| w - r)
            .collect()
    }

    fn cost(&self, angles: &[f32]) -> f64 {
        self.errors(angles).iter().map(|e| e * e).sum()
    }

    /// Returns the efforts after one damped Gauss-Newton step from the errors of these angles.
    fn correct_efforts(&self, efforts: &[f64], angles: &[f32], damping: f64) -> Vec<f64> {
        let errors = self.errors(angles);
        // Gradient of each effort: the errors correlated with the kernel.
        let gain = |n: usize| -> f64 {
            let later = errors[n..].iter().zip(&self.kernel);
            later.map(|(e, k)| e * k).sum::<f64>() * self.torques.slope(efforts[n])
        };
        let gradient: Vec<f64> = (0..efforts.len()).map(gain).collect();
        // An effort at a limit that would exceed it is left out of this round.
        let slopes: Vec<f64> = (efforts.iter().zip(&gradient))
            .map(|(e, g)| {
                let is_held = (*e >= 1.0 && *g > 0.0) || (*e <= -1.0 && *g < 0.0);
                if is_held { 0.0 } else { self.torques.slope(*e) }
            })
            .collect();
        let right = gradient
            .iter()
            .zip(&slopes)
            .map(|(g, s)| if *s > 0.0 { *g } else { 0.0 });
        let step = self
            .normal_equations(&slopes, damping)
            .solve(right.collect());
        let moved = efforts
            .iter()
            .zip(step)
            .map(|(e, s)| (e + s).clamp(-1.0, 1.0));
        moved.collect()
    }

    /// Returns the matrix S·HᵀH·S + damping of the Gauss-Newton step, where S contains the slopes
    /// and H is the Toeplitz matrix of the kernel. HᵀH is itself Toeplitz except for its last rows,
    /// where the trial ends. Treating these alike only shortens the last steps.
    fn normal_equations(&self, slopes: &[f64], damping: f64) -> Banded {
        let correlation: Vec<f64> = (0..MEMORY)
            .map(|lag| {
                let shifted = self.kernel.iter().skip(lag);
                self.kernel.iter().zip(shifted).map(|(a, b)| a * b).sum()
            })
            .collect();
        let typical = slopes.iter().map(|s| s * s).sum::<f64>() / slopes.len() as f64;
        let floor = damping * correlation[0] * typical + 1e-12;
        let rows = (0..slopes.len()).map(|row| {
            let lags = correlation.iter().enumerate().take(row + 1);
            let mut entries: Vec<f64> = lags
                .map(|(lag, c)| c * slopes[row] * slopes[row - lag])
                .collect();
            entries[0] += floor;
            entries
        });
        Banded {
            rows: rows.collect(),
        }
    }
}

/// A symmetric positive definite band matrix. Each row contains the entries from the diagonal to
/// the left edge of the band.
struct Banded {
    rows: Vec<Vec<f64>>,
}

impl Banded {
    /// Solves the linear system with this right-hand side, by Cholesky decomposition within the
    /// band.
    fn solve(mut self, mut right: Vec<f64>) -> Vec<f64> {
        for row in 0..self.rows.len() {
            let (done, rest) = self.rows.split_at_mut(row);
            let entries = &mut rest[0];
            for lag in (1..entries.len()).rev() {
                let other = &done[row - lag];
                let pairs = entries[lag + 1..].iter().zip(&other[1..]);
                let sum: f64 = pairs.map(|(a, b)| a * b).sum();
                entries[lag] = (entries[lag] - sum) / other[0];
            }
            let sum: f64 = entries[1..].iter().map(|e| e * e).sum();
            entries[0] = (entries[0] - sum).sqrt();
            let before = entries[1..].iter().enumerate();
            let sum: f64 = before.map(|(i, e)| e * right[row - 1 - i]).sum();
            right[row] = (right[row] - sum) / entries[0];
        }
        for row in (0..self.rows.len()).rev() {
            let entries = &self.rows[row];
            right[row] /= entries[0];
            let solved = right[row];
            for (i, e) in entries[1..].iter().enumerate() {
                right[row - 1 - i] -= e * solved;
            }
        }
        right
    }
}

#[cfg(test)]
mod tests {
    use super::Banded;

    #[test]
    fn a_banded_system_is_solved() {
        // 4 on the diagonal, 1 and 0.5 beside it; solution 1, 2, … 6.
        let rows = (0..6).map(|row| [4.0, 1.0, 0.5][..(row + 1).min(3)].to_vec());
        let rows: Vec<Vec<f64>> = rows.collect();
        let entry = |i: usize, j: usize| [4.0, 1.0, 0.5].get(i.abs_diff(j)).copied().unwrap_or(0.0);
        let right = (0..6).map(|i| (0..6).map(|j| entry(i, j) * (j + 1) as f64).sum());
        let solution = Banded { rows }.solve(right.collect());
        for (i, x) in solution.iter().enumerate() {
            assert!((x - (i + 1) as f64).abs() < 1e-12, "{solution:?}");
        }
    }
}
