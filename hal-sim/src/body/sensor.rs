//! Angle sensor of a joint, with lag, noise and finite resolution.

use crate::random::Noise;

/// Parameters of an angle sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SensorSpec {
    /// Time constant of the lag, s; 0 for no lag.
    pub lag_s: f64,
    /// Standard deviation of the noise, white from step to step, °.
    pub noise_deg: f64,
    /// Resolution of a reading, above zero, °.
    pub resolution_deg: f64,
    /// Smallest and largest reading, °.
    pub range_deg: [f64; 2],
}

/// State of an angle sensor, updated with the time step of the joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AngleSensor {
    spec: SensorSpec,
    noise: Noise,
    lagging_deg: f64,
    keeps: f64,
}

impl AngleSensor {
    /// Creates a sensor that has settled at `angle_deg`, for time steps of `step_s`. `seed`
    /// determines the noise.
    pub fn new(spec: SensorSpec, angle_deg: f64, step_s: f64, seed: u64) -> Self {
        Self {
            noise: Noise::new(seed),
            lagging_deg: angle_deg,
            keeps: if spec.lag_s > 0.0 {
                libm::exp(-step_s / spec.lag_s)
            } else {
                0.0
            },
            spec,
        }
    }

    /// Advances by a time step, at whose end the joint is at `angle_deg`.
    pub fn step(&mut self, angle_deg: f64) {
        self.lagging_deg = angle_deg + (self.lagging_deg - angle_deg) * self.keeps;
    }

    /// Returns the reading after `tick` time steps, °.
    pub fn read(&self, tick: u64) -> f64 {
        let noise = self.spec.noise_deg * self.noise.at(tick);
        let step = self.spec.resolution_deg;
        let [low, high] = self.spec.range_deg;
        (((self.lagging_deg + noise) / step).round() * step).clamp(low, high)
    }
}
