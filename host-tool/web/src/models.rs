//! The muscle model under a train of pulses, in the device's fixed point and exact.

use crate::error::CallError;
use firmware::muscle::{CalciumForce, CalciumForceSpec};
use hal_sim::body::muscle::Parameters;
use host_core::models::{ResponseRow, device_response, reference_response};
use serde::Deserialize;
use serde_json::{Value, json};

/// Longest response, s.
const LONGEST_S: f64 = 5.0;
/// Largest number of pulses.
const MOST_PULSES: usize = 2_000;

/// A train on a muscle.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Train {
    /// Parameters of the muscle: A in N/s, K, and τc, τ1 and τ2 in ms.
    muscle: [f64; 5],
    /// Times of the pulses, µs, rising.
    pulses_us: Vec<u64>,
    /// Length of the response, s.
    duration_s: f64,
}

/// Returns the force over time, N, every millisecond, by the device's model and by the exact
/// solution.
///
/// # Errors
/// The muscle or the train is out of range.
pub fn response(train: &Train) -> Result<Value, CallError> {
    if !(0.0..=LONGEST_S).contains(&train.duration_s) || train.pulses_us.len() > MOST_PULSES {
        return Err(CallError::new(format!(
            "E816 a train has at most {MOST_PULSES} pulses and {LONGEST_S} s"
        )));
    }
    if !train.pulses_us.is_sorted_by(|a, b| a < b) {
        return Err(CallError::new("E816 the times of the pulses must increase"));
    }
    let [a_n_per_s, k, tau_c_ms, tau1_ms, tau2_ms] = train.muscle;
    let scaled = |value: f64, factor: f64| (value * factor).round() as u32; // saturates
    let spec = CalciumForceSpec {
        a_mn_per_s: scaled(a_n_per_s, 1e3),
        k_micro: scaled(k, 1e6),
        tau_c_us: scaled(tau_c_ms, 1e3),
        tau1_us: scaled(tau1_ms, 1e3),
        tau2_us: scaled(tau2_ms, 1e3),
    };
    let muscle = CalciumForce::new(spec).map_err(CallError::new)?;
    let parameters = Parameters {
        a_n_per_s,
        k,
        tau_c_s: tau_c_ms * 1e-3,
        tau1_s: tau1_ms * 1e-3,
        tau2_s: tau2_ms * 1e-3,
    };
    let duration_us = (train.duration_s * 1e6).round() as u64; // at most 5e6
    let times_s: Vec<f64> = train.pulses_us.iter().map(|at| *at as f64 / 1e6).collect();
    let ours = device_response(&muscle, &train.pulses_us, duration_us, 1_000);
    let exact = reference_response(&parameters, &times_s, train.duration_s, 1e-3);
    let column = |rows: &[ResponseRow], value: fn(&ResponseRow) -> f64| {
        rows.iter().map(value).collect::<Vec<f64>>()
    };
    Ok(json!({
        "t_s": column(&ours, |row| row.t_s),
        "device_n": column(&ours, |row| row.force_n),
        "exact_n": column(&exact, |row| row.force_n),
    }))
}
