//! Finds the motor threshold from force, by a search with a bound on false alarms, and by the
//! paper's rule.
//!
//! Amplitude rises one step at a time; each amplitude is stimulated for a second, with a second's
//! rest after it. The mean force of the train's plateau is compared with a straight line through
//! the rest before and after (an offset that drifts steadily does not count), in units of its
//! standard error. A step that shows force is tried once more, and counts only if it shows force
//! again: two errors would have to coincide.

use super::average::moving_average;
use super::error::IdentifyError;
use serde::{Deserialize, Serialize};

/// Force above which the paper's rule counts a contraction, N: "if the force … exceeds the
/// threshold value (0.015 N)" (Lee 2020, §2.3.3, step 3).
const PAPER_N: f64 = 0.015;

/// Times within the record of one try (a train at one amplitude), in samples of 1 ms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Time without stimulation before the first pulse.
    pub before: usize,
    /// Time from the first pulse until force has reached its plateau.
    pub rise: usize,
    /// Length of the train.
    pub train: usize,
    /// Time from the train's end until force has decayed.
    pub decay: usize,
    /// Length of the whole record, from the time before the train to the time after the decay.
    pub samples: usize,
}

impl Default for Layout {
    /// Returns the default times: 0.5 s without stimulation, a train of 1 s in which the force
    /// reaches its plateau after 0.3 s, 0.5 s of decay, and 0.5 s without stimulation.
    fn default() -> Self {
        Self {
            before: 500,
            rise: 300,
            train: 1_000,
            decay: 500,
            samples: 2_500,
        }
    }
}

/// Parameters of a search for the motor threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detector {
    /// Difference between one amplitude of the search and the next, mA; above 0.
    pub step_ma: f64,
    /// Largest amplitude that the search tries, mA.
    pub most_ma: f64,
    /// Accepted probability of a false alarm in a whole search, between 0 and 1, exclusive: that
    /// the search reports a threshold although the muscle exerts no force at any amplitude.
    pub false_alarm: f64,
    /// Times within the record of each try.
    pub layout: Layout,
}

/// Force that one try of the search evoked, and whether it stands out from noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TryResult {
    /// Amplitude that was tried, mA.
    pub ma: f64,
    /// Mean force on the plateau of the train, N, above the straight line through the samples
    /// without stimulation before and after.
    pub force_n: f64,
    /// Standard error of `force_n`, N.
    pub error_n: f64,
    /// Whether `force_n` exceeds [`Detector::level`], so that it is unlikely to be noise.
    pub shows: bool,
}

/// Motor threshold, and the tries that led to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ThresholdEstimate {
    /// Motor threshold I_MT, mA: the first amplitude at which two tries in a row show force.
    pub threshold_ma: f64,
    /// All tries of the search, from the first to the last.
    pub tries: Vec<TryResult>,
}

impl Detector {
    /// Returns the force that each of two successive tries must exceed, in standard errors of the
    /// try. It follows from the accepted probability of a false alarm.
    #[must_use]
    pub fn level(&self) -> f64 {
        let steps = (self.most_ma / self.step_ma).floor().max(1.0);
        // Both of two tries must exceed it, so each may have the root of a step's probability.
        let probability = (self.false_alarm / steps).sqrt();
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let above = 0.5 * libm::erfc(middle * std::f64::consts::FRAC_1_SQRT_2);
            match above > probability {
                true => low = middle,
                false => high = middle,
            }
        }
        high
    }

    /// Computes the force of a try at the amplitude `ma` from its samples, and decides whether it
    /// stands out from noise.
    #[must_use]
    pub fn judge(&self, ma: f64, samples_n: &[f64]) -> TryResult {
        let Layout {
            before,
            rise,
            train,
            decay,
            ..
        } = self.layout;
        let over = |from: usize, to: usize| {
            let samples = samples_n.iter().copied().enumerate();
            let own = samples.skip(from).take(to.saturating_sub(from));
            own.map(|(place, value)| (place as f64, value))
                .collect::<Vec<_>>()
        };
        let mut rest = over(0, before);
        rest.extend(over(before + train + decay, samples_n.len()));
        let pulled = over(before + rise, before + train);
        let line = Line::fit(&rest);
        let n = pulled.len().max(1) as f64;
        let middle = pulled.iter().map(|pair| pair.0).sum::<f64>() / n;
        let mean = pulled.iter().map(|pair| pair.1).sum::<f64>() / n;
        let (zero_n, part) = line.at(middle);
        let error_n = line.noise * (1.0 / n + part).sqrt();
        let force_n = mean - zero_n;
        TryResult {
            ma,
            force_n,
            error_n,
            shows: force_n > self.level() * error_n,
        }
    }

    /// Searches the motor threshold from the smallest amplitude upward. `attempt` stimulates at an
    /// amplitude, in mA, and returns the force samples, in N.
    ///
    /// # Errors
    /// E645: no threshold up to the largest amplitude. Errors of `attempt` are returned unchanged.
    pub fn search<E: From<IdentifyError>>(
        &self,
        mut attempt: impl FnMut(f64) -> Result<Vec<f64>, E>,
    ) -> Result<ThresholdEstimate, E> {
        let steps = (self.most_ma / self.step_ma + 1e-9).floor() as u32;
        let mut tries = Vec::new();
        for step in 1..=steps {
            let ma = f64::from(step) * self.step_ma;
            let mut hits = 0;
            while hits < 2 {
                let shown = self.judge(ma, &attempt(ma)?);
                tries.push(shown);
                if !shown.shows {
                    break;
                }
                hits += 1;
            }
            if hits == 2 {
                return Ok(ThresholdEstimate {
                    threshold_ma: ma,
                    tries,
                });
            }
        }
        let most_ma = self.most_ma;
        Err(IdentifyError::NoThreshold { most_ma }.into())
    }
}

/// Straight line fitted to points, and the scatter of the points about it.
struct Line {
    n: f64,
    middle: f64,
    mean: f64,
    slope: f64,
    square: f64,
    noise: f64,
}

impl Line {
    fn fit(points: &[(f64, f64)]) -> Self {
        let n = points.len().max(1) as f64;
        let middle = points.iter().map(|point| point.0).sum::<f64>() / n;
        let mean = points.iter().map(|point| point.1).sum::<f64>() / n;
        let square = points
            .iter()
            .map(|point| (point.0 - middle).powi(2))
            .sum::<f64>();
        let across = points
            .iter()
            .map(|point| (point.0 - middle) * (point.1 - mean));
        let slope = across.sum::<f64>() / square.max(1e-300);
        let off = |pair: &(f64, f64)| (pair.1 - mean - slope * (pair.0 - middle)).powi(2);
        let noise = (points.iter().map(off).sum::<f64>() / (n - 2.0).max(1.0)).sqrt();
        Self {
            n,
            middle,
            mean,
            slope,
            square,
            noise,
        }
    }

    /// Returns the line's value at `x`, and the variance of this value if the points have a
    /// variance of 1.
    fn at(&self, x: f64) -> (f64, f64) {
        let away = x - self.middle;
        let part = 1.0 / self.n + away * away / self.square.max(1e-300);
        (self.mean + self.slope * away, part)
    }
}

/// Applies the paper's rule to the samples of a try: returns whether the mean over any 40 ms of the
/// train exceeds the mean before the train by 0.015 N.
#[must_use]
pub fn bare_rule(samples_n: &[f64], layout: &Layout) -> bool {
    let rest = layout.before.min(samples_n.len());
    let zero_n = samples_n.iter().take(rest).sum::<f64>() / rest.max(1) as f64;
    let train = samples_n.iter().skip(rest).take(layout.train);
    let train: Vec<f64> = train.map(|train| train - zero_n).collect();
    moving_average(&train).iter().any(|value| *value > PAPER_N)
}

/// Checks that each amplitude, mA, is above 0 and above the amplitude before it. Each comes with
/// its name for messages.
///
/// # Errors
/// E642: an amplitude does not exceed the amplitude before it.
pub fn check_rising(amplitudes: &[(&'static str, f64)]) -> Result<(), IdentifyError> {
    for pair in amplitudes.windows(2) {
        let [(lower, low), (upper, high)] = [pair[0], pair[1]];
        if !(low > 0.0 && high > low) {
            return Err(IdentifyError::OutOfOrder {
                lower,
                low,
                upper,
                high,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::random::standard_normal;

    fn detector() -> Detector {
        Detector {
            step_ma: 0.5,
            most_ma: 30.0,
            false_alarm: 0.005,
            layout: Layout::default(),
        }
    }

    /// Returns noise of 0.05 N that drifts by 20 mN/s, plus `force_n` during the train.
    fn tried(seed: u64, force_n: f64) -> Vec<f64> {
        let sample = |i: u64| {
            let pulled = if (500..1_500).contains(&i) {
                force_n
            } else {
                0.0
            };
            pulled + 0.05 * standard_normal(seed, i) + 20e-6 * i as f64
        };
        (0..2_500).map(sample).collect()
    }

    #[test]
    fn the_level_keeps_the_bound_over_the_whole_search() {
        let probability = 0.5 * libm::erfc(detector().level() / std::f64::consts::SQRT_2);
        assert!((60.0 * probability * probability / 0.005 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn drift_is_no_force() {
        let shown: usize = (0..400)
            .filter(|seed| detector().judge(1.0, &tried(*seed, 0.0)).shows)
            .count();
        // One try in 110 exceeds the level by chance; the search needs both of two.
        assert!(shown <= 12, "{shown}");
        assert!((0..100).all(|seed| detector().judge(1.0, &tried(seed, 0.015)).shows));
    }

    #[test]
    fn a_search_ends_at_the_first_amplitude_that_moves() {
        let mut seed = 0;
        let found = detector().search(|ma| {
            seed += 1;
            Ok::<_, IdentifyError>(tried(seed, if ma >= 6.0 { 0.03 } else { 0.0 }))
        });
        assert_eq!(found.unwrap().threshold_ma, 6.0);
        let none = detector().search(|_| Ok::<_, IdentifyError>(tried(1, 0.0)));
        assert!(none.unwrap_err().to_string().starts_with("E645"));
    }

    #[test]
    fn the_bare_rule_hears_noise() {
        let layout = Layout::default();
        let count = |drift: bool| {
            let own = |seed| {
                let mut samples = tried(seed, 0.0);
                let still = samples.iter_mut().enumerate();
                still.for_each(|(i, value)| *value -= if drift { 0.0 } else { 20e-6 * i as f64 });
                bare_rule(&samples, &layout)
            };
            (0..200).filter(|seed| own(*seed)).count()
        };
        assert!(count(false) > 50, "{}", count(false));
        assert!(count(true) >= count(false));
    }

    #[test]
    fn amplitudes_out_of_order_are_named() {
        let wrong = check_rising(&[("I_MT", 9.0), ("I_PT", 8.0)]).unwrap_err();
        assert!(
            wrong.to_string().contains("I_PT must be above I_MT"),
            "{wrong}"
        );
        assert!(check_rising(&[("I_MT", 8.0), ("I_PT", 12.0)]).is_ok());
    }
}
