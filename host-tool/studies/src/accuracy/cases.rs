//! The trains that integrators are judged on, and the truth of each.

use crate::subjects::spec;
use firmware::muscle::CalciumForceSpec;
use hal_sim::body::muscle::SUBJECTS;
use hal_sim::body::muscle::reference::integrate;

/// Pulse rates, Hz.
pub const RATES_HZ: [u32; 7] = [10, 20, 30, 40, 50, 70, 100];

/// A train lasts so long, µs.
const TRAIN_US: u32 = 1_000_000;
/// Train and decay, µs.
pub const DURATION_US: u32 = 1_500_000;
/// The finest times at which a force is asked for, µs.
const FINEST_US: u32 = 1000;

/// A subject of Lee's table 4 under one train at full gain.
#[derive(Clone, Debug)]
pub struct Case {
    /// 0 is K01.
    pub subject: usize,
    /// Pulses per second.
    pub rate_hz: u32,
    /// Pulse times, µs, ascending.
    pub pulses_us: Vec<u32>,
    /// The muscle.
    pub spec: CalciumForceSpec,
    /// True force at 0, 1, 2 … ms, N.
    truth: Vec<f64>,
    /// Its largest, N.
    pub peak_n: f64,
}

impl Case {
    /// Solves a case with `hal_sim`'s reference.
    pub fn new(subject: usize, rate_hz: u32, pulses_us: Vec<u32>) -> Self {
        let parameters = SUBJECTS[subject];
        let pulses_s: Vec<f64> = pulses_us.iter().map(|us| f64::from(*us) * 1e-6).collect();
        let seconds = |us: u32| f64::from(us) * 1e-6;
        let samples = integrate(
            &parameters,
            &pulses_s,
            seconds(DURATION_US),
            seconds(FINEST_US),
        );
        let truth: Vec<f64> = samples.iter().map(|s| s.force_n).collect();
        Self {
            subject,
            rate_hz,
            pulses_us,
            spec: spec(&parameters),
            peak_n: truth.iter().copied().fold(0.0, f64::max),
            truth,
        }
    }

    /// True force, N, at `at_us`, a whole number of ms up to [`DURATION_US`].
    pub fn truth_n(&self, at_us: u32) -> f64 {
        self.truth[(at_us / FINEST_US) as usize]
    }
}

/// Every subject at every rate, each with two trains: regular from an
/// arbitrary first pulse on, and every pulse up to 45 % of a period off its
/// place.
pub fn all() -> Vec<Case> {
    let mut random = Random(0x9E37_79B9);
    let mut cases = vec![];
    for subject in 0..SUBJECTS.len() {
        for rate_hz in RATES_HZ {
            let period = f64::from(TRAIN_US) / f64::from(rate_hz);
            let phase = random.part();
            let regular = (0..rate_hz).map(|i| ((f64::from(i) + phase) * period) as u32);
            cases.push(Case::new(subject, rate_hz, regular.collect()));
            let scattered = (0..rate_hz).map(|i| {
                let place = f64::from(i) + 0.5 + 0.9 * (random.part() - 0.5);
                (place * period) as u32
            });
            cases.push(Case::new(subject, rate_hz, scattered.collect()));
        }
    }
    cases
}

/// Marsaglia's xorshift32 (J. Stat. Softw. 8(14), 2003).
struct Random(u32);

impl Random {
    /// 0…1.
    fn part(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        f64::from(self.0 >> 8) / f64::from(1u32 << 24)
    }
}
