//! The motor threshold by force: a search with a bound on false alarms, and the paper's rule.
//!
//! Amplitude rises by a step at a time; each is stimulated for a second with a second's rest
//! after it. The mean force of the train's plateau is held against a straight line through
//! the rest before and after (an offset that drifts steadily counts for nothing), in units of
//! its standard error. A step that shows is tried once more, and counts only if it shows
//! again: two errors would have to come together.

use super::average::averaged;
use super::error::IdentifyError;
use serde::{Deserialize, Serialize};

/// The paper's rule: "if the force … exceeds the threshold value (0.015 N)" (Lee 2020, §2.3.3,
/// step 3).
const PAPER_N: f64 = 0.015;

/// Where in a record of a try what is, samples of 1 ms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Rest before the first pulse.
    pub before: usize,
    /// From the first pulse on until force is a plateau.
    pub rise: usize,
    /// Length of the train.
    pub train: usize,
    /// From the train's end on until force has gone.
    pub decay: usize,
    /// All of it.
    pub samples: usize,
}

impl Default for Layout {
    /// 0.5 s of rest, a second's train that has risen after 0.3 s, 0.5 s of decay, 0.5 s of
    /// rest.
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

/// How a threshold is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Detector {
    /// Step, mA; above 0.
    pub step_ma: f64,
    /// Largest amplitude, mA.
    pub most_ma: f64,
    /// Probability that any step of a whole search shows without force; 0 to 1, exclusive.
    pub false_alarm: f64,
    /// Of each try.
    pub layout: Layout,
}

/// What a try showed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    /// What was tried, mA.
    pub ma: f64,
    /// Plateau less the line through the rest, N.
    pub force_n: f64,
    /// Its standard error, N.
    pub error_n: f64,
    /// Whether it is above what noise does.
    pub shows: bool,
}

/// A threshold and how it was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// I_MT, mA.
    pub threshold_ma: f64,
    /// Every try, in order.
    pub tries: Vec<Shown>,
}

impl Detector {
    /// In standard errors: what a try must show twice in a row.
    #[must_use]
    pub fn level(&self) -> f64 {
        let steps = (self.most_ma / self.step_ma).floor().max(1.0);
        // Both of two: the root of what a step may have.
        let each = (self.false_alarm / steps).sqrt();
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let above = 0.5 * libm::erfc(middle * std::f64::consts::FRAC_1_SQRT_2);
            match above > each {
                true => low = middle,
                false => high = middle,
            }
        }
        high
    }

    /// What samples of a try at `ma` show.
    #[must_use]
    pub fn judge(&self, ma: f64, samples_n: &[f64]) -> Shown {
        let Layout {
            before,
            rise,
            train,
            decay,
            ..
        } = self.layout;
        let over = |from: usize, to: usize| {
            let all = samples_n.iter().copied().enumerate();
            let own = all.skip(from).take(to.saturating_sub(from));
            own.map(|(place, value)| (place as f64, value))
                .collect::<Vec<_>>()
        };
        let mut rest = over(0, before);
        rest.extend(over(before + train + decay, samples_n.len()));
        let pulled = over(before + rise, before + train);
        let line = Line::through(&rest);
        let n = pulled.len().max(1) as f64;
        let middle = pulled.iter().map(|pair| pair.0).sum::<f64>() / n;
        let mean = pulled.iter().map(|pair| pair.1).sum::<f64>() / n;
        let (zero_n, part) = line.at(middle);
        let error_n = line.noise * (1.0 / n + part).sqrt();
        let force_n = mean - zero_n;
        Shown {
            ma,
            force_n,
            error_n,
            shows: force_n > self.level() * error_n,
        }
    }

    /// Tries step by step; `attempt` stimulates at an amplitude and gives its samples.
    ///
    /// # Errors
    /// E645 none up to the largest amplitude; whatever `attempt` says.
    pub fn search<E: From<IdentifyError>>(
        &self,
        mut attempt: impl FnMut(f64) -> Result<Vec<f64>, E>,
    ) -> Result<Found, E> {
        let steps = (self.most_ma / self.step_ma + 1e-9).floor() as u32;
        let mut tries = Vec::new();
        for step in 1..=steps {
            let ma = f64::from(step) * self.step_ma;
            let mut both = 0;
            while both < 2 {
                let shown = self.judge(ma, &attempt(ma)?);
                tries.push(shown);
                if !shown.shows {
                    break;
                }
                both += 1;
            }
            if both == 2 {
                return Ok(Found {
                    threshold_ma: ma,
                    tries,
                });
            }
        }
        let most_ma = self.most_ma;
        Err(IdentifyError::NoThreshold { most_ma }.into())
    }
}

/// A straight line through points, and what scatters about it.
struct Line {
    n: f64,
    middle: f64,
    mean: f64,
    slope: f64,
    square: f64,
    noise: f64,
}

impl Line {
    fn through(points: &[(f64, f64)]) -> Self {
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

    /// Its value, and the variance of that for noise of 1.
    fn at(&self, x: f64) -> (f64, f64) {
        let away = x - self.middle;
        let part = 1.0 / self.n + away * away / self.square.max(1e-300);
        (self.mean + self.slope * away, part)
    }
}

/// The paper's bare rule on samples of a try: whether any 40 ms mean from the first pulse
/// to the train's end exceeds the mean of the rest before by 0.015 N.
#[must_use]
pub fn bare_rule(samples_n: &[f64], layout: &Layout) -> bool {
    let rest = layout.before.min(samples_n.len());
    let zero_n = samples_n.iter().take(rest).sum::<f64>() / rest.max(1) as f64;
    let train = samples_n.iter().skip(rest).take(layout.train);
    let train: Vec<f64> = train.map(|train| train - zero_n).collect();
    averaged(&train).iter().any(|value| *value > PAPER_N)
}

/// # Errors
/// E642 if amplitudes, lowest first, do not rise.
pub fn in_order(amplitudes: &[(&'static str, f64)]) -> Result<(), IdentifyError> {
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

    /// Noise of 0.05 N that drifts by 20 mN/s, and `force_n` during the train.
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
        let each = 0.5 * libm::erfc(detector().level() / std::f64::consts::SQRT_2);
        assert!((60.0 * each * each / 0.005 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn drift_is_no_force() {
        let shown: usize = (0..400)
            .filter(|seed| detector().judge(1.0, &tried(*seed, 0.0)).shows)
            .count();
        // One try in 110 by chance; both of two must show.
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
        let wrong = in_order(&[("I_MT", 9.0), ("I_PT", 8.0)]).unwrap_err();
        assert!(
            wrong.to_string().contains("I_PT must be above I_MT"),
            "{wrong}"
        );
        assert!(in_order(&[("I_MT", 8.0), ("I_PT", 12.0)]).is_ok());
    }
}
