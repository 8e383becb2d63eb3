//! A session changes the rung of its muscle under way: nothing is refused, each
//! rung tells its force, and no change is a step.

use firmware::units::Micros;
use host_core::link::SimulatedPort;
use host_core::run::{SessionFile, run};

use crate::link_native::native_world;

const SESSION: &str = r#"
title = "Rungs under way"
duration_s = 4.0

[wearer]
rise_ms = 10

[[channel]]
number = 1
name = "one"
stage = { kind = "current", full_scale_ma = 50.0 }
limit = 20.0
train = { shape = "biphasic-cathodic-first", width_us = 200, gap_us = 50, frequency_hz = 40.0 }

[channel.muscle]
a_n_per_s = 121.9
k = 0.3
tau_c_ms = 20.8
tau1_ms = 33.1
tau2_ms = 194.4
motor_threshold = 5.0
reference = 20.0
slope_per_unit = 0.3
fatigue = {}
model = "calcium-force-fatigue"
changes = [
    { at_s = 1.5, model = "lag" },
    { at_s = 2.5, model = "static" },
    { at_s = 3.2, model = "calcium-force" },
]

[setpoints]
kind = "amplitudes"
values = [{ channel = 1, value = 18.0 }]
rate_hz = 50
"#;

/// The clock wraps while the session runs.
const BOOT: Micros = Micros::new(u32::MAX - 2_000_000);

#[test]
fn a_session_changes_rungs_without_a_step() {
    let file = SessionFile::parse("rungs.toml", SESSION).unwrap();
    let port = SimulatedPort::new(native_world(BOOT));
    let (outcome, _) = run(&file, port, None, |_| ());
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    assert_eq!(outcome.refused, 0);
    let samples = &outcome.trial.samples;
    let force = |from: f64, to: f64| -> Vec<f64> {
        let within = samples.iter().filter(|s| (from..to).contains(&s.t_s));
        within.map(|s| s.forces_n[0]).collect()
    };
    let span = |forces: &[f64]| {
        let most = forces.iter().copied().fold(0.0, f64::max);
        most - forces.iter().copied().fold(f64::MAX, f64::min)
    };
    // The train's ripple shows on the rungs that have pulses, on Lag and Static
    // none does; from Lag on the mean is reached at once.
    let ripple = span(&force(1.2, 1.5));
    let (lag, at_once) = (span(&force(2.3, 2.5)), span(&force(2.52, 3.2)));
    println!("ripple {ripple:.3} N, lag {lag:.3} N, static {at_once:.3} N");
    assert!(ripple > 0.05 && lag < 0.01 && at_once < 0.01);
    // Samples are 10 ms apart; the ripple alone moves force by half of it.
    for at in [1.5, 2.5, 3.2] {
        let around = force(at - 0.02, at + 0.04);
        let step = around.windows(2).map(|w| (w[1] - w[0]).abs());
        let step = step.fold(0.0, f64::max);
        println!("at {at} s: {step:.3} N from sample to sample");
        assert!(step < 0.15, "at {at} s: {around:?}");
    }
}
