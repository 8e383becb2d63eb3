//! Selection of muscle models by simulating the session.

use firmware::muscle::MuscleLevel;
use host_core::choice::{Effect, SEED, choose, measured_levels};
use host_core::session::{Model, Session, Share};
use std::path::Path;

const TWO: &str = r#"
title = "Two muscles"
duration_s = 8.0
wearer = { rise_ms = 200 }

[[channel]]
number = 1
name = "held"
stage = { kind = "current", full_scale_ma = 50.0 }
limit = 20.0
train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 40.0 }
[channel.muscle]
a_n_per_s = 121.9
k = 0.3
tau_c_ms = 20.8
tau1_ms = 33.1
tau2_ms = 194.4
motor_threshold = 8.0
reference = 20.0
slope_per_unit = 0.3
fatigue = {}

[[channel]]
number = 2
name = "steered"
stage = { kind = "current", full_scale_ma = 50.0 }
limit = 20.0
train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 20.0, offset_us = 5000 }
force = { max_frequency_hz = 60.0 }
[channel.muscle]
a_n_per_s = 183.1
k = 0.094
tau_c_ms = 15.9
tau1_ms = 50.2
tau2_ms = 117.9
motor_threshold = 8.0
reference = 20.0
slope_per_unit = 0.3
fatigue = {}

[setpoints]
kind = "force-sine"
channel = 2
offset_n = 8.0
amplitude_n = 3.0
frequency_hz = 0.5
rate_hz = 90
values = [{ channel = 1, value = 18.0 }]
"#;

fn two() -> Session {
    Session::parse("two.toml", TWO).unwrap()
}

/// Selects the cheapest model level within the tolerance, or the most detailed if no other is.
#[test]
fn the_cheapest_that_will_do_is_taken() {
    for tolerance in [Share(30), Share(300), Share(1_000), Share(10_000)] {
        let choice = choose(&two(), tolerance, SEED).unwrap();
        for need in &choice.needs {
            println!("{tolerance}: {need:?}");
            let within = need
                .tried
                .iter()
                .filter(|trial| trial.error() <= tolerance.fraction());
            let cheapest = within
                .map(|trial| trial.cost())
                .fold(f64::INFINITY, f64::min);
            match need.enough {
                Some(level) => {
                    let own = need
                        .tried
                        .iter()
                        .find(|trial| trial.level == level)
                        .unwrap();
                    assert_eq!(own.cost(), cheapest);
                    assert!(need.together <= tolerance.fraction());
                }
                None => assert!(need.smallest_error().0 > tolerance.fraction()),
            }
        }
    }
}

/// The error of a channel does not depend on the levels of the others, bit for bit; all channels
/// can therefore be tried at the same level at once.
#[test]
fn no_channel_s_error_depends_on_another_s_rung() {
    let session = two();
    let choice = choose(&session, Share(1), SEED).unwrap();
    for (need, place) in choice.needs.iter().zip(0..) {
        for level in measured_levels().filter(|level| *level <= MuscleLevel::CalciumForceFatigue) {
            let mut alone = session.clone();
            let muscle = alone.channels[place].muscle.as_mut().unwrap();
            muscle.model = Model::Fixed(level);
            let alone = choose(&alone, Share(1), SEED).unwrap();
            let singly = alone.needs[place].together;
            let tried = need
                .tried
                .iter()
                .find(|trial| trial.level == level)
                .unwrap();
            assert_eq!(singly.to_bits(), tried.error().to_bits(), "{level:?}");
        }
    }
}

/// Without a report and without force control, nothing depends on a muscle.
#[test]
fn what_nobody_uses_has_no_error() {
    let text = TWO.replacen("fatigue = {}", "fatigue = {}\nreport = false", 1);
    let session = Session::parse("two.toml", &text).unwrap();
    let choice = choose(&session, Share(1), SEED).unwrap();
    let need = &choice.needs[0];
    assert!(!need.uses.report && !need.uses.steering);
    assert!(need.tried.iter().all(|trial| trial.error() == 0.0));
    assert_eq!(need.enough, measured_levels().next());
}

/// Of a longer session only the first part is simulated, as long as the file configures.
#[test]
fn a_longer_session_is_tried_in_part() {
    let text = TWO.replace("duration_s = 8.0", "duration_s = 800.0");
    let text = text + "\n[fidelity]\ntolerance_percent = 50\ntry_s = 5\n";
    let mut session = Session::parse("two.toml", &text).unwrap();
    assert_eq!(
        choose(&session, Share(5_000), SEED).unwrap().tried_us,
        5_000_000
    );
    host_core::choice::resolve_auto_models(&mut session).unwrap();
    let notes = session.notes.join("\n");
    assert!(notes.contains("the first 5 s of 800 s"), "{notes}");
}

/// Within the bounds of a live client the worst case counts: holding the largest force tires the
/// muscle more than the file's own sine does.
#[test]
fn a_live_client_s_worst_counts() {
    let own = choose(&two(), Share(1_000), SEED).unwrap();
    let bounds = "values = [{ channel = 1, value = 18.0 }]\n\
                  bounds = [{ channel = 1, most = 20.0 }, { channel = 2, most = 12, per_s = 30 }]";
    let text = TWO.replace("values = [{ channel = 1, value = 18.0 }]", bounds);
    let session = Session::parse("two.toml", &text).unwrap();
    let live = choose(&session, Share(1_000), SEED).unwrap();
    assert_eq!((own.sessions, live.sessions), (1, 6));
    for (own, live) in own.needs.iter().zip(&live.needs) {
        for (own, live) in own.tried.iter().zip(&live.tried) {
            assert!(live.error() >= own.error(), "{own:?} {live:?}");
        }
    }
}

/// If only pulses matter, a run uses the models that the simulation of the session selects, even
/// for a muscle that nothing reads, and for one without pulses.
#[test]
fn a_run_takes_what_trying_finds() {
    let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions");
    let shipped = ["hamana_exp4_two_point_finger", "ten_channels_and_finger"].map(|name| {
        let text = std::fs::read_to_string(sessions.join(format!("{name}.toml"))).unwrap();
        text.replace("model = \"calcium-force\", ", "")
    });
    let unread = shipped[0].replacen(
        "slope_per_unit = 0.2",
        "slope_per_unit = 0.2, report = false",
        1,
    );
    let never = shipped[1].replacen("channel = 10, value = 10.0", "channel = 10, value = 0.0", 1);
    let mut levels = Vec::new();
    for text in shipped.iter().chain([&unread, &never]) {
        let mut session = Session::parse("it.toml", text).unwrap();
        session.try_us = 3_000_000;
        let choice = choose(&session, session.tolerance, SEED).unwrap();
        host_core::choice::resolve_auto_models(&mut session).unwrap();
        for need in choice.needs {
            let muscle = session.channels[need.place].muscle.as_ref().unwrap();
            assert_eq!(
                muscle.initial_level(),
                need.level,
                "{} {}",
                session.title,
                need.place
            );
            levels.push(need.level);
        }
    }
    let none = levels
        .iter()
        .filter(|level| **level == MuscleLevel::None)
        .count();
    assert_eq!(none, 2, "{levels:?}");
}

/// The telemetry of an arm is chosen by the force at its hand, and the error of its steps does not
/// depend on the telemetry of the session.
#[test]
fn an_arm_s_telemetry_and_steps_are_judged_by_its_force() {
    let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../sessions");
    let text = std::fs::read_to_string(sessions.join("endpoint_arm.toml")).unwrap();
    let judged = |telemetry_ms| {
        let mut session = Session::parse("arm.toml", &text).unwrap();
        (session.has_fidelity, session.telemetry_ms) = (true, telemetry_ms);
        session.try_us = 3_000_000;
        choose(&session, session.tolerance, SEED).unwrap().fidelity
    };
    let [rare, often] = [10, 1].map(judged);
    assert_eq!(rare, often);
    let errors = |tried: &[Effect]| -> Vec<f64> { tried.iter().map(|e| e.error).collect() };
    let (telemetry, steps) = (errors(&rare.telemetry), errors(&rare.arm));
    println!("telemetry {telemetry:.4?}, steps {steps:.4?}");
    assert!(telemetry.last() > Some(&0.01) && steps.last() > Some(&0.005));
}
