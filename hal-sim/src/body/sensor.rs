//! A joint's angle sensor: it lags, it is noisy, it reads in steps.

use crate::random::Noise;

/// What an angle sensor is like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SensorSpec {
    /// Time constant, s; zero for none.
    pub lag_s: f64,
    /// Standard deviation of the noise, white from step to step, °.
    pub noise_deg: f64,
    /// Step of a reading, above zero, °.
    pub resolution_deg: f64,
    /// What it can read, °.
    pub range_deg: [f64; 2],
}

/// An angle sensor, in steps of the joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AngleSensor {
    spec: SensorSpec,
    noise: Noise,
    lagging_deg: f64,
    keeps: f64,
}

impl AngleSensor {
    /// Long at `angle_deg`, for steps of `step_s`; `seed` decides the noise.
    pub fn new(spec: SensorSpec, angle_deg: f64, step_s: f64, seed: u64) -> Self {
        Self {
            noise: Noise::new(seed),
            lagging_deg: angle_deg,
            keeps: if spec.lag_s > 0.0 {
                (-step_s / spec.lag_s).exp()
            } else {
                0.0
            },
            spec,
        }
    }

    /// A step has passed, at whose end the joint is at `angle_deg`.
    pub fn step(&mut self, angle_deg: f64) {
        self.lagging_deg = angle_deg + (self.lagging_deg - angle_deg) * self.keeps;
    }

    /// What it reads after `tick` steps, °.
    pub fn read(&self, tick: u64) -> f64 {
        let noise = self.spec.noise_deg * self.noise.at(tick);
        let step = self.spec.resolution_deg;
        let [low, high] = self.spec.range_deg;
        (((self.lagging_deg + noise) / step).round() * step).clamp(low, high)
    }
}
