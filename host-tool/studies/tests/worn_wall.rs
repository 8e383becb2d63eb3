//! The wall experiment for a wearer by their file.

use host_core::wearer::{Wearer, shipped};
use studies::experiments::{named, worn};

fn wearer(name: &str) -> Wearer {
    Wearer::parse(name, shipped(name).unwrap()).unwrap()
}

fn number(text: &str, path: &[&str]) -> f64 {
    let table: toml::Table = text.parse().unwrap();
    let mut place = &toml::Value::Table(table);
    for part in path {
        place = &place[*part];
    }
    place.as_float().unwrap()
}

/// Where the pre-wall begins, where the wall ends, and whose body it is: the file's, at the
/// wall's widths.
#[test]
fn the_wall_is_the_wearers() {
    let mut harris = wearer("harris-1");
    harris.electrodes[0].limit = firmware::units::Amplitude::new(60_000);
    let experiment = worn("harris-wall", &harris).unwrap();
    let (_, session) = &experiment.sessions[0];
    let threshold_ma = f64::from(harris.electrodes[0].motor_threshold.get()) * 1e-3;
    let biceps_ma = f64::from(harris.electrodes[1].motor_threshold.get()) * 1e-3;
    for (path, wanted) in [
        (&["wall", "max"][..], 60.0),
        (&["wall", "stiffness_per_deg"], 6.667),
        (&["wall", "pre_wall", "begin"], threshold_ma),
        (&["wall", "pre_wall", "end"], 60.0),
        (&["wall", "co_contraction", "amplitude"], 40.0),
        (&["body", "triceps_threshold_ma"], threshold_ma),
        (&["body", "biceps_threshold_ma"], biceps_ma),
    ] {
        assert!((number(session, path) - wanted).abs() < 1e-9, "{path:?}");
    }
    // What the file says is not drawn, the rest is.
    let drawn = |experiment: &studies::laboratory::Experiment| {
        let drawn = experiment.declaration.drawn.iter();
        drawn.map(|it| it.field.clone()).collect::<Vec<_>>()
    };
    let (own, declared) = (drawn(&experiment), drawn(&named("harris-wall").unwrap()));
    assert!(!own.iter().any(|it| it == "body.triceps_threshold_ma"));
    assert!(own.iter().any(|it| it == "body.inertia_kg_m2"));
    assert!(own.len() < declared.len());
    assert!(experiment.declaration.title.contains("harris-1"));
}

#[test]
fn who_cannot_hit_the_wall_is_told_why() {
    let harris = wearer("harris-1");
    let refused = |name: &str, wearer: &Wearer| worn(name, wearer).unwrap_err().to_string();
    assert!(refused("hamana-4", &harris).starts_with("E693 "));
    assert!(refused("harris-wall", &wearer("K01")).starts_with("E694 K01"));
    let mut other = harris.clone();
    other.electrodes[0].width_us = 40;
    other.electrodes[0].strength_duration = None;
    let told = refused("harris-wall", &other);
    assert!(
        told.starts_with("E695 harris-1: channel 1") && told.contains("35 µs"),
        "{told}"
    );
}
