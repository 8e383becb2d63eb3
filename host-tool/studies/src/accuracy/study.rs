//! Errors of an earlier study in f64, and ours in the same cases: ten subjects at 20, 30 and 40 Hz,
//! pulses from time 0 on.

use super::cases::{Case, DURATION_US};
use super::errors::run_error_pct;
use hal_sim::body::muscle::reference::train;
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use methods::muscle::{Method, Number, Setting};

/// Time span of the pulses of a train, µs. The study read the force of event-driven methods only
/// until its end.
const TRAIN_US: u32 = 1_000_000;

/// Largest error of one method with one step, in the earlier study and in ours.
#[derive(Clone, Copy, Debug)]
pub struct MethodError {
    pub method: Method,
    /// Integration step, µs; for event-driven methods [`Setting::WHOLE_US`].
    pub step_us: u32,
    /// Largest error in the earlier study, % of the peak force; infinite if the method diverged.
    pub study_pct: f64,
    /// Largest error in our implementation, % of the peak force; infinite if it diverges.
    pub error_pct: f64,
}

const WHOLE: u32 = Setting::WHOLE_US;

/// Results of the earlier study: method, step in µs, and largest error in % of the peak force,
/// infinite if the method diverged.
const STUDY: [(Method, u32, f64); 24] = [
    (Method::Euler, 1000, 7.9),
    (Method::Euler, 5000, 46.0),
    (Method::Euler, 20_000, f64::INFINITY),
    (Method::Heun, 1000, 0.18),
    (Method::Heun, 5000, 5.0),
    (Method::Heun, 20_000, f64::INFINITY),
    (Method::RungeKutta4, 1000, 3e-5),
    (Method::RungeKutta4, 5000, 0.023),
    (Method::RungeKutta4, 20_000, f64::INFINITY),
    (Method::Etd1, 1000, 1.9),
    (Method::Etd1, 5000, 9.7),
    (Method::Etd1, 20_000, 41.0),
    (Method::EtdMidpoint, 1000, 0.011),
    (Method::EtdMidpoint, 5000, 0.27),
    (Method::EtdMidpoint, 20_000, 4.1),
    (Method::GaussExponential, 1000, 2e-7),
    (Method::GaussExponential, 5000, 1e-4),
    (Method::GaussExponential, 20_000, 0.032),
    (Method::LogTable, 1000, 0.018),
    (Method::LogTable, 5000, 0.022),
    (Method::LogTable, 20_000, 0.024),
    (Method::EventDriven2, WHOLE, 0.38),
    (Method::EventDriven3, WHOLE, 0.032),
    (Method::EventDriven4, WHOLE, 0.0023),
];

/// Repeats every row of the earlier study with our implementation. Forces are read every 10 ms, or
/// every 20 ms if the step is 20 ms.
pub fn rerun_study() -> Vec<MethodError> {
    let cases = thirty_cases();
    let found = |(method, step_us, study_pct)| MethodError {
        method,
        step_us,
        study_pct,
        error_pct: worst(&cases, method, step_us),
    };
    STUDY.into_iter().map(found).collect()
}

fn thirty_cases() -> Vec<Case> {
    let case = |subject: &Parameters, hz: u32| {
        let pulses_s = train(f64::from(hz), hz).into_iter();
        let pulses_us = pulses_s.map(|s| (s * 1e6).round() as u32);
        Case::new(subject, pulses_us.collect())
    };
    let rates = |subject| [20, 30, 40].map(|hz| case(subject, hz));
    SUBJECTS.iter().flat_map(rates).collect()
}

fn worst(cases: &[Case], method: Method, step_us: u32) -> f64 {
    let setting = Setting::new(method, Number::F64, step_us);
    let until_us = match method.is_event_driven() {
        true => TRAIN_US,
        false => DURATION_US,
    };
    let output_us = if step_us == 20_000 { step_us } else { 10_000 };
    let error = |case: &Case| {
        setting
            .with_integrator(&case.spec, |m| run_error_pct(case, m, output_us, until_us))
            .unwrap_or(f64::INFINITY)
    };
    cases.iter().map(error).fold(0.0, f64::max)
}
