//! Trains on which integrators are judged, with the true force of each.

use crate::subjects::spec;
use firmware::muscle::CalciumForceSpec;
use hal_sim::body::muscle::reference::integrate;
use hal_sim::body::muscle::{Parameters, SUBJECTS};

pub const RATES_HZ: [u32; 7] = [10, 20, 30, 40, 50, 70, 100];

/// Time span of the pulses of a train, µs.
const TRAIN_US: u32 = 1_000_000;
/// Length of a simulated run, µs: a train of 1 s, then 0.5 s in which the force decays.
pub const DURATION_US: u32 = 1_500_000;
/// Interval between two stored true forces, µs, and thus the shortest reading interval that can be
/// judged.
const FINEST_US: u32 = 1000;

/// A fully recruited muscle under one train of pulses, with its true force.
#[derive(Clone, Debug)]
pub struct Case {
    /// Times of the pulses, µs, ascending.
    pub pulses_us: Vec<u32>,
    /// Constants of the muscle in the units of the device.
    pub spec: CalciumForceSpec,
    /// True force at 0, 1, 2 … ms, N.
    truth: Vec<f64>,
    /// Largest true force of the run, N; errors are given in % of it.
    pub peak_n: f64,
}

impl Case {
    /// Creates a case and computes its true force with the reference integrator of `hal_sim`.
    pub fn new(parameters: &Parameters, pulses_us: Vec<u32>) -> Self {
        let pulses_s: Vec<f64> = pulses_us.iter().map(|us| f64::from(*us) * 1e-6).collect();
        let seconds = |us: u32| f64::from(us) * 1e-6;
        let samples = integrate(
            parameters,
            &pulses_s,
            seconds(DURATION_US),
            seconds(FINEST_US),
        );
        let truth: Vec<f64> = samples.iter().map(|s| s.force_n).collect();
        Self {
            pulses_us,
            spec: spec(parameters),
            peak_n: truth.iter().copied().fold(0.0, f64::max),
            truth,
        }
    }

    /// Returns the same case with another A, mN/s, which scales the force.
    pub(super) fn with_a(&self, a_mn_per_s: u32) -> Self {
        let factor = f64::from(a_mn_per_s) / f64::from(self.spec.a_mn_per_s);
        Self {
            pulses_us: self.pulses_us.clone(),
            spec: CalciumForceSpec {
                a_mn_per_s,
                ..self.spec
            },
            truth: self.truth.iter().map(|force| force * factor).collect(),
            peak_n: self.peak_n * factor,
        }
    }

    /// Returns the true force at `at_us`, N; whole ms only, up to [`DURATION_US`].
    pub fn truth_n(&self, at_us: u32) -> f64 {
        self.truth[(at_us / FINEST_US) as usize]
    }
}

/// Returns the test cases: each of Lee's ten subjects at each of [`RATES_HZ`], once with a regular
/// train whose first pulse is at a random time, and once with a train whose pulses deviate randomly
/// by up to 45 % of a period.
pub fn all_cases() -> Vec<Case> {
    let mut random = Random(0x9E37_79B9);
    let mut cases = vec![];
    for subject in &SUBJECTS {
        for rate_hz in RATES_HZ {
            let period = f64::from(TRAIN_US) / f64::from(rate_hz);
            let phase = random.unit_value();
            let regular = (0..rate_hz).map(|i| ((f64::from(i) + phase) * period) as u32);
            cases.push(Case::new(subject, regular.collect()));
            cases.push(Case::new(
                subject,
                jittered_train(rate_hz.into(), &mut random),
            ));
        }
    }
    cases
}

/// Returns the pulse times, µs, of a train of [`TRAIN_US`] at `rate_hz`. Each pulse deviates
/// randomly by up to 45 % of a period from its regular time.
pub(super) fn jittered_train(rate_hz: f64, random: &mut Random) -> Vec<u32> {
    let period = f64::from(TRAIN_US) / rate_hz;
    let place = |i: u32| {
        let place = f64::from(i) + 0.5 + 0.9 * (random.unit_value() - 0.5);
        (place * period) as u32
    };
    (0..rate_hz as u32).map(place).collect()
}

/// Marsaglia's random number generator xorshift32 (J. Stat. Softw. 8(14), 2003); its state must not
/// be 0.
pub(super) struct Random(pub u32);

impl Random {
    /// Returns a random number from 0 inclusive to 1 exclusive.
    pub fn unit_value(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        f64::from(self.0 >> 8) / f64::from(1u32 << 24)
    }
}
