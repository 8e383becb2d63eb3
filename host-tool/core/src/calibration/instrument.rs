//! Judges from the instrument of the test rig whether a presentation moved anything.

use super::CalibrationError;
use crate::statistics::Detector;
use serde::Serialize;
use std::collections::VecDeque;

/// Time between two readings of the instrument, µs.
pub const READ_US: u64 = 10_000;

/// Number of readings whose mean is one window of the movement detector.
const READINGS: usize = 10;

/// Time from the beginning of a level until its first reading counts, µs. In this time, amplitude
/// and force rise.
const SETTLE_US: u64 = 450_000;

/// Detector of movement. It compares five windows of 100 ms under stimulation with five at rest.
/// Something moved if three windows in a row differ from rest by more than six standard deviations.
/// Because each movement must be confirmed, a search over 40 levels goes wrong in far less than 1 %
/// of cases (see the test).
const DETECTOR: Detector = Detector {
    windows: 5,
    baseline: 5,
    k_sigma: 6.0,
    consecutive: 3,
    visible: 0.0,
    resolution: 0.0,
};

/// The instrument's verdict on whether a presentation moved anything.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct MovementVerdict {
    /// Whether the force differed from rest for long enough to count as a movement.
    pub moved: bool,
    /// Largest difference from the force at rest that lasted for three windows, N.
    pub deviation_n: f64,
    /// Difference from rest above which the verdict is a movement, N.
    pub bound_n: f64,
}

/// Force readings of the test rig's instrument, at rest and during the latest presentation.
#[derive(Clone, Debug, Default)]
pub(super) struct Instrument {
    window: Vec<f64>,
    baseline: VecDeque<f64>,
    windows: Vec<f64>,
    /// Time at which the present level began, µs; `None` if no level is being given.
    on_us: Option<u64>,
    /// Lowest and highest reading during the latest presentation, N; `None` if there is no reading
    /// yet.
    ends: Option<(f64, f64)>,
}

impl Instrument {
    /// Adds a reading of `n` newtons at the time `t_us`. `is_on` is whether a level is being given.
    pub fn add_reading(&mut self, t_us: u64, n: f64, is_on: bool) {
        match (is_on, self.on_us) {
            (true, None) => {
                self.window.clear();
                self.windows.clear();
                (self.on_us, self.ends) = (Some(t_us), None);
            }
            (false, Some(_)) => {
                self.window.clear();
                self.baseline.clear();
                self.on_us = None;
            }
            _ => {}
        }
        if self.on_us.is_some_and(|since| t_us < since + SETTLE_US) {
            return;
        }
        if is_on {
            let (low, high) = self.ends.unwrap_or((n, n));
            self.ends = Some((low.min(n), high.max(n)));
        }
        self.window.push(n);
        if self.window.len() < READINGS {
            return;
        }
        let mean = self.window.iter().sum::<f64>() / READINGS as f64;
        self.window.clear();
        if is_on {
            self.windows.push(mean);
        } else {
            self.baseline.push_back(mean);
            if self.baseline.len() > DETECTOR.baseline as usize {
                self.baseline.pop_front();
            }
        }
    }

    /// Returns whether the instrument has been read at rest for half a second, so that a level may
    /// be given.
    pub fn has_baseline(&self) -> bool {
        self.on_us.is_none() && self.baseline.len() >= DETECTOR.baseline as usize
    }

    /// Judges whether the latest presentation moved anything. Returns `None` if there are too few
    /// readings.
    ///
    /// # Errors
    /// The instrument saturates, or is mounted with the wrong sign.
    pub fn judge(&mut self) -> Result<Option<MovementVerdict>, CalibrationError> {
        let baseline = self.baseline.make_contiguous();
        let is_enough = |count: usize, least: u32| count >= least as usize;
        if !is_enough(baseline.len(), DETECTOR.baseline)
            || !is_enough(self.windows.len(), DETECTOR.consecutive)
        {
            return Ok(None);
        }
        let verdict = DETECTOR.judge(baseline, &self.windows);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        if verdict.is_movement() {
            if let Some((low, high)) = self.ends
                && low == high
            {
                return Err(CalibrationError::Saturates(low));
            }
            if mean(&self.windows) < mean(baseline) {
                return Err(CalibrationError::UpsideDown(
                    mean(&self.windows) - mean(baseline),
                ));
            }
        }
        Ok(Some(MovementVerdict {
            moved: verdict.is_movement(),
            deviation_n: verdict.deviation,
            bound_n: verdict.bound,
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::random::standard_normal;

    /// Judges one second at rest and one second at `force`, with this noise.
    fn said(
        seed: u64,
        noise_n: f64,
        force: impl Fn(f64) -> f64,
    ) -> Result<Option<MovementVerdict>, CalibrationError> {
        let mut instrument = Instrument::default();
        for i in 0..200_u64 {
            let noise = noise_n * standard_normal(seed, i);
            let n = if i < 100 { noise } else { force(noise) };
            instrument.add_reading(i * READ_US, n, i >= 100);
        }
        instrument.judge()
    }

    #[test]
    fn a_search_is_seldom_false() {
        let probability = DETECTOR.false_alarm_probability();
        let of_40 = 1.0 - (1.0 - probability * probability).powi(40);
        assert!(of_40 < 0.01, "{probability} {of_40}");
    }

    #[test]
    fn movement_is_told_from_noise() {
        let moved = |seed, force: f64| {
            said(seed, 0.05, |noise| force + noise)
                .unwrap()
                .unwrap()
                .moved
        };
        let none = (0..500).filter(|seed| moved(*seed, 0.0)).count();
        let some = (0..500).filter(|seed| moved(*seed, 0.5)).count();
        assert!(none <= 5, "{none}");
        assert!(some >= 495, "{some}");
    }

    #[test]
    fn a_sensor_at_its_end_and_one_upside_down_are_named() {
        let message = |result: Result<_, CalibrationError>| result.unwrap_err().to_string();
        let full = said(1, 0.05, |noise| (50.0 + noise).min(10.0));
        assert!(message(full).starts_with("E680"));
        let down = said(1, 0.05, |noise| noise - 3.0);
        assert!(message(down).starts_with("E681"));
    }
}
