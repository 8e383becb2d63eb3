//! Trains on which integrators are judged, with the true force of each.

use crate::subjects::spec;
use firmware::muscle::CalciumForceSpec;
use hal_sim::body::muscle::reference::integrate;
use hal_sim::body::muscle::{Parameters, SUBJECTS};

pub const RATES_HZ: [u32; 7] = [10, 20, 30, 40, 50, 70, 100];

/// Length of a train, µs.
const TRAIN_US: u32 = 1_000_000;
/// Length of train and decay, µs.
pub const DURATION_US: u32 = 1_500_000;
/// Finest interval at which the force is read, µs.
const FINEST_US: u32 = 1000;

/// A muscle under one train at full gain.
#[derive(Clone, Debug)]
pub struct Case {
    /// Pulse times, µs, ascending.
    pub pulses_us: Vec<u32>,
    /// Constants of the muscle.
    pub spec: CalciumForceSpec,
    /// True force at 0, 1, 2 … ms, N.
    truth: Vec<f64>,
    /// Largest true force, N.
    pub peak_n: f64,
}

impl Case {
    /// Solves a case with `hal_sim`'s reference.
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

    /// Returns the true force at `at_us`, N; whole ms only, up to [`DURATION_US`].
    pub fn truth_n(&self, at_us: u32) -> f64 {
        self.truth[(at_us / FINEST_US) as usize]
    }
}

/// Returns every subject at every rate, each with two trains: a regular one with a random first
/// pulse, and one whose pulses deviate by up to 45 % of a period.
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

/// Returns a train of [`TRAIN_US`] at `rate_hz` whose pulses deviate by up to 45 % of a period.
pub(super) fn jittered_train(rate_hz: f64, random: &mut Random) -> Vec<u32> {
    let period = f64::from(TRAIN_US) / rate_hz;
    let place = |i: u32| {
        let place = f64::from(i) + 0.5 + 0.9 * (random.unit_value() - 0.5);
        (place * period) as u32
    };
    (0..rate_hz as u32).map(place).collect()
}

/// Marsaglia's xorshift32 (J. Stat. Softw. 8(14), 2003).
pub(super) struct Random(pub u32);

impl Random {
    /// Returns a random number, 0…1.
    pub fn unit_value(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        f64::from(self.0 >> 8) / f64::from(1u32 << 24)
    }
}
