//! A torque sensor on a lever, read 1000 times a second: F = τ/L (Lee 2020, §2.3.2).
//!
//! The model has noise, a drifting offset, a limited range and a sign. The experimenter's average
//! over 40 ms is not part of it.

use super::InvalidBench;
use crate::random::{Noise, word};

/// Time between two samples, µs (Lee 2020, §2.3.2: 1 kHz).
pub const SAMPLE_US: u64 = 1_000;
/// Time between two samples, s.
const SAMPLE_S: f64 = 1e-3;
/// Random stream of the offset's wander.
const WANDERING: u64 = 0x7d21;

/// Parameters of a sensor on its lever. Forces act at the end of the lever.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorSpec {
    /// Length L of the lever, from the axis of the sensor to the point where the limb pulls, m;
    /// above 0.
    pub lever_m: f64,
    /// Length L of the lever that the experimenter uses to compute force, m; above 0. It may differ
    /// from the true one.
    pub believed_lever_m: f64,
    /// Standard deviation of the white noise of a sample, N.
    pub noise_n: f64,
    /// Reading without force at time 0, N.
    pub offset_n: f64,
    /// Steady drift of the offset, N/s.
    pub drift_n_per_s: f64,
    /// Random walk of the offset, in addition to the drift, N/√s.
    pub wander_n_per_sqrt_s: f64,
    /// Largest force of either sign that the sensor can read, N; above 0.
    pub range_n: f64,
    /// Whether the sensor is mounted upside down, so that its readings have the opposite sign.
    pub is_upside_down: bool,
}

impl Default for SensorSpec {
    /// Returns the sensor of Lee 2020: it measures 200 kgf·cm (NT-200KC), 19.6 N m. The lever is
    /// not printed and assumed to be 0.1 m, which gives a range of 196 N. Noise is not printed
    /// either: 0.05 N is assumed, with an offset of 0.2 N that drifts by 2 mN/s.
    fn default() -> Self {
        Self {
            lever_m: 0.1,
            believed_lever_m: 0.1,
            noise_n: 0.05,
            offset_n: 0.2,
            drift_n_per_s: 0.002,
            wander_n_per_sqrt_s: 0.0,
            range_n: 196.0,
            is_upside_down: false,
        }
    }
}

impl SensorSpec {
    /// Checks every field.
    ///
    /// # Errors
    /// Returns the name of the first field whose value is out of range.
    pub fn validate(&self) -> Result<(), InvalidBench> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let not_negative = |v: f64| v.is_finite() && v >= 0.0;
        let rules = [
            ("lever_m", positive(self.lever_m)),
            ("believed_lever_m", positive(self.believed_lever_m)),
            ("noise_n", not_negative(self.noise_n)),
            ("offset_n", self.offset_n.is_finite()),
            ("drift_n_per_s", self.drift_n_per_s.is_finite()),
            (
                "wander_n_per_sqrt_s",
                not_negative(self.wander_n_per_sqrt_s),
            ),
            ("range_n", positive(self.range_n)),
        ];
        match rules.into_iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidBench(field)),
            None => Ok(()),
        }
    }
}

/// A sensor and its last sample.
#[derive(Debug, Clone, PartialEq)]
pub struct Sensor {
    spec: SensorSpec,
    noise: Noise,
    wandering: Noise,
    /// Number of samples taken, which is also the time since the start in ms.
    taken: u64,
    wandered_n: f64,
    force_n: f64,
}

impl Sensor {
    /// Creates a sensor without a sample yet. `seed` determines its noise.
    ///
    /// # Errors
    /// Returns the name of the first field of `spec` whose value is out of range.
    pub fn new(spec: SensorSpec, seed: u64) -> Result<Self, InvalidBench> {
        spec.validate()?;
        Ok(Self {
            spec,
            noise: Noise::new(seed),
            wandering: Noise::new(word(seed, WANDERING)),
            taken: 0,
            wandered_n: 0.0,
            force_n: 0.0,
        })
    }

    /// Takes the next sample, [`SAMPLE_US`] after the previous one. `force_n` is the true force at
    /// the end of the lever.
    pub fn sample(&mut self, force_n: f64) {
        self.taken += 1;
        self.force_n = force_n;
        if self.spec.wander_n_per_sqrt_s > 0.0 {
            let step = self.spec.wander_n_per_sqrt_s * SAMPLE_S.sqrt();
            self.wandered_n += step * self.wandering.at(self.taken);
        }
    }

    /// Returns the force of the last sample as the experimenter computes it, N.
    #[must_use]
    pub fn reading_n(&self) -> f64 {
        let spec = &self.spec;
        let t_s = self.taken as f64 * SAMPLE_S;
        let zero_n = spec.offset_n + spec.drift_n_per_s * t_s + self.wandered_n;
        let sign = if spec.is_upside_down { -1.0 } else { 1.0 };
        // Noise and offset are in newtons at the end of the lever; a wrong lever length alone
        // changes their scale.
        let sensed_n = sign * self.force_n + zero_n + spec.noise_n * self.noise.at(self.taken);
        let torque_nm = spec.lever_m * sensed_n.clamp(-spec.range_n, spec.range_n);
        torque_nm / spec.believed_lever_m
    }

    /// Returns the specification from which the sensor was created.
    #[must_use]
    pub const fn spec(&self) -> &SensorSpec {
        &self.spec
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quiet() -> SensorSpec {
        SensorSpec {
            noise_n: 0.0,
            offset_n: 0.0,
            drift_n_per_s: 0.0,
            ..SensorSpec::default()
        }
    }

    fn read(spec: SensorSpec, force_n: f64, samples: u32) -> f64 {
        let mut sensor = Sensor::new(spec, 1).unwrap();
        (0..samples).for_each(|_| sensor.sample(force_n));
        sensor.reading_n()
    }

    #[test]
    fn a_quiet_sensor_reads_the_force() {
        assert!((read(quiet(), 3.0, 1) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn it_drifts_saturates_and_hangs_upside_down() {
        let drifts = SensorSpec {
            offset_n: 0.1,
            drift_n_per_s: 0.5,
            ..quiet()
        };
        assert!((read(drifts, 1.0, 2_000) - 2.1).abs() < 1e-9);
        let ends = SensorSpec {
            range_n: 2.0,
            ..quiet()
        };
        assert_eq!(read(ends, 3.0, 1), 2.0);
        let upside_down = SensorSpec {
            is_upside_down: true,
            ..quiet()
        };
        assert!((read(upside_down, 3.0, 1) + 3.0).abs() < 1e-12);
        let short = SensorSpec {
            believed_lever_m: 0.2,
            ..quiet()
        };
        assert!((read(short, 3.0, 1) - 1.5).abs() < 1e-12);
    }

    /// The noise of a sample does not depend on how often the sample is read.
    #[test]
    fn noise_is_white_and_belongs_to_the_sample() {
        let spec = SensorSpec {
            noise_n: 0.05,
            ..quiet()
        };
        let mut sensor = Sensor::new(spec, 7).unwrap();
        let mut readings = Vec::new();
        for _ in 0..20_000 {
            sensor.sample(0.0);
            assert_eq!(sensor.reading_n(), sensor.reading_n());
            readings.push(sensor.reading_n());
        }
        let n = readings.len() as f64;
        let square = readings.iter().map(|value| value * value).sum::<f64>() / n;
        let lag = readings
            .windows(2)
            .map(|window| window[0] * window[1])
            .sum::<f64>()
            / n;
        assert!((square.sqrt() / 0.05 - 1.0).abs() < 0.02);
        assert!((lag / square).abs() < 4.0 / n.sqrt());
    }

    #[test]
    fn a_field_that_cannot_be_is_named() {
        let spec = SensorSpec {
            range_n: 0.0,
            ..quiet()
        };
        assert_eq!(Sensor::new(spec, 1).unwrap_err(), InvalidBench("range_n"));
    }
}
