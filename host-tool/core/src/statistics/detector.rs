//! Detects movements in a sensor's signal, and computes the probability of false alarms.

use libm::erfc;
use std::f64::consts::SQRT_2;

/// Detector of movement in a sensor's signal, which is averaged over consecutive windows of time. A
/// movement is at least `consecutive` windows in a row, all on the same side of the baseline's
/// mean. Each of them must be further from it than `k_sigma` standard deviations of the baseline.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Detector {
    /// Number of windows in one presentation of a stimulus.
    pub windows: u32,
    /// Number of windows in the rest before a presentation, which serve as its baseline.
    pub baseline: u32,
    /// Distance from the baseline's mean that the windows must exceed, in standard deviations of
    /// the baseline's windows.
    pub k_sigma: f64,
    /// Number of consecutive windows that must all exceed the distance.
    pub consecutive: u32,
    /// Smallest movement that counts, in the sensor's unit, even if the signal has less noise.
    pub visible: f64,
    /// Resolution of the sensor, in its unit. The standard deviation of a baseline is taken to be
    /// at least resolution/√12, which is the rounding error of the sensor.
    pub resolution: f64,
}

/// Result of comparing the windows of a presentation with their baseline.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Verdict {
    /// Largest distance from the baseline's mean that all of `consecutive` windows in a row
    /// exceeded or reached, in the sensor's unit.
    pub deviation: f64,
    /// Distance above which a presentation counts as a movement, in the sensor's unit.
    pub bound: f64,
}

impl Verdict {
    /// Returns whether the signal moved: whether the distance is above the bound.
    #[must_use]
    pub fn is_movement(&self) -> bool {
        self.deviation > self.bound
    }
}

impl Detector {
    /// Compares the windows of a presentation with the windows of the `baseline` before it. Each
    /// value is the mean of the sensor's signal over one window. With fewer than `consecutive`
    /// windows, the result is no movement.
    #[must_use]
    pub fn judge(&self, baseline: &[f64], windows: &[f64]) -> Verdict {
        let n = baseline.len().max(2) as f64;
        let mean = baseline.iter().sum::<f64>() / n;
        let squares = baseline.iter().map(|x| (x - mean) * (x - mean));
        let sigma = (squares.sum::<f64>() / (n - 1.0)).sqrt();
        let sigma = sigma.max(self.resolution / 12_f64.sqrt());
        let lasting = |side: f64| {
            let runs = windows.windows(self.consecutive.max(1) as usize);
            runs.map(move |run| {
                let distances = run.iter().map(|x| side * (x - mean));
                distances.fold(f64::INFINITY, f64::min)
            })
        };
        Verdict {
            deviation: lasting(1.0).chain(lasting(-1.0)).fold(0.0, f64::max),
            bound: (self.k_sigma * sigma).max(self.visible),
        }
    }

    /// Returns an upper bound of the probability that a presentation without any movement counts as
    /// a movement. It assumes that the noise of the windows is normal and independent, and that
    /// [`Self::visible`] and [`Self::resolution`] are 0.
    ///
    /// All windows of a presentation are compared with the same estimates of the baseline's mean
    /// and standard deviation, so their errors are not independent. For n baseline windows, the
    /// mean m is normal with variance σ²/n, and (n−1)s²/σ² is χ² with n−1 degrees of freedom. A run
    /// of c windows exceeds the distance with probability E\[Q(m + k·s)^c\], where Q is the upper
    /// tail of the normal distribution. For c = 1 that is the upper tail of Student's t with n−1
    /// degrees of freedom at k/√(1 + 1/n). The probabilities of all runs, on both sides, are added
    /// up (Boole's inequality).
    #[must_use]
    pub fn false_alarm_probability(&self) -> f64 {
        let runs = (self.windows + 1).saturating_sub(self.consecutive);
        (2.0 * f64::from(runs) * self.run_probability()).min(1.0)
    }

    /// Returns E[Q(m + k·s)^c], the probability that one run of windows exceeds the distance; see
    /// [`Self::false_alarm_probability`]. It integrates over m and s by the trapezium rule, which
    /// is accurate because the densities and all their derivatives vanish at the ends.
    fn run_probability(&self) -> f64 {
        const POINTS: u32 = 400;
        let (n, c) = (f64::from(self.baseline), self.consecutive as i32);
        let nu = n - 1.0;
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in 1..POINTS {
            // The range of s is 0 to 1 + 8 of its standard deviations, each of them 1/√(2ν).
            let s = (1.0 + 8.0 / (2.0 * nu).sqrt()) * f64::from(i) / f64::from(POINTS);
            let chi = (nu - 1.0) * libm::log(s) - 0.5 * nu * (s * s - 1.0);
            for j in 0..=POINTS {
                let z = -8.0 + 16.0 * f64::from(j) / f64::from(POINTS);
                let weight = libm::exp(chi - 0.5 * z * z);
                let tail = 0.5 * erfc((z / n.sqrt() + self.k_sigma * s) / SQRT_2);
                sum += weight * tail.powi(c);
                weights += weight;
            }
        }
        sum / weights
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::random::standard_normal;

    fn detector(k_sigma: f64, consecutive: u32) -> Detector {
        Detector {
            windows: 5,
            baseline: 10,
            k_sigma,
            consecutive,
            visible: 0.0,
            resolution: 0.0,
        }
    }

    #[test]
    fn a_single_window_fails_as_student_says() {
        // Upper points of t with 9 degrees of freedom (any table): 1.833, 2.821, 3.250, 4.297.
        for (t, p) in [(1.833, 0.05), (2.821, 0.01), (3.250, 0.005), (4.297, 0.001)] {
            let beyond = detector(t * 1.1_f64.sqrt(), 1).run_probability();
            assert!((beyond / p - 1.0).abs() < 2e-3, "{t}: {beyond}");
        }
    }

    #[test]
    fn a_run_fails_as_often_as_drawn_ones_do() {
        for (k, c) in [(1.0, 2), (1.5, 2), (1.0, 3), (2.0, 3)] {
            let variant = Detector {
                windows: c,
                ..detector(k, c)
            };
            let draws = 40_000;
            let mut alarms = 0;
            for draw in 0..draws {
                let noise = |i: u64| standard_normal(77, draw * 16 + i);
                let baseline: Vec<f64> = (0..10).map(noise).collect();
                let windows: Vec<f64> = (10..10 + u64::from(c)).map(noise).collect();
                alarms += u64::from(variant.judge(&baseline, &windows).is_movement());
            }
            let (drawn, expected) = (
                alarms as f64 / draws as f64,
                variant.false_alarm_probability(),
            );
            let error = (expected / draws as f64).sqrt();
            assert!(
                (drawn - expected).abs() < 4.0 * error,
                "{k} {c}: {drawn} {expected}"
            );
        }
    }

    #[test]
    fn a_movement_lasts_and_has_one_side() {
        let baseline = [0.0, 0.2, -0.2, 0.1, -0.1, 0.0, 0.2, -0.2, 0.1, -0.1];
        let verdict = |windows: &[f64]| detector(4.0, 3).judge(&baseline, windows);
        assert!(verdict(&[0.0, 2.0, 2.1, 2.2, 0.0]).is_movement());
        assert!(verdict(&[-3.0, -2.0, -2.1, 0.0, 0.0]).is_movement());
        assert!(!verdict(&[2.0, 2.0, 0.0, 2.0, 2.0]).is_movement());
        assert!(!verdict(&[2.0, -2.0, 2.0, -2.0, 2.0]).is_movement());
        assert!(!verdict(&[5.0, 5.0]).is_movement());
        let visible = Detector {
            visible: 3.0,
            ..detector(4.0, 3)
        };
        assert!(!visible.judge(&baseline, &[2.0; 5]).is_movement());
        // A sensor that stands still is as quiet as its resolution allows.
        let coarse = Detector {
            resolution: 0.1,
            ..detector(4.0, 3)
        };
        assert!(!coarse.judge(&[1.0; 10], &[1.1; 5]).is_movement());
        assert!(coarse.judge(&[1.0; 10], &[1.2; 5]).is_movement());
    }
}
