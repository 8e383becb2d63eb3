//! Randomly generated elbows.

use super::spec::{ElbowMuscle, ElbowSpec, TORQUE_FREQUENCY_HZ};
use crate::body::muscle::SUBJECTS;
use crate::body::random_finger::Draws;

/// Stream of [`Draws`] from which elbows are generated.
const STREAM: u64 = 0xE1B0;

impl ElbowSpec {
    /// Returns arm `index` of `seed`, uniformly distributed over ranges about
    /// [`ElbowSpec::default`]. All ranges are assumed, and wide because next to nothing is known.
    /// Both muscles have the dynamics of one of Lee 2020's ten subjects.
    pub fn random(seed: u64, index: u64) -> Self {
        let draws = &mut Draws::new(seed, index, STREAM);
        let subject = SUBJECTS[draws.uniform(0.0, SUBJECTS.len() as f64) as usize % SUBJECTS.len()];
        let dynamics = subject.normalised_at(TORQUE_FREQUENCY_HZ);
        let mut spec = Self::default();
        let mut muscle = |nominal: ElbowMuscle| ElbowMuscle {
            threshold_ma: nominal.threshold_ma * draws.uniform(0.6, 1.4),
            max_ma: nominal.max_ma * draws.uniform(0.8, 1.2),
            torque_nm: nominal.torque_nm * draws.uniform(0.6, 1.4),
            dynamics,
            ..nominal
        };
        spec.triceps = muscle(spec.triceps);
        spec.biceps = muscle(spec.biceps);
        spec.recruitment_curvature *= draws.uniform(0.5, 1.5);
        spec.electromechanical_delay_us = draws.uniform(10_000.0, 50_000.0) as u32;
        spec.inertia_kg_m2 *= draws.uniform(0.7, 1.3);
        spec.stiffness_nm_per_rad *= draws.uniform(0.3, 3.0);
        // Uniform in its logarithm, because this is the least known number and matters most.
        spec.damping_nm_s_per_rad *= libm::pow(2f64, draws.uniform(-2.0, 2.0));
        spec.active_damping_s_per_rad *= draws.uniform(0.0, 2.0);
        spec.person.push_nm *= draws.uniform(0.4, 1.6);
        spec
    }
}
