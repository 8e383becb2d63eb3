//! The check at the start of a session.

use super::scene::*;
use hal_sim::body::bench::SensorSpec;
use host_core::calibration::{
    Auto, CalibrationError, Checked, Desk, Journal, Level, Plan, Spent, check,
};
use host_core::wearer::Wearer;
use std::path::Path;

/// Checks the file on the body that `seed` draws.
fn checked(file: &Path, seed: u64) -> (Result<(), CalibrationError>, Spent) {
    let wearer = Wearer::read(file).unwrap();
    let port = port_of(&Plan::of(&wearer).unwrap(), seed, SensorSpec::default());
    let head = head_of("");
    let checked = Checked {
        file,
        tolerance: Level(1_000),
        head: &head,
    };
    let mut desk = Desk {
        operator: &mut Auto,
        interruption: None,
        acknowledges: false,
    };
    let (result, _, spent) = check(port, &wearer, &checked, &mut Journal::nowhere(), &mut desk);
    (result, spent)
}

#[test]
fn thresholds_that_hold_are_told_in_a_minute_and_others_refused() {
    let out = folder("drift").join("w.toml");
    let (_, _, text) = whole(&plan_of(10), &out);
    let (result, spent) = checked(&out, SEED);
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
    // Another person's arm.
    let (result, _) = checked(&out, SEED + 1);
    let told = result.unwrap_err().to_string();
    assert!(
        told.starts_with("E682 the thresholds have drifted: channel"),
        "{told}"
    );
    let wearer = Wearer::read(&out).unwrap();
    assert_eq!(wearer.checks.len(), 20);
    assert!(wearer.checks.iter().any(|check| !check.accepted));
}
