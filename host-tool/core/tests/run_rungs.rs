//! A session changes the model level of its muscle while it runs: nothing is refused, each level
//! reports its own predicted force, and no change causes a step in force.

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
    { at_s = 1.5, model = "calcium-force" },
    { at_s = 2.5, model = "none" },
    { at_s = 3.2, model = "calcium-force-fatigue" },
]

[setpoints]
kind = "amplitudes"
values = [{ channel = 1, value = 18.0 }]
rate_hz = 50
"#;

/// The clock wraps while the session runs.
const BOOT: Micros = Micros::new(u32::MAX - 2_000_000);

#[test]
fn a_session_changes_rungs() {
    let file = SessionFile::parse("rungs.toml", SESSION).unwrap();
    let port = SimulatedPort::new(native_world(BOOT));
    let (outcome, _) = run(&file, port, None, |_| ());
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    assert_eq!(outcome.refused, 0);
    let samples = &outcome.trial.samples;
    let force = |from: f64, to: f64| -> Vec<Option<f64>> {
        let within = samples.iter().filter(|s| (from..to).contains(&s.t_s));
        within.map(|s| s.forces_n[0]).collect()
    };
    // Samples are 10 ms apart, and ripple alone changes the force by half of the limit.
    let around: Vec<f64> = force(1.48, 1.54).into_iter().map(Option::unwrap).collect();
    let step = around.windows(2).map(|w| (w[1] - w[0]).abs());
    let step = step.fold(0.0, f64::max);
    println!("at 1.5 s: {step:.3} N from sample to sample");
    assert!(step < 0.15, "{around:?}");
    assert!(force(2.53, 3.19).iter().all(Option::is_none));
    // The muscle starts from rest and reaches the same force again.
    let (begun, held) = (force(3.22, 3.24), force(3.9, 4.0));
    let before = force(2.4, 2.49)[0].unwrap();
    assert!(begun[0].unwrap() < 0.5 * before, "{begun:?}");
    assert!((held[0].unwrap() / before - 1.0).abs() < 0.1, "{held:?}");
}
