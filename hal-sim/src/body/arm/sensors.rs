//! Sensors of the arm: IMUs (angular velocity and gravity) on three segments, and force at the
//! cuff.

use crate::random;
use nalgebra::{Matrix3, Rotation3, Vector3};

/// Standard acceleration of free fall, m/s².
pub const GRAVITY_M_S2: f64 = 9.80665;

/// Interval at which the random wander of the wearer's hold is updated, ms.
const WANDER_MS: u64 = 10;

/// Parameters of a small inertial sensor. All are assumed, of the order of common consumer parts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuSpec {
    /// Standard deviation of the gyroscope's white noise per sample at 1 kHz, rad/s (0.001 to
    /// 0.01).
    pub gyro_noise_rad_s: f64,
    /// Standard deviation of the gyroscope's constant offset on each axis, rad/s (0 to 0.02).
    pub gyro_bias_rad_s: f64,
    /// Standard deviation of the accelerometer's white noise per sample at 1 kHz, m/s² (0.01 to
    /// 0.1).
    pub accel_noise_m_s2: f64,
    /// Standard deviation of the accelerometer's constant offset on each axis, m/s² (0 to 0.3).
    pub accel_bias_m_s2: f64,
    /// Standard deviation of the sensor's misalignment on its segment about each axis, degrees (2
    /// to 10).
    pub askew_deg: f64,
}

/// Mounting or wiring error of an IMU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ImuFault {
    /// The IMU works.
    #[default]
    None,
    /// The IMU is missing: all readings are zero.
    Missing,
    /// The axes are read in this order, reversed where the sign is negative; `[1, 2, 3]` is
    /// correct.
    Swapped([i8; 3]),
}

/// Parameters of a six-axis force sensor and of the wearer's hold on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceSpec {
    /// Standard deviation of the force's white noise per sample at 1 kHz, N (0.02 to 0.2).
    pub noise_n: f64,
    /// Standard deviation of the torque's white noise per sample at 1 kHz, N m.
    pub noise_nm: f64,
    /// Standard deviation of the constant offset on each axis, N (0 to 5), without the arm's
    /// weight.
    pub bias_n: f64,
    /// Standard deviation on each axis of the wander of the wearer's hold, N (0.3 to 2).
    pub wander_n: f64,
    /// Time constant of this wander, s (0.5 to 5).
    pub wander_s: f64,
}

/// Measurement of an IMU, in the axes of the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Imu {
    /// Angular velocity of the segment with noise and offset, rad/s.
    pub gyro_rad_s: [f64; 3],
    /// Specific force, m/s²; at rest it points up.
    pub accel_m_s2: [f64; 3],
}

/// An IMU on its segment, with random misalignment and offsets.
#[derive(Debug, Clone, PartialEq)]
pub struct MountedImu {
    spec: ImuSpec,
    fault: ImuFault,
    /// Rotation from the axes of the body to those of the sensor.
    to_sensor: Matrix3<f64>,
    gyro_bias: Vector3<f64>,
    accel_bias: Vector3<f64>,
    seed: u64,
}

/// Returns a vector of three standard normal deviates.
fn random_normal_vector(seed: u64, index: u64) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| random::standard_normal(seed, 3 * index + axis as u64))
}

impl MountedImu {
    /// Mounts the IMU on a segment with the orientation `frame`, whose columns are the axes of the
    /// segment, expressed in the axes of the body. `seed` determines misalignment, offsets and
    /// noise.
    #[must_use]
    pub fn new(spec: ImuSpec, fault: ImuFault, frame: &Matrix3<f64>, seed: u64) -> Self {
        let fixed = random::word(seed, 0);
        let askew = spec.askew_deg.to_radians() * random_normal_vector(fixed, 0);
        let mount = Rotation3::new(askew).into_inner();
        Self {
            to_sensor: (frame * mount).transpose(),
            gyro_bias: spec.gyro_bias_rad_s * random_normal_vector(fixed, 1),
            accel_bias: spec.accel_bias_m_s2 * random_normal_vector(fixed, 2),
            seed: random::word(seed, 1),
            spec,
            fault,
        }
    }

    /// Returns the measurement at millisecond `tick` on a segment that rotates at `rate` rad/s. The
    /// model omits the acceleration of the segment itself, so the accelerometer's values are
    /// correct only at rest.
    #[must_use]
    pub fn read(&self, rate: &Vector3<f64>, tick: u64) -> Imu {
        let noise = |stream: u64| random_normal_vector(random::word(self.seed, stream), tick);
        let gyro = self.to_sensor * rate + self.gyro_bias + self.spec.gyro_noise_rad_s * noise(0);
        let up = GRAVITY_M_S2 * Vector3::z();
        let accel = self.to_sensor * up + self.accel_bias + self.spec.accel_noise_m_s2 * noise(1);
        Imu {
            gyro_rad_s: self.fault.apply(gyro.into()),
            accel_m_s2: self.fault.apply(accel.into()),
        }
    }
}

impl ImuFault {
    fn apply(self, read: [f64; 3]) -> [f64; 3] {
        match self {
            Self::None => read,
            Self::Missing => [0.0; 3],
            Self::Swapped(order) => order.map(|axis| {
                let place = usize::from(axis.unsigned_abs()).saturating_sub(1);
                f64::from(axis.signum()) * read.get(place).copied().unwrap_or(0.0)
            }),
        }
    }
}

/// State of the force sensor: noise, offset, and the wander of the wearer's hold.
#[derive(Debug, Clone, PartialEq)]
pub struct ForceSensor {
    spec: ForceSpec,
    offset: [f64; 6],
    wander: [f64; 3],
    keeps: f64,
    seed: u64,
    tick: u64,
}

impl ForceSensor {
    /// Creates a sensor that carries the arm's weight, N, as a downward force. `seed` determines
    /// offsets, wander and noise.
    #[must_use]
    pub fn new(spec: ForceSpec, weight_n: f64, seed: u64) -> Self {
        let bias = |axis: u64| spec.bias_n * random::standard_normal(random::word(seed, 7), axis);
        let mut offset =
            std::array::from_fn(|axis| bias(axis as u64) * if axis < 3 { 1.0 } else { 0.1 });
        offset[2] -= weight_n;
        Self {
            offset,
            wander: [0.0; 3],
            keeps: libm::exp(-1e-3 * WANDER_MS as f64 / spec.wander_s),
            seed,
            tick: 0,
            spec,
        }
    }

    /// Advances the sensor by one millisecond. The wander of the hold changes every 10 ms.
    pub fn step(&mut self) {
        self.tick += 1;
        if !self.tick.is_multiple_of(WANDER_MS) {
            return;
        }
        let push = self.spec.wander_n * (1.0 - self.keeps * self.keeps).sqrt();
        let deviates = random_normal_vector(random::word(self.seed, 8), self.tick);
        for (wander, deviate) in self.wander.iter_mut().zip(deviates.iter()) {
            *wander = self.keeps * *wander + push * deviate;
        }
    }

    /// Returns the measured force and torque while the arm pushes with `wrench` (N, N m).
    #[must_use]
    pub fn read(&self, wrench: &[f64; 6]) -> [f64; 6] {
        let noise =
            [9, 10].map(|stream| random_normal_vector(random::word(self.seed, stream), self.tick));
        std::array::from_fn(|axis| {
            let wander = self.wander.get(axis).copied().unwrap_or(0.0);
            let noise = match axis {
                0..3 => self.spec.noise_n * noise[0][axis],
                _ => self.spec.noise_nm * noise[1][axis - 3],
            };
            wrench[axis] + self.offset[axis] + wander + noise
        })
    }
}
