//! A recorded train's force, and checks for its mistakes.

use super::error::IdentifyError;

/// Time between two samples, µs (Lee 2020, §2.3.2: 1 kHz).
pub const SAMPLE_US: u32 = 1_000;
/// Number of consecutive equal samples from which the sensor counts as stuck at the end of its
/// range. White noise does not repeat a value so often.
const STUCK: usize = 8;
/// Shortest time without stimulation that a record must have before the first pulse, µs.
const REST_US: u32 = 100_000;
/// Shortest time without stimulation that a record must have after the last pulse, µs.
const DECAY_US: u32 = 500_000;
/// Time after the first pulse that the check of the force's sign leaves out, µs, because the force
/// may not have risen yet.
const RISE_US: u32 = 100_000;
/// Fall of the mean reading during stimulation, in standard errors, above which the sensor counts
/// as upside down.
const CLEARLY: f64 = 6.0;

/// Measured force during a train of pulses and during the decay after it.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceRecord {
    /// Times of the pulses, µs after the first sample, in rising order.
    pub pulses_us: Vec<u32>,
    /// Measured force, N, one sample every [`SAMPLE_US`].
    pub samples_n: Vec<f64>,
    /// Ratio of the force scale A in this record to the A that is fitted. It is 1 for a train at
    /// the amplitude for which A is fitted.
    pub gain: f64,
}

/// Properties of the rest before the train in a usable record; [`ForceRecord::check_quality`]
/// returns them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sound {
    /// Mean reading before the train, N.
    pub rest_n: f64,
    /// Standard deviation of the readings before the train, N.
    pub noise_n: f64,
    /// Number of samples before the train.
    pub rest: usize,
}

impl ForceRecord {
    /// Returns the number of samples before the first pulse.
    #[must_use]
    pub fn rest_samples(&self) -> usize {
        let first = self.pulses_us.first().copied().unwrap_or(0);
        ((first / SAMPLE_US) as usize).min(self.samples_n.len())
    }

    /// Returns the samples minus the mean reading before the train, N.
    #[must_use]
    pub fn relative_to_rest(&self) -> Vec<f64> {
        let rest = self.rest_samples();
        let zero_n = self.samples_n.iter().take(rest).sum::<f64>() / rest.max(1) as f64;
        self.samples_n
            .iter()
            .map(|sample_n| sample_n - zero_n)
            .collect()
    }

    /// Checks whether the record can be used for a fit, and returns the properties of the rest
    /// before the train.
    ///
    /// # Errors
    /// E643: the rest or the decay is too short, the pulses are out of order, or a sample is not a
    /// number. E640: the sensor saturates. E641: the sensor is upside down.
    pub fn check_quality(&self) -> Result<Sound, IdentifyError> {
        let too_short = |reason: &str| IdentifyError::TooShort {
            what: reason.to_owned(),
        };
        let (Some(first), Some(last)) = (self.pulses_us.first(), self.pulses_us.last()) else {
            return Err(too_short("it has no pulses"));
        };
        let lasts_us = self.samples_n.len() as u64 * u64::from(SAMPLE_US);
        if !self.samples_n.iter().all(|sample_n| sample_n.is_finite()) {
            return Err(too_short("a sample is not a number"));
        }
        if !self.pulses_us.is_sorted() {
            return Err(too_short("its pulses are out of order"));
        }
        if *first < REST_US {
            return Err(too_short("it has less than 0.1 s before the first pulse"));
        }
        if lasts_us < u64::from(*last) + u64::from(DECAY_US) {
            return Err(too_short("it has less than 0.5 s after the last pulse"));
        }
        self.check_saturation()?;
        self.check_sign(*first, *last)
    }

    fn check_saturation(&self) -> Result<(), IdentifyError> {
        let mut run = 1;
        for (place, pair) in self.samples_n.windows(2).enumerate() {
            run = if pair[0] == pair[1] { run + 1 } else { 1 };
            if run == STUCK {
                let same = |value: &&f64| **value == pair[1];
                let from = place + 2 - STUCK;
                return Err(IdentifyError::Saturated {
                    reading_n: pair[1],
                    samples: self.samples_n.iter().skip(from).take_while(same).count(),
                    at_s: from as f64 * f64::from(SAMPLE_US) * 1e-6,
                });
            }
        }
        Ok(())
    }

    fn check_sign(&self, first_us: u32, last_us: u32) -> Result<Sound, IdentifyError> {
        let rest = self.rest_samples();
        let (rest_n, variance) = moments(&self.samples_n[..rest]);
        let from = (((first_us + RISE_US) / SAMPLE_US) as usize).min(self.samples_n.len());
        let to = ((last_us / SAMPLE_US) as usize).clamp(from, self.samples_n.len());
        let (pulled_n, _) = moments(&self.samples_n[from..to]);
        let moved_n = if to > from { pulled_n - rest_n } else { 0.0 };
        // A drift of the offset changes the mean too, but only a little.
        let error_n = (variance / rest.max(1) as f64).sqrt();
        if moved_n < -CLEARLY * error_n - 0.01 {
            return Err(IdentifyError::UpsideDown { moved_n });
        }
        Ok(Sound {
            rest_n,
            noise_n: variance.sqrt(),
            rest,
        })
    }
}

/// Returns the mean and the variance of `values`; both are 0 without values.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>();
    (mean, square / (n - 1.0).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(sample: impl Fn(usize) -> f64) -> ForceRecord {
        ForceRecord {
            pulses_us: (0..40).map(|i| 200_000 + 25_000 * i).collect(),
            samples_n: (0..2_000).map(sample).collect(),
            gain: 1.0,
        }
    }

    /// Returns noise with no repetition in a row, and 5 N more while pulses come.
    fn pulled(i: usize) -> f64 {
        let noise = ((i * 7_919) % 101) as f64 * 1e-3;
        noise + if (200..1_200).contains(&i) { 5.0 } else { 0.0 }
    }

    #[test]
    fn a_sound_record_tells_its_rest() {
        let sound = record(pulled).check_quality().unwrap();
        assert_eq!(sound.rest, 200);
        assert!((sound.rest_n - 0.05).abs() < 0.01);
    }

    #[test]
    fn an_end_and_a_sign_are_named() {
        let ends = record(|i| pulled(i).min(4.0)).check_quality().unwrap_err();
        let IdentifyError::Saturated { samples, at_s, .. } = ends else {
            panic!("{ends}");
        };
        assert!(samples == 1_000 && (at_s - 0.2).abs() < 1e-9);
        let hangs = record(|i| -pulled(i)).check_quality().unwrap_err();
        assert!(matches!(hangs, IdentifyError::UpsideDown { .. }), "{hangs}");
        assert!(hangs.to_string().starts_with("E641"));
    }

    #[test]
    fn too_little_is_named() {
        let mut short = record(pulled);
        short.samples_n.truncate(1_400);
        assert!(
            short
                .check_quality()
                .unwrap_err()
                .to_string()
                .contains("0.5 s after")
        );
        let mut early = record(pulled);
        early
            .pulses_us
            .iter_mut()
            .for_each(|pulse_us| *pulse_us -= 150_000);
        assert!(
            early
                .check_quality()
                .unwrap_err()
                .to_string()
                .contains("0.1 s before")
        );
    }
}
