//! How smoothly and how well a hand was moved: spectral arc length, matching error.

use super::motion_error::MotionError;
use std::f64::consts::TAU;

/// What the spectral arc length is taken with (Balasubramanian et al. 2015).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sparc {
    /// The spectrum has 2^(this + the next power of the samples) points.
    pub padding: u32,
    /// Beyond it nothing counts, Hz.
    pub cutoff_hz: f64,
    /// Ends of what counts: the first and the last part of the spectrum that reaches this
    /// part of its largest.
    pub threshold: f64,
}

impl Sparc {
    /// As its authors' own program has them.
    pub const USUAL: Self = Self {
        padding: 4,
        cutoff_hz: 10.0,
        threshold: 0.05,
    };

    /// The spectral arc length of a speed (not negative, any unit) sampled at `rate_hz`:
    /// below zero, and the smoother the movement the nearer to it. Of a speed no part of
    /// the spectrum is larger than that at 0 Hz, so only what lies up to the cutoff is
    /// computed.
    ///
    /// # Errors
    /// E763: fewer than two samples, a speed that is negative, not finite, or nothing but
    /// zero.
    pub fn of(&self, speed: &[f64], rate_hz: f64) -> Result<f64, MotionError> {
        let sum: f64 = speed.iter().sum();
        if speed.len() < 2 || !speed.iter().all(|it| *it >= 0.0) || !(sum > 0.0 && sum.is_finite())
        {
            return Err(MotionError::Speed(speed.len()));
        }
        let points = speed.len().next_power_of_two() << self.padding;
        let step_hz = rate_hz / points as f64;
        let last = ((self.cutoff_hz / step_hz).floor() as usize).min(points - 1);
        let size = |bin: usize| magnitude(speed, TAU * bin as f64 / points as f64) / sum;
        let sizes: Vec<f64> = (0..=last).map(size).collect();
        let reaches = |it: &f64| *it >= self.threshold;
        let last = sizes.iter().rposition(reaches).unwrap_or(0);
        if last == 0 {
            return Err(MotionError::Speed(speed.len()));
        }
        let along = 1.0 / last as f64;
        let piece = |pair: &[f64]| along.hypot(pair[1] - pair[0]);
        Ok(-sizes[..=last].windows(2).map(piece).sum::<f64>())
    }
}

/// |Σ x·e^(−i·angle·n)|, the turn made by a recurrence: for thousands of samples that
/// loses about their number of ε.
fn magnitude(samples: &[f64], angle: f64) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    let (mut re, mut im, mut turn) = (0.0, 0.0, (1.0, 0.0));
    for sample in samples {
        re += sample * turn.0;
        im += sample * turn.1;
        turn = (
            turn.0 * cosine - turn.1 * sine,
            turn.0 * sine + turn.1 * cosine,
        );
    }
    re.hypot(im)
}

/// Mean distance of where hands were from where they were meant to be, in the points' unit
/// (Buatier de Mongeot, equation 6). Nothing of nothing.
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

    /// The value that its authors' program prints (`siva82kb/SPARC`).
    #[test]
    fn the_authors_example_comes_out() {
        let speed = |n: i32| (-5.0 * (f64::from(n) * 0.01 - 1.0).powi(2)).exp();
        let speed: Vec<f64> = (0..200).map(speed).collect();
        let found = Sparc::USUAL.of(&speed, 100.0).unwrap();
        assert!((found - -1.414_03).abs() < 5e-6, "{found}");
    }

    #[test]
    fn two_bumps_are_less_smooth_than_one() {
        let bump = |t: f64, at: f64| (-20.0 * (t - at).powi(2)).exp();
        let of = |f: &dyn Fn(f64) -> f64| {
            let speed: Vec<f64> = (0..400).map(|n| f(f64::from(n) * 0.005)).collect();
            Sparc::USUAL.of(&speed, 200.0).unwrap()
        };
        let one = of(&|t| bump(t, 1.0));
        let two = of(&|t| bump(t, 0.6) + bump(t, 1.4));
        assert!(two < one - 0.1, "{two} {one}");
        assert!(Sparc::USUAL.of(&[0.0; 9], 200.0).is_err());
        assert!(Sparc::USUAL.of(&[1.0, -1.0, 1.0], 200.0).is_err());
    }

    #[test]
    fn the_matching_error_is_a_mean_of_distances() {
        let pairs = [([0.0, 3.0, 4.0], [0.0; 3]), ([1.0; 3], [1.0; 3])];
        assert_eq!(matching_error(&pairs), Some(2.5));
        assert_eq!(matching_error::<3>(&[]), None);
    }
}
