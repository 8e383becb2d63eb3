//! The check of thresholds at the start of a session.

use super::scene::*;
use hal_sim::body::bench::SensorSpec;
use host_core::calibration::{
    Auto, CalibrationError, CheckOrder, Journal, Level, OperatorStation, Phase, Plan,
    ProcedureCost, Step, check,
};
use host_core::wearer::Wearer;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Checks the file on the random body of `seed`.
fn run_check(file: &Path, seed: u64) -> (Result<(), CalibrationError>, ProcedureCost) {
    let wearer = Wearer::read(file).unwrap();
    let port = array_port(
        &Plan::from_wearer(&wearer).unwrap(),
        seed,
        SensorSpec::default(),
    );
    let head = head_of("");
    let checked = CheckOrder {
        file,
        tolerance: Level(1_000),
        head: &head,
    };
    let mut desk = OperatorStation {
        operator: &mut Auto,
        interruption: None,
        acknowledges: false,
    };
    let (result, _, spent) = check(
        port,
        &wearer,
        &checked,
        &mut Journal::discarding(),
        &mut desk,
    );
    (result, spent)
}

#[test]
fn thresholds_that_hold_are_told_in_a_minute_and_others_refused() {
    let out = folder("drift").join("w.toml");
    let (_, _, text) = run_whole_calibration(&plan_with_electrodes(10), &out);
    let (result, spent) = run_check(&out, SEED);
    result.unwrap();
    println!(
        "{:.1} s of device time, {} presentations",
        spent.t_s, spent.given
    );
    assert!(spent.t_s <= 75.0, "{}", spent.t_s);
    let wearer = Wearer::read(&out).unwrap();
    assert_eq!(wearer.checks.len(), 10);
    assert!(wearer.checks.iter().all(|check| check.accepted));
    let kept = std::fs::read_to_string(&out).unwrap();
    assert!(kept.starts_with(&text), "every byte is kept");
    // The arm of another person.
    let (result, _) = run_check(&out, SEED + 1);
    let message = result.unwrap_err().to_string();
    assert!(
        message.starts_with("E682 the thresholds have drifted: channel"),
        "{message}"
    );
    let wearer = Wearer::read(&out).unwrap();
    assert_eq!(wearer.checks.len(), 20);
    assert!(wearer.checks.iter().any(|check| !check.accepted));
}

/// Calibrates an electrode and replaces the rates in its file: found at, valid from and to.
fn calibrated_at(name: &str, [hz, from_hz, to_hz]: [f64; 3]) -> std::path::PathBuf {
    let out = folder(name).join("w.toml");
    let (_, _, text) = run_whole_calibration(&plan_with_electrodes(1), &out);
    let own = "frequency_hz = 32.0\n";
    assert!(text.contains(own), "{text}");
    let rates = format!("frequency_hz = {hz:?}\nfrom_hz = {from_hz:?}\nto_hz = {to_hz:?}\n");
    std::fs::write(&out, text.replace(own, &rates)).unwrap();
    out
}

/// At Lee 2020's 30 Hz three pulses take more than 100 ms, so the check uses 32 Hz.
#[test]
fn an_electrode_that_falls_off_while_a_30_hz_file_is_checked_is_silent_in_time() {
    let file = calibrated_at("slow", [30.0, 20.0, 40.0]);
    let wearer = Wearer::read(&file).unwrap();
    let plan = Plan::from_wearer(&wearer).unwrap();
    assert_eq!(plan.electrodes[0].frequency_hz, 32.0);
    let given = (0..32).map(|place| (Phase::On, 0.3 + 0.005 * f64::from(place)));
    let mut longest = 0;
    for (phase, left_s) in given.chain([(Phase::Ready, 0.5), (Phase::Rest, 0.5)]) {
        let moment = Moment {
            electrode: 1,
            step: Step::Threshold,
            phase,
            left_s,
        };
        let come = Arc::new(Mutex::new(DisturbanceState::default()));
        let mut operator = DisturbedOperator {
            moment,
            way: Disturbance::Off,
            come: Arc::clone(&come),
        };
        let mut port = DisturbedPort {
            port: array_port(&plan, SEED, SensorSpec::default()),
            way: Disturbance::Off,
            come: Arc::clone(&come),
        };
        let checked = CheckOrder {
            file: &file,
            tolerance: Level(1_000),
            head: &head_of(""),
        };
        let mut desk = OperatorStation {
            operator: &mut operator,
            interruption: None,
            acknowledges: false,
        };
        let mut nowhere = Journal::discarding();
        let (result, _, _) = check(&mut port, &wearer, &checked, &mut nowhere, &mut desk);
        let message = result.unwrap_err().to_string();
        assert!(message.starts_with("E677 "), "{moment:?}: {message}");
        let at_us = come.lock().unwrap().at_us.unwrap();
        let world = &mut port.port.world;
        // Without a pulse, nothing can detect the loss.
        let since_us = match phase {
            Phase::On => at_us,
            _ => driven_after(world, at_us).unwrap_or(at_us),
        };
        longest = longest.max(silent_after(world, since_us));
    }
    println!("silent within {:.1} ms", longest as f64 * 1e-3);
    assert!(longest <= 100_000, "{longest}");
}

/// A file is refused if its thresholds are not valid at any rate at which a lost electrode is
/// detected in time.
#[test]
fn thresholds_of_other_rates_are_not_checked() {
    for (name, rates) in [
        ("slower", [30.0, 20.0, 31.9]),
        ("faster", [60.0, 50.1, 100.0]),
    ] {
        let wearer = Wearer::read(calibrated_at(name, rates)).unwrap();
        let message = Plan::from_wearer(&wearer).unwrap_err().to_string();
        assert!(message.starts_with("E670 "), "{message}");
        let [_, from_hz, to_hz] = rates;
        let holds = format!("channel 1: its threshold is valid from {from_hz} to {to_hz} Hz");
        assert!(message.contains(&holds), "{message}");
    }
    let wearer = Wearer::read(calibrated_at("fast", [60.0, 40.0, 100.0])).unwrap();
    assert_eq!(
        Plan::from_wearer(&wearer).unwrap().electrodes[0].frequency_hz,
        50.0
    );
}
