//! Sessions longer than the range of 32-bit microseconds: signed differences overflow after 35.8
//! minutes, and the device's clock after 71.6 minutes.

use firmware::units::Micros;
use hal_sim::native::native_seeded;
use host_core::link::{Port, SimulatedPort};
use host_core::record::{self, Recorder, Run, Trial};
use host_core::run::{
    DeviceName, FullestPeriod, Outputs, SessionFile, begin_trial, edges_of_one_period, run,
    run_with_outputs, simulated_port,
};
use std::path::{Path, PathBuf};

/// Returns a session with one channel that pulses every two seconds, and setpoints at the lowest
/// rate.
fn cheap(minutes: u32) -> SessionFile {
    let text = format!(
        r#"title = "{minutes} minutes"
duration_s = {}.0

[wearer]
host_timeout_ms = 1000
rise_ms = 1
max_session_s = 86400

[[channel]]
number = 1
name = "flexor"
stage = {{ kind = "current", full_scale_ma = 100.0 }}
limit = 15.0
train = {{ shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 0.5, offset_us = 1234 }}

[setpoints]
kind = "amplitudes"
values = [{{ channel = 1, value = 8.123 }}]
rate_hz = 2
"#,
        minutes * 60
    );
    let mut file = SessionFile::parse("cheap.toml", &text).unwrap();
    file.session.telemetry_ms = 500;
    file
}

/// Returns a native device that boots `before_us` before its clock wraps.
fn booted(file: &SessionFile, before_us: u32) -> SimulatedPort {
    let boot = Micros::new(before_us.wrapping_neg());
    simulated_port(&file.session, 1, Box::new(native_seeded(boot, 1)), boot).unwrap()
}

fn folder(name: &str) -> PathBuf {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("long")
        .join(name);
    let _ = std::fs::remove_dir_all(&out);
    out
}

/// Records `file` on the device behind `port`; returns the trial as read back.
fn recorded(file: &SessionFile, port: impl Port, name: &str) -> Trial {
    let out = folder(name);
    record::write_run(&out, &Run::default()).unwrap();
    let mut recorder = Recorder::create(&out, 0, &begin_trial(file)).unwrap();
    let mut fullest = FullestPeriod::new(&file.session, file.session.duration_us / 2);
    let (outcome, port) = run_with_outputs(file, port, Some(&mut recorder), |_| (), &mut fullest);
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    let left = port.unwrap().world().unwrap().recorder.trace.levels.len();
    assert_eq!(left, 0, "the world keeps nothing of what was taken");
    let trial = &outcome.trial;
    recorder.record_edges(&fullest.into_edges()).unwrap();
    recorder.finish(&trial.counters, trial.duration_s).unwrap();
    let mut run = record::load(&out).unwrap();
    assert_eq!(run.trials[0].samples, trial.samples);
    assert_eq!(run.trials[0].events, trial.events);
    run.trials.remove(0)
}

/// Checks that the trial has a sample for every time from start to end, and no others.
fn is_whole(trial: &Trial, minutes: u32) {
    let end_s = f64::from(minutes * 60);
    let times: Vec<f64> = trial.samples.iter().map(|sample| sample.t_s).collect();
    let (first, last) = (times[0], times[times.len() - 1]);
    assert!((0.0..0.6).contains(&first), "{first}");
    assert!(last >= end_s - 0.5 && last < end_s + 1.0, "{last}");
    for pair in times.windows(2) {
        let step_s = pair[1] - pair[0];
        assert!((step_s - 0.5).abs() < 1e-6, "{step_s} s at {}", pair[0]);
    }
    // The only event is the stop at the end.
    assert!(!trial.events.is_empty());
    for (t_s, event) in &trial.events {
        assert!((end_s..end_s + 1.0).contains(t_s), "{event} at {t_s} s");
    }
    // There is a pulse every two seconds, the first at once.
    let pulses = trial.pulses.unwrap();
    assert_eq!(pulses, u64::from(minutes) * 30 + 1);
    let states: Vec<u64> = trial.edges.iter().map(|edge| edge.t_us).collect();
    assert!(!states.is_empty());
    assert!(states.is_sorted() && states[0] == 1234, "{states:?}");
}

#[test]
fn thirty_six_minutes_are_recorded_whole() {
    let file = cheap(36);
    is_whole(&recorded(&file, booted(&file, 0), "36"), 36);
}

/// The device's clock wraps one second after boot, and a second time later.
#[test]
fn seventy_two_minutes_over_two_wraps_are_recorded_whole() {
    let file = cheap(72);
    is_whole(&recorded(&file, booted(&file, 1_000_000), "72"), 72);
}

/// A device that boots shortly before its clock wraps behaves and records as any other does.
#[test]
fn the_wrap_changes_nothing() {
    let mut file = cheap(1);
    file.session.telemetry_ms = 20;
    let trial = |before_us| {
        let trial = run(&file, booted(&file, before_us), None, |_| ()).0.trial;
        (trial.samples, trial.events, trial.pulses)
    };
    let far = trial(100_000_000);
    for before_us in [30_000_000, 2_000_000, 1_000_000, 500_000, 100_000] {
        assert!(trial(before_us) == far, "{before_us}");
    }
}

/// A whole trace and the same trace in pieces have the same fullest period.
#[test]
fn the_fullest_period_is_the_same_taken_in_pieces() {
    let mut file = SessionFile::load(Path::new("../sessions/ten_channels.toml")).unwrap();
    file.session.duration_us = 3_000_000;
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let (outcome, port) = run(&file, port, None, |_| ());
    let (mut port, epoch_us) = (port.unwrap(), outcome.epoch_us.unwrap());
    let trace = &port.world().unwrap().recorder.trace;
    let end_us = trace.levels.last().unwrap().0;
    for after_us in [0, 777_777, file.session.duration_us / 2, u64::MAX / 4] {
        let expected = edges_of_one_period(&file.session, trace, epoch_us, after_us);
        assert_eq!(expected.is_empty(), after_us > end_us, "{after_us}");
        for step_us in [13_579, 1_000_000, end_us] {
            let (mut left, mut pieces) =
                (trace.clone(), FullestPeriod::new(&file.session, after_us));
            for until_us in (0..end_us + step_us).step_by(step_us as usize) {
                pieces.receive(&left.take(until_us), epoch_us);
            }
            pieces.receive(&left, epoch_us);
            assert_eq!(pieces.into_edges(), expected, "{after_us} {step_us}");
        }
    }
}
