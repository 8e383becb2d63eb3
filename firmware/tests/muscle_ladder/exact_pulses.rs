//! Pulses at exact microseconds over long times and at the highest rates.

use super::twins::{self, FatigueMode, Muscle, Pulse};
use super::{error_pct, peak, spec, subjects};
use firmware::muscle::{CalciumForce, CalciumForceSpec, CalciumForceState, Gain};
use firmware::units::{Micros, us};

/// 60 s before the 32-bit clock wraps.
const BEFORE_WRAP: Micros = Micros::new(u32::MAX - 60_000_000);

const LSB: f64 = 1.0 / 65_536.0;

/// Muscle and its state, advanced in ticks of 1 ms.
struct MuscleRun {
    muscle: CalciumForce,
    state: CalciumForceState,
}

impl MuscleRun {
    fn new(spec: CalciumForceSpec) -> Self {
        Self {
            muscle: CalciumForce::new(spec).unwrap(),
            state: CalciumForceState::at_rest(BEFORE_WRAP),
        }
    }

    /// Returns the forces at the end of each of `ms` ticks, in the model's own unit. `pulses` are
    /// in µs from now; each reaches the model in its own tick.
    fn run(&mut self, pulses: &[u64], ms: u64) -> Vec<i32> {
        let start = self.state.at();
        let mut pulses = pulses.iter().peekable();
        let tick = |tick: u64| {
            while let Some(&at) = pulses.next_if(|at| **at <= tick * 1000) {
                let at = start + us(at as u32);
                self.muscle.pulse(&mut self.state, at, Gain::FULL);
            }
            let now = start + us((tick * 1000) as u32);
            self.muscle.advance(&mut self.state, now);
            self.muscle.force(&self.state).get().to_bits()
        };
        (1..=ms).map(tick).collect()
    }
}

/// Returns 1 s of pulses at `hz`, the first at `phase` µs.
fn second(hz: u64, phase: u64) -> Vec<u64> {
    (0..hz).map(|i| phase + i * 1_000_000 / hz).collect()
}

/// 1 s on, 1 s off, for ten minutes across the clock's wrap. The reference has the same force left
/// from the second before; beyond that, no cycle differs from the first by more than one unit of
/// force.
#[test]
fn ten_minutes_of_on_and_off_do_not_drift() {
    const RATES: [(u64, u64); 7] = [
        (10, 137),
        (13, 481),
        (20, 999),
        (33, 1),
        (40, 333),
        (71, 617),
        (100, 853),
    ];
    let (mut drift, mut error, mut left) = (0f64, 0f64, 0f64);
    for (name, m) in subjects() {
        for (hz, phase) in RATES {
            let pulses = second(hz, phase);
            let mut fed = MuscleRun::new(spec(&m));
            let first = fed.run(&pulses, 2000);
            let train: Vec<Pulse> = [0, 2_000_000]
                .iter()
                .flat_map(|start| pulses.iter().map(move |at| (start + at, 1.0)))
                .collect();
            let (truth, _) = twins::tiring(&m, FatigueMode::Never, &train, 4000);
            let newtons: Vec<f64> = first.iter().map(|&bits| f64::from(bits) * LSB).collect();
            error = error.max(error_pct(&truth[1..=2000], &newtons));
            // Force left from the second before, in units of the force.
            let residual: Vec<f64> = (1..=2000)
                .map(|i| (truth[i + 2000] - truth[i]) / LSB)
                .collect();
            left = residual.iter().copied().fold(left, f64::max);
            for cycle in 1..300 {
                let now = fed.run(&pulses, 2000);
                for (i, (a, b)) in first.iter().zip(&now).enumerate() {
                    let off = (f64::from(b - a) - residual[i]).abs();
                    assert!(
                        off <= 1.5,
                        "{name} {hz} Hz, cycle {cycle}, {i} ms: {off} units"
                    );
                    drift = drift.max(off);
                }
            }
            let last: Vec<f64> = fed
                .run(&pulses, 2000)
                .iter()
                .map(|&bits| f64::from(bits) * LSB)
                .collect();
            error = error.max(error_pct(&truth[2001..=4000], &last));
        }
    }
    println!(
        "300 cycles: at most {drift:.2} units from the first; {error:.4} % of peak off the reference; \
         the reference itself keeps up to {left:.1} units over the pause"
    );
    assert!(error <= 0.02, "{error} %");
}

/// The densest bursts of the scheduler, 8 pulses 200 µs apart, 200 times per second. C saturates
/// where that of the slowest muscle would exceed 24.
#[test]
fn the_densest_bursts_stay_in_range() {
    let pulses: Vec<u64> = (0..400)
        .flat_map(|burst| (0..8).map(move |i| burst * 5000 + 137 + i * 200))
        .collect();
    let reference: Vec<Pulse> = pulses.iter().map(|&at| (at, 1.0)).collect();
    let mut worst = 0f64;
    for (name, m) in subjects() {
        let mut fed = MuscleRun::new(spec(&m));
        let forces = fed.run(&pulses, 2000);
        let (truth, _) = twins::tiring(&m, FatigueMode::Never, &reference, 2000);
        let forces: Vec<f64> = forces.iter().map(|&bits| f64::from(bits) * LSB).collect();
        let error = error_pct(&truth[1..], &forces);
        println!(
            "{name}: 1600 pulses a second, {error:.3} % of {:.2} N",
            peak(&truth)
        );
        worst = worst.max(error);
        rests(&mut fed, &name);
    }
    assert!(worst < 1.5, "{worst} %");
    // The ends of every range, with K at both of its ends.
    for k in [0.002, 5.0] {
        let slowest = Muscle {
            a: 10_000.0,
            k,
            tau_c: 0.1,
            tau1: 0.2,
            tau2: 1.0,
        };
        let mut fed = MuscleRun::new(spec(&slowest));
        for &force in &fed.run(&pulses, 2000) {
            assert!(force >= 0 && f64::from(force) * LSB <= 12_000.0);
        }
        assert!(fed.muscle.calcium(&fed.state) <= 25);
        rests(&mut fed, "slowest");
    }
}

/// Checks that force reaches exactly zero and stays there.
fn rests(fed: &mut MuscleRun, name: &str) {
    let tail = fed.run(&[], 8000);
    assert_eq!(tail.last(), Some(&0), "{name}");
    assert!(fed.state.is_at_rest(), "{name}");
}
