//! Smoothing by polynomials (Savitzky and Golay 1964), with the window chosen from a cutoff
//! frequency.

use super::motion_error::MotionError;
use nalgebra::DMatrix;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

/// Largest half width of a window, samples; a window has twice as many samples plus one.
const LONGEST: usize = 500;

/// Savitzky–Golay filter: it replaces each sample by the value of a polynomial that is fitted to
/// the samples in a window around it.
#[derive(Clone, Debug, PartialEq)]
pub struct SavitzkyGolay {
    half: usize,
    /// Weights of the filter, one row for each position in the window. The products of a row with
    /// the window's samples add up to the smoothed value at that position.
    rows: DMatrix<f64>,
    cutoff_hz: f64,
}

impl SavitzkyGolay {
    /// Creates a filter with polynomials of this order. Among the windows with an odd number of
    /// samples, chooses the one whose cutoff is nearest to `cutoff_hz`. The cutoff is the frequency
    /// at which half of the power remains in the middle of the window; it depends on window and
    /// order (Schafer 2011).
    ///
    /// # Errors
    /// E765: no window has such a cutoff.
    pub fn with_cutoff(order: usize, cutoff_hz: f64, rate_hz: f64) -> Result<Self, MotionError> {
        let refused = MotionError::Filter {
            order,
            cutoff_hz,
            rate_hz,
        };
        let mut best: Option<Self> = None;
        for half in order / 2 + 1..=LONGEST {
            let Some(savitzky_golay) = Self::with_half_window(order, half, rate_hz) else {
                return Err(refused);
            };
            let apart = (savitzky_golay.cutoff_hz - cutoff_hz).abs();
            if best
                .as_ref()
                .is_some_and(|best| (best.cutoff_hz - cutoff_hz).abs() < apart)
            {
                break;
            }
            best = Some(savitzky_golay);
        }
        best.filter(|savitzky_golay| savitzky_golay.half < LONGEST)
            .ok_or(refused)
    }

    fn with_half_window(order: usize, half: usize, rate_hz: f64) -> Option<Self> {
        let window = 2 * half + 1;
        let place = |row: usize| (row as f64 - half as f64) / half as f64;
        let powers = DMatrix::from_fn(window, order + 1, |row, power| {
            place(row).powi(power as i32)
        });
        let orthonormal = powers.qr().q();
        let rows = &orthonormal * orthonormal.transpose();
        let gain = |hz: f64| -> f64 {
            let turned = |n: usize| {
                rows[(half, n)] * libm::cos(TAU * hz / rate_hz * (n as f64 - half as f64))
            };
            (0..window).map(turned).sum()
        };
        let steps = 2000;
        let at = |n: i32| 0.5 * rate_hz * f64::from(n) / f64::from(steps);
        let cutoff_hz = (1..=steps).map(at).find(|hz| gain(*hz) <= FRAC_1_SQRT_2)?;
        Some(Self {
            half,
            rows,
            cutoff_hz,
        })
    }

    /// Returns the frequency at which half of the power remains, Hz; it is near the requested
    /// cutoff, but not equal to it.
    #[must_use]
    pub const fn cutoff_hz(&self) -> f64 {
        self.cutoff_hz
    }

    /// Returns the number of samples in the window, which is odd.
    #[must_use]
    pub const fn window(&self) -> usize {
        2 * self.half + 1
    }

    /// Smooths the samples. Near both ends of the signal, it uses the polynomials of the first and
    /// of the last whole window.
    ///
    /// # Errors
    /// E764: fewer samples than a window has.
    pub fn smooth(&self, samples: &[f64]) -> Result<Vec<f64>, MotionError> {
        let window = self.window();
        if samples.len() < window {
            return Err(MotionError::Short {
                samples: samples.len(),
                window,
            });
        }
        let last = samples.len() - window;
        let at = |n: usize| {
            let from = n.saturating_sub(self.half).min(last);
            let own = &samples[from..from + window];
            let row = self.rows.row(n - from);
            own.iter()
                .zip(row.iter())
                .map(|(x, weight)| x * weight)
                .sum()
        };
        Ok((0..samples.len()).map(at).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that a cubic is unchanged, ends included, and that a sine at the cutoff keeps half
    /// its power.
    #[test]
    fn cubics_stay_and_the_cutoff_is_where_it_says() {
        let filter = SavitzkyGolay::with_cutoff(3, 10.0, 200.0).unwrap();
        assert!(
            (filter.cutoff_hz() - 10.0).abs() < 0.4,
            "{}",
            filter.cutoff_hz()
        );
        let cubic = |n: i32| (f64::from(n) - 40.0).powi(3) * 1e-3 + f64::from(n);
        let cubic: Vec<f64> = (0..100).map(cubic).collect();
        for (found, meant) in filter.smooth(&cubic).unwrap().iter().zip(&cubic) {
            assert!((found - meant).abs() < 1e-9, "{found} {meant}");
        }
        let hz = filter.cutoff_hz();
        let sine: Vec<f64> = (0..401)
            .map(|n| libm::cos(TAU * hz * f64::from(n - 200) / 200.0))
            .collect();
        let kept = filter.smooth(&sine).unwrap()[200];
        assert!((kept - FRAC_1_SQRT_2).abs() < 0.01, "{kept}");
        assert!(filter.smooth(&sine[..5]).is_err());
    }
}
