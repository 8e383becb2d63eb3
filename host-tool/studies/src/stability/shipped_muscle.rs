//! Map of the error of the shipped muscle model over K, τ1 and pulse rate, and of the muscles that
//! the device refuses.

use super::pulse_rate::{shifted_pulses_us, shipped_error};
use super::{Axis, Cell, Class, Declaration, Layout, Map, Panel};
use hal_sim::body::muscle::Parameters;

/// K of the rows: the range that the device accepts.
const K: [f64; 11] = [0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0];
/// τ1 of the columns, ms: the range that the device accepts.
const TAU1_MS: [f64; 12] = [
    2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 50.0, 80.0, 120.0, 200.0,
];
/// τ2 of the panels, ms: about that of the mean subject, and the largest that the device accepts.
const TAU2_MS: [f64; 2] = [130.0, 1000.0];
/// Pulse rates of the panels, Hz.
const RATES_HZ: [f64; 4] = [5.0, 20.0, 50.0, 200.0];
/// Decay of calcium, ms: about that of the mean subject.
const TAU_C_MS: f64 = 20.0;
/// Largest force scaling factor that the device accepts, N/s; the resolution of the model's answer
/// is then no part of the error.
const A_N_PER_S: f64 = 10_000.0;
/// Largest deviation of a pulse from its regular time, as a fraction of the period.
const JITTER: f64 = 0.45;
/// Time of a run, s.
const DURATION_S: f64 = 1.5;
/// Time between two readings, µs.
const READ_US: u32 = 1000;

const CLASSES: [Class; 5] = [
    Class::new('.', 0.005, "up to 0.005 %", 0),
    Class::new('1', 0.02, "up to 0.02 %", 0),
    Class::new('2', 0.1, "up to 0.1 %", 1),
    Class::new('X', 1e6, "more", 1),
    Class::new('r', f64::INFINITY, "the device refuses the muscle", 1),
];

/// Declares the map; `seed` determines the deviations of the pulses.
pub fn declare(seed: u64) -> Declaration {
    let panels: Vec<(f64, f64)> = TAU2_MS
        .into_iter()
        .flat_map(|tau2_ms| RATES_HZ.map(|rate_hz| (tau2_ms, rate_hz)))
        .collect();
    let title = |(tau2_ms, rate_hz): &(f64, f64)| format!("τ2 {tau2_ms} ms, {rate_hz} Hz");
    let map = Map {
        name: "shipped_muscle",
        title: "The shipped muscle model: error over K, τ1 and pulse rate",
        across: Axis::new("τ1", "ms", &TAU1_MS, f64::to_string),
        down: Axis::new("K", "", &K, f64::to_string),
        quantity: "worst error, % of the train's peak",
        classes: &CLASSES,
        panels: panels.iter().map(title).map(Panel::blank).collect(),
        layout: Layout::Beside(2),
        theory: "the device refuses a muscle with K τ1/(τ1 + τ2) below 2e-5 pulses, for which its \
                 words have too few levels of calcium, or with 25 τ1 + 15 τ2 below 70 ms; all \
                 others must stay within 0.02 %.",
        notes: vec![
            "τc 20 ms, A 10,000 N/s; trains of 1 s with every pulse shifted by up to 45 % of a \
             period, then 0.5 s of rest, read every 1 ms, against the exact solution."
                .to_owned(),
        ],
    };
    Declaration {
        map,
        simulate: Box::new(move |at| {
            let (tau2_ms, rate_hz) = panels[at.panel];
            let p = Parameters {
                a_n_per_s: A_N_PER_S,
                k: K[at.row],
                tau_c_s: TAU_C_MS * 1e-3,
                tau1_s: TAU1_MS[at.column] * 1e-3,
                tau2_s: tau2_ms * 1e-3,
            };
            Cell::with_verdict(
                &CLASSES,
                error(&p, rate_hz, seed),
                Some(u8::from(is_refused(&p))),
            )
        }),
    }
}

/// Returns whether the device refuses the muscle, by the formula of the map.
fn is_refused(p: &Parameters) -> bool {
    let levels = p.k * p.tau1_s / (p.tau1_s + p.tau2_s);
    levels < 2e-5 || 25.0 * p.tau1_s + 15.0 * p.tau2_s < 0.07
}

/// Returns the largest error on a train, % of its peak; infinite if the device refuses the muscle.
fn error(p: &Parameters, rate_hz: f64, seed: u64) -> f64 {
    let pulses_us = shifted_pulses_us(rate_hz, JITTER, seed);
    let error = shipped_error(p, (&pulses_us, &pulses_us), READ_US, DURATION_S);
    error.unwrap_or(f64::INFINITY)
}
