//! Randomly generated and nominal arms.

use super::anatomy::{ELECTRODES, MUSCLES};
use super::posture::Posture;
use super::sensors::{ForceSpec, ImuFault, ImuSpec};
use super::spec::{ArmSpec, HoldSpec, SEGMENTS};
use crate::body::muscle::{Parameters, SUBJECTS};
use crate::body::random_finger::Draws;
use crate::body::wearer::RECRUITMENT_CURVATURE;
use crate::random;

/// Stream of [`Draws`] from which arms are generated.
const STREAM: u64 = 0xA63;
/// Pulse rate at which forces equal those of full recruitment, 1/s. Assumed: the paper prints no
/// rate for its trains (its device allows 0.5 to 100).
pub const FREQUENCY_HZ: f64 = 40.0;

/// A of the mean subject at [`FREQUENCY_HZ`], 1/s. The results of [`Parameters::normalised_at`] are
/// stored here, because its computation takes as long as the simulation of a whole session.
const MEAN_A_PER_S: f64 = 9.250_290_656_505_335;
/// A of each of [`SUBJECTS`] at [`FREQUENCY_HZ`], 1/s.
const SUBJECTS_A_PER_S: [f64; SUBJECTS.len()] = [
    8.115_739_016_822_001,
    10.540_145_368_950_121,
    15.694_657_564_116_593,
    7.826_855_734_188_752,
    8.331_272_179_991_894,
    7.419_945_419_863_587,
    7.006_921_986_435_215_5,
    12.905_523_375_336_923,
    9.591_999_622_607_611,
    8.413_814_779_880_38,
];

impl HoldSpec {
    /// Nominal values, each near the middle of the range that its field's comment names.
    pub const NOMINAL: Self = Self {
        passive_nm_per_rad: [60.0, 60.0, 60.0, 10.0, 10.0, 10.0, 2.0, 1.0],
        voluntary_nm_per_rad: [60.0, 60.0, 60.0, 20.0, 20.0, 20.0, 10.0, 2.0],
        damping: 0.3,
        cuff: [10_000.0, 60.0],
    };
}

impl ForceSpec {
    /// Nominal values, each near the middle of the range that its field's comment names.
    pub const NOMINAL: Self = Self {
        noise_n: 0.1,
        noise_nm: 0.005,
        bias_n: 2.0,
        wander_n: 0.7,
        wander_s: 2.0,
    };
}

impl ImuSpec {
    /// Nominal values, each near the middle of the range that its field's comment names.
    pub const NOMINAL: Self = Self {
        gyro_noise_rad_s: 0.005,
        gyro_bias_rad_s: 0.01,
        accel_noise_m_s2: 0.05,
        accel_bias_m_s2: 0.1,
        askew_deg: 5.0,
    };
}

impl ArmSpec {
    /// Returns the nominal arm: every parameter is near the middle of its range, and every muscle's
    /// line of action has its nominal azimuth (0°).
    #[must_use]
    pub fn nominal() -> Self {
        Self {
            stature_m: 1.76,
            mass_kg: 77.3,
            length_factors: [1.0; 2],
            shoulder_factor: 1.0,
            inertia_factors: [1.0; SEGMENTS],
            posture: Posture::STUDY,
            azimuth_deg: [0.0; MUSCLES],
            reached: [0.08; MUSCLES],
            threshold_ma: [10.0; ELECTRODES],
            max_ma: [30.0; ELECTRODES],
            curvature: RECRUITMENT_CURVATURE,
            crosstalk: [0.3; ELECTRODES],
            dynamics: Parameters {
                a_n_per_s: MEAN_A_PER_S,
                ..Parameters::mean_subject()
            },
            delay_us: 25_000,
            fatigue_floor: 0.5,
            fatigue_time_s: 60.0,
            force_noise: 0.08,
            hold: HoldSpec::NOMINAL,
            force: ForceSpec::NOMINAL,
            imu: ImuSpec::NOMINAL,
            imu_faults: [ImuFault::None; SEGMENTS],
            load_ohm: 1_000.0,
            seed: 0,
        }
    }

    /// Returns arm `index` of `seed`, generated randomly within the ranges that [`ArmSpec`] names.
    /// Stature and mass are normally distributed with the paper's means and standard deviations,
    /// clamped to two standard deviations.
    #[must_use]
    pub fn random(seed: u64, index: u64) -> Self {
        let draws = &mut Draws::new(seed, index, STREAM);
        let subject = draws.uniform(0.0, SUBJECTS.len() as f64) as usize % SUBJECTS.len();
        let stream = random::word(random::word(seed, index), STREAM);
        let normal = |which| random::standard_normal(stream, which).clamp(-2.0, 2.0);
        let log = |draws: &mut Draws, low: f64, high: f64| {
            libm::exp(draws.uniform(libm::log(low), libm::log(high)))
        };
        let mut spec = Self {
            stature_m: 1.76 + 0.09 * normal(0),
            mass_kg: 77.3 + 6.67 * normal(1),
            dynamics: Parameters {
                a_n_per_s: SUBJECTS_A_PER_S[subject],
                ..SUBJECTS[subject]
            },
            seed: random::word(stream, 2),
            ..Self::nominal()
        };
        spec.length_factors = [0; 2].map(|_| draws.uniform_factor(0.07));
        spec.shoulder_factor = spec.stature_m / 1.76 * draws.uniform_factor(0.05);
        spec.inertia_factors = [0; SEGMENTS].map(|_| draws.uniform_factor(0.2));
        spec.azimuth_deg = [0; MUSCLES].map(|_| draws.uniform(-30.0, 30.0));
        spec.reached = [0; MUSCLES].map(|_| log(draws, 0.04, 0.16));
        spec.threshold_ma = [0; ELECTRODES].map(|_| draws.uniform(6.0, 16.0));
        spec.max_ma = [0; ELECTRODES].map(|_| draws.uniform(20.0, 45.0));
        spec.curvature *= draws.uniform_factor(0.5);
        spec.crosstalk = [0; ELECTRODES].map(|_| draws.uniform(0.1, 0.6));
        spec.delay_us = draws.uniform(10_000.0, 50_000.0) as u32;
        spec.fatigue_floor = draws.uniform(0.3, 0.7);
        spec.fatigue_time_s = draws.uniform(30.0, 120.0);
        spec.force_noise = draws.uniform(0.06, 0.10);
        let girdle = log(draws, 20.0, 150.0);
        spec.hold.passive_nm_per_rad[..3].fill(girdle);
        spec.hold.voluntary_nm_per_rad[..3].fill(girdle);
        spec.hold.damping = draws.uniform(0.1, 0.5);
        spec.hold.cuff = [log(draws, 3e3, 3e4), log(draws, 20.0, 200.0)];
        spec.force.wander_n = log(draws, 0.3, 2.0);
        spec.imu.askew_deg = draws.uniform(2.0, 10.0);
        spec
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Equal within the exponential of another C library.
    #[test]
    fn the_stored_dynamics_are_those_at_the_pulse_rate() {
        let subjects = SUBJECTS.into_iter().zip(SUBJECTS_A_PER_S);
        for (fresh, a_per_s) in subjects.chain([(Parameters::mean_subject(), MEAN_A_PER_S)]) {
            let off = a_per_s / fresh.normalised_at(FREQUENCY_HZ).a_n_per_s - 1.0;
            assert!(off.abs() < 1e-14, "{off:e}");
        }
    }
}
