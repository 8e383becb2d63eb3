//! The model levels against their f64 counterparts, and changes of level.
//!
//! `cargo test -p firmware --test suite muscle_ladder -- --nocapture` prints every error.

mod against_twins;
mod exact_pulses;
mod switching;
pub mod twins;

use firmware::muscle::{
    CalciumForceSpec, FatigueSpec, Gain, Model, MuscleLevel, MuscleModel, MuscleModelState,
};
use firmware::units::{Micros, us};
use twins::{Muscle, Pulse};

const TABLE_4: &str = include_str!("../../../tests/golden/lee2020/table4_force_model.csv");

/// Start time of runs, so that the 32-bit clock wraps within them.
pub const START: Micros = Micros::new(u32::MAX - 400_000);

/// Returns Lee's ten subjects with their names.
pub fn subjects() -> Vec<(String, Muscle)> {
    let rows = TABLE_4.lines().skip(1).map(|row| {
        let mut cells = row.split(',');
        let name = cells.next().unwrap().to_owned();
        let mut next = |unit: f64| cells.next().unwrap().parse::<f64>().unwrap() * unit;
        let muscle = Muscle {
            a: next(1.0),
            k: next(1.0),
            tau_c: next(1e-3),
            tau1: next(1e-3),
            tau2: next(1e-3),
        };
        (name, muscle)
    });
    rows.collect()
}

/// Returns the device's parameters of a muscle.
pub fn spec(m: &Muscle) -> CalciumForceSpec {
    let rounded = |value: f64, unit: f64| (value / unit).round() as u32;
    CalciumForceSpec {
        a_mn_per_s: rounded(m.a, 1e-3),
        k_micro: rounded(m.k, 1e-6),
        tau_c_us: rounded(m.tau_c, 1e-6),
        tau1_us: rounded(m.tau1, 1e-6),
        tau2_us: rounded(m.tau2, 1e-6),
    }
}

/// Returns the muscle at a model level, with the quadriceps' fatigue.
pub fn ladder(m: &Muscle, level: MuscleLevel) -> MuscleModel {
    let spec = spec(m);
    MuscleModel::new(spec, Some(FatigueSpec::scaled_to(spec.a_mn_per_s)), level).unwrap()
}

/// Returns pulses at `hz` from `from_ms` until `to_ms` with full gain.
pub fn train(hz: f64, from_ms: u64, to_ms: u64) -> Vec<Pulse> {
    let count = (hz * (to_ms - from_ms) as f64 * 1e-3 - 1e-9).ceil() as u64;
    let at = |i: u64| from_ms * 1000 + (i as f64 * 1e6 / hz).round() as u64;
    (0..count).map(|i| (at(i), 1.0)).collect()
}

/// Returns the force in N.
pub fn newtons(ladder: &MuscleModel, state: &MuscleModelState) -> f64 {
    ladder.force(state).get().to_num()
}

/// Returns the force every millisecond, from ticks of 1 ms; `callback` gets the state first.
pub fn run(
    ladder: &MuscleModel,
    pulses: &[Pulse],
    ms: u64,
    mut callback: impl FnMut(u64, &mut MuscleModelState),
) -> Vec<f64> {
    let mut state = ladder.at_rest(START);
    let mut pulses = pulses.iter().peekable();
    let mut samples = vec![];
    for tick in 0..=ms {
        let now = START + us((tick * 1000) as u32);
        while let Some((at, gain)) = pulses.next_if(|p| p.0 <= tick * 1000) {
            let gain = Gain::new(fixed::types::U1F31::from_num(*gain));
            ladder.pulse(&mut state, START + us(*at as u32), gain);
        }
        ladder.advance(&mut state, now);
        callback(tick, &mut state);
        samples.push(newtons(ladder, &state));
    }
    samples
}

pub fn peak(samples: &[f64]) -> f64 {
    samples.iter().copied().fold(0.0, f64::max)
}

/// Returns the worst difference over the peak of `truth`, %.
pub fn error_pct(truth: &[f64], model: &[f64]) -> f64 {
    assert_eq!(truth.len(), model.len());
    let worst = truth.iter().zip(model).map(|(t, m)| (t - m).abs());
    worst.fold(0.0, f64::max) / peak(truth) * 100.0
}

/// Returns the root mean square difference over the peak of `truth`, %.
pub fn rms_pct(truth: &[f64], model: &[f64]) -> f64 {
    assert_eq!(truth.len(), model.len());
    let sum: f64 = truth.iter().zip(model).map(|(t, m)| (t - m).powi(2)).sum();
    (sum / truth.len() as f64).sqrt() / peak(truth) * 100.0
}

/// Returns pulses whose rate oscillates between `low` and `high` Hz, at `swing_hz`.
pub fn modulated(low: f64, high: f64, swing_hz: f64, ms: u64) -> Vec<Pulse> {
    let (mut t, mut pulses) = (0.0, vec![]);
    while t < ms as f64 * 1e-3 {
        pulses.push(((t * 1e6) as u64, 1.0));
        let turn = (std::f64::consts::TAU * swing_hz * t).sin();
        t += 1.0 / ((low + high) / 2.0 + (high - low) / 2.0 * turn);
    }
    pulses
}
