//! Measures of how smoothly and how accurately a hand was moved: spectral arc length and matching
//! error.

use super::motion_error::MotionError;
use std::f64::consts::TAU;

/// Parameters of the spectral arc length (Balasubramanian et al. 2015).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sparc {
    /// Padding exponent p: the spectrum has 2^p times as many points as the smallest power of two
    /// that is not below the number of samples.
    pub padding: u32,
    /// Highest frequency of the spectrum that is considered, Hz.
    pub cutoff_hz: f64,
    /// Threshold, as a share of the spectrum's largest value. The arc runs from the first to the
    /// last frequency at which the spectrum reaches this share.
    pub threshold: f64,
}

impl Sparc {
    /// Default parameters of the authors' own program.
    pub const USUAL: Self = Self {
        padding: 4,
        cutoff_hz: 10.0,
        threshold: 0.05,
    };

    /// Returns the spectral arc length of a speed (not negative, any unit) sampled at `rate_hz`.
    /// The result is below zero; the nearer it is to zero, the smoother the movement. The spectrum
    /// is computed only up to the cutoff: it is normalized by its largest value, which for a speed
    /// is always at 0 Hz.
    ///
    /// # Errors
    /// E763: fewer than two samples, a speed that is negative, not finite, or nothing but zero.
    pub fn arc_length(&self, speed: &[f64], rate_hz: f64) -> Result<f64, MotionError> {
        let sum: f64 = speed.iter().sum();
        if speed.len() < 2
            || !speed.iter().all(|speed| *speed >= 0.0)
            || !(sum > 0.0 && sum.is_finite())
        {
            return Err(MotionError::Speed(speed.len()));
        }
        let points = speed.len().next_power_of_two() << self.padding;
        let step_hz = rate_hz / points as f64;
        let last = ((self.cutoff_hz / step_hz).floor() as usize).min(points - 1);
        let angle = |bin: usize| TAU * bin as f64 / points as f64;
        let mut sizes: Vec<f64> = (0..=last)
            .step_by(AT_ONCE)
            .flat_map(|from| magnitudes(speed, std::array::from_fn(|n| angle(from + n))))
            .map(|size| size / sum)
            .collect();
        sizes.truncate(last + 1);
        let reaches = |value: &f64| *value >= self.threshold;
        let last = sizes.iter().rposition(reaches).unwrap_or(0);
        if last == 0 {
            return Err(MotionError::Speed(speed.len()));
        }
        let along = 1.0 / last as f64;
        let piece = |pair: &[f64]| libm::hypot(along, pair[1] - pair[0]);
        Ok(-sizes[..=last].windows(2).map(piece).sum::<f64>())
    }
}

/// Number of frequencies whose recurrences are computed together. The steps of a single recurrence
/// depend on each other, so that a processor would have to wait for each result.
const AT_ONCE: usize = 8;

/// Returns the magnitude |Σ x·e^(−i·angle·n)| of the samples' spectrum at each angle (rad per
/// sample), by Goertzel's recurrence (1958). For N samples its error is about N²·ε of the largest
/// value, which is 1e-10 for a lift movement.
fn magnitudes(samples: &[f64], angles: [f64; AT_ONCE]) -> [f64; AT_ONCE] {
    let cosines = angles.map(libm::cos);
    let (mut last, mut before) = ([0.0; AT_ONCE], [0.0; AT_ONCE]);
    for sample in samples {
        for n in 0..AT_ONCE {
            let next = sample + 2.0 * cosines[n] * last[n] - before[n];
            (before[n], last[n]) = (last[n], next);
        }
    }
    std::array::from_fn(|n| {
        let square = last[n] * last[n] + before[n] * before[n];
        (square - 2.0 * cosines[n] * last[n] * before[n])
            .max(0.0)
            .sqrt()
    })
}

/// Returns the mean distance between the actual and the target positions of the hands, in the unit
/// of the points (Buatier de Mongeot, equation 6). Each pair has the actual and the target
/// position; `None` without pairs.
#[must_use]
pub fn matching_error<const D: usize>(pairs: &[([f64; D], [f64; D])]) -> Option<f64> {
    let apart = |(at, target): &([f64; D], [f64; D])| {
        let squares = at.iter().zip(target).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    (!pairs.is_empty()).then(|| pairs.iter().map(apart).sum::<f64>() / pairs.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the value that the authors' program prints (`siva82kb/SPARC`).
    #[test]
    fn the_authors_example_comes_out() {
        let speed = |n: i32| libm::exp(-5.0 * (f64::from(n) * 0.01 - 1.0).powi(2));
        let speed: Vec<f64> = (0..200).map(speed).collect();
        let found = Sparc::USUAL.arc_length(&speed, 100.0).unwrap();
        assert!((found - -1.414_03).abs() < 5e-6, "{found}");
    }

    #[test]
    fn two_bumps_are_less_smooth_than_one() {
        let bump = |t: f64, at: f64| libm::exp(-20.0 * (t - at).powi(2));
        let smoothness = |f: &dyn Fn(f64) -> f64| {
            let speed: Vec<f64> = (0..400).map(|n| f(f64::from(n) * 0.005)).collect();
            Sparc::USUAL.arc_length(&speed, 200.0).unwrap()
        };
        let single_bump = smoothness(&|t| bump(t, 1.0));
        let two = smoothness(&|t| bump(t, 0.6) + bump(t, 1.4));
        assert!(two < single_bump - 0.1, "{two} {single_bump}");
        assert!(Sparc::USUAL.arc_length(&[0.0; 9], 200.0).is_err());
        assert!(Sparc::USUAL.arc_length(&[1.0, -1.0, 1.0], 200.0).is_err());
    }

    #[test]
    fn the_matching_error_is_a_mean_of_distances() {
        let pairs = [([0.0, 3.0, 4.0], [0.0; 3]), ([1.0; 3], [1.0; 3])];
        assert_eq!(matching_error(&pairs), Some(2.5));
        assert_eq!(matching_error::<3>(&[]), None);
    }
}
