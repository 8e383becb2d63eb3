//! Judges from the instrument of the test rig whether a presentation moved anything.

use super::CalibrationError;
use crate::statistics::Detector;
use serde::Serialize;
use std::collections::VecDeque;

/// Time between two readings, µs.
pub const READ_US: u64 = 10_000;

/// Number of readings in a window.
const READINGS: usize = 10;

/// Time from the start of a level to its first window, µs, for the rise of amplitude and force.
const SETTLE_US: u64 = 450_000;

/// Detector of movement in windows of 100 ms, five at rest and five under stimulation. Movement is
/// three of these in a row beyond six standard deviations. With the confirmation, a search of 40
/// levels is wrong in far less than 1 % (see the test).
const DETECTOR: Detector = Detector {
    windows: 5,
    baseline: 5,
    k_sigma: 6.0,
    consecutive: 3,
    visible: 0.0,
    resolution: 0.0,
};

/// Verdict on whether a presentation moved anything.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct MovementVerdict {
    /// Whether something moved.
    pub moved: bool,
    /// Largest lasting distance from rest, N.
    pub deviation_n: f64,
    /// Bound that the distance had to exceed, N.
    pub bound_n: f64,
}

/// Readings of the instrument at rest and under stimulation.
#[derive(Clone, Debug, Default)]
pub(super) struct Instrument {
    window: Vec<f64>,
    baseline: VecDeque<f64>,
    windows: Vec<f64>,
    /// Time at which the present level began, µs; `None` at rest.
    on_us: Option<u64>,
    /// Lowest and highest reading under stimulation, N.
    ends: Option<(f64, f64)>,
}

impl Instrument {
    /// Adds a reading of `n` newtons at `t_us`; `is_on` is true while a level is given.
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

    /// Returns whether the instrument has been read at rest for long enough.
    pub fn has_baseline(&self) -> bool {
        self.on_us.is_none() && self.baseline.len() >= DETECTOR.baseline as usize
    }

    /// Judges the windows of the presentation. Returns `None` if there are too few readings.
    ///
    /// # Errors
    /// The instrument saturates, or is mounted with the wrong sign.
    pub fn judge(&mut self) -> Result<Option<MovementVerdict>, CalibrationError> {
        let baseline = self.baseline.make_contiguous();
        let is_enough = |count: usize, of: u32| count >= of as usize;
        if !is_enough(baseline.len(), DETECTOR.baseline)
            || !is_enough(self.windows.len(), DETECTOR.consecutive)
        {
            return Ok(None);
        }
        let verdict = DETECTOR.judge(baseline, &self.windows);
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
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
        let one = DETECTOR.false_alarm_probability();
        let of_40 = 1.0 - (1.0 - one * one).powi(40);
        assert!(of_40 < 0.01, "{one} {of_40}");
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
        let told = |result: Result<_, CalibrationError>| result.unwrap_err().to_string();
        let full = said(1, 0.05, |noise| (50.0 + noise).min(10.0));
        assert!(told(full).starts_with("E680 "));
        let down = said(1, 0.05, |noise| noise - 3.0);
        assert!(told(down).starts_with("E681 "));
    }
}
