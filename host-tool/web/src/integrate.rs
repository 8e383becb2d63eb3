//! Force of a muscle by one integrator of the accuracy–speed chart, beside the exact one.

use crate::error::CallError;
use firmware::muscle::CalciumForceSpec;
use firmware::units::Micros;
use hal_sim::body::muscle::SUBJECTS;
use hal_sim::body::muscle::reference::integrate as integrate_exactly;
use methods::muscle::{Integrator, Method, Number, Reading, Setting};
use serde::Deserialize;
use serde_json::{Value, json};

/// Length of the train and of the run, ms.
const TRAIN_MS: u32 = 1_000;
const RUN_MS: u32 = 1_500;

/// A setting of the chart, by the names of its table, and the muscle and train that it integrates.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Integration {
    method: String,
    arithmetic: String,
    reading: String,
    /// Length of a step, µs; none for a method that goes from pulse to pulse.
    step_us: Option<u32>,
    /// Interval of reading, ms.
    output_ms: u32,
    /// Subject of Lee 2020, table 4, from 1.
    subject: usize,
    /// Pulse rate, Hz.
    rate_hz: u32,
}

/// The module, which has no state.
#[cfg(not(feature = "sessions"))]
#[derive(Default)]
pub struct Page;

#[cfg(not(feature = "sessions"))]
impl Page {
    /// Carries out a request, which is an [`Integration`] as JSON.
    ///
    /// # Errors
    /// The request is not valid, or is refused.
    pub fn answer(&mut self, request: &[u8]) -> Result<Vec<u8>, CallError> {
        let asked: Integration = serde_json::from_slice(request).map_err(CallError::new)?;
        integrate(&asked).map(|value| value.to_string().into_bytes())
    }
}

/// Returns the forces at the readings, N, by the integrator and exact, and the largest error in
/// percent of the peak.
///
/// # Errors
/// A name is unknown, or a number is out of range.
pub fn integrate(asked: &Integration) -> Result<Value, CallError> {
    let setting = setting(asked)?;
    let subject = SUBJECTS.get(asked.subject.wrapping_sub(1));
    let subject = subject.ok_or_else(|| out_of_range("the subject", "1 to 10"))?;
    if !(1..=100).contains(&asked.output_ms) {
        return Err(out_of_range("the interval of reading", "1 to 100 ms"));
    }
    if !(5..=100).contains(&asked.rate_hz) {
        return Err(out_of_range("the pulse rate", "5 to 100 Hz"));
    }
    let scaled = |value: f64, factor: f64| (value * factor).round() as u32;
    let spec = CalciumForceSpec {
        a_mn_per_s: scaled(subject.a_n_per_s, 1e3),
        k_micro: scaled(subject.k, 1e6),
        tau_c_us: scaled(subject.tau_c_s, 1e6),
        tau1_us: scaled(subject.tau1_s, 1e6),
        tau2_us: scaled(subject.tau2_s, 1e6),
    };
    let count = asked.rate_hz * TRAIN_MS / 1_000;
    let pulses_us: Vec<u32> = (0..count).map(|i| i * 1_000_000 / asked.rate_hz).collect();
    let times_ms = || (asked.output_ms..=RUN_MS).step_by(asked.output_ms as usize);
    let forces = setting.with_integrator(&spec, |muscle| {
        read(muscle, &pulses_us, times_ms().map(|ms| ms * 1_000))
    });
    let forces = forces.map_err(CallError::new)?;
    let pulses_s: Vec<f64> = pulses_us.iter().map(|us| f64::from(*us) / 1e6).collect();
    let exact = integrate_exactly(subject, &pulses_s, f64::from(RUN_MS) / 1e3, 1e-3);
    let truth: Vec<f64> = times_ms()
        .filter_map(|ms| exact.get(ms as usize).map(|sample| sample.force_n))
        .collect();
    let peak = exact
        .iter()
        .map(|sample| sample.force_n)
        .fold(0.0, f64::max);
    let worst = forces
        .iter()
        .zip(&truth)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    Ok(json!({
        "t_s": times_ms().map(|ms| f64::from(ms) / 1e3).collect::<Vec<_>>(),
        "force_n": forces,
        "exact_n": truth,
        "error_pct": worst / peak * 100.0,
    }))
}

fn read(
    muscle: &mut dyn Integrator,
    pulses_us: &[u32],
    times_us: impl Iterator<Item = u32>,
) -> Vec<f64> {
    let mut pulses = pulses_us.iter().peekable();
    let forces = times_us.map(|at_us| {
        while let Some(pulse_us) = pulses.next_if(|us| **us <= at_us) {
            muscle.pulse(Micros::new(*pulse_us));
        }
        muscle.advance(Micros::new(at_us));
        muscle.force_n()
    });
    forces.collect()
}

fn setting(asked: &Integration) -> Result<Setting, CallError> {
    let mut methods = Method::ALL
        .into_iter()
        .chain([Method::Segments, Method::Shipped]);
    let method = methods.find(|method| method.name() == asked.method);
    let method = method.ok_or_else(|| unknown("method", &asked.method))?;
    let mut numbers = Number::GENERIC.into_iter().chain([Number::Device]);
    let number = numbers.find(|number| number.name() == asked.arithmetic);
    let number = number.ok_or_else(|| unknown("arithmetic", &asked.arithmetic))?;
    let mut readings = [Reading::Steps, Reading::Cubic, Reading::Demand].into_iter();
    let reading = readings.find(|reading| reading.name() == asked.reading);
    let reading = reading.ok_or_else(|| unknown("kind of reading", &asked.reading))?;
    let step_us = asked.step_us.unwrap_or(Setting::WHOLE_US);
    let setting = Setting {
        method,
        number,
        step_us,
        reading,
    };
    let is_compared = Setting::all(asked.output_ms * 1_000).any(|known| known == setting);
    match is_compared {
        true => Ok(setting),
        false => Err(CallError::new("E816 the chart has no such setting")),
    }
}

fn unknown(kind: &str, name: &str) -> CallError {
    CallError::new(format!("E816 there is no {kind} {name:?}"))
}

fn out_of_range(quantity: &str, allowed: &str) -> CallError {
    CallError::new(format!(
        "E816 {quantity} is out of range; allowed: {allowed}"
    ))
}
