//! Compares bodies with a recorded schedule with the whole device.

use super::*;
use crate::laboratory::sweep::{Shard, Sweep};
use std::path::PathBuf;

const SESSION: &str = include_str!("../../../../sessions/open_finger.toml");
const DECLARED: &str = r#"
name = "open"
title = "Open"
source = "nobody"
session = "open_finger.toml"
seed = 5
draws = 4
measures = ["peak_deg", "charge_mc"]
[protocol]
repetitions = 2
rest_s = 1.0
[[draw]]
field = "body.flexor_nm"
low = 0.15
high = 0.5
source = "assumed"
"#;

fn experiment(wearer: &str) -> Experiment {
    let text = DECLARED.replace("rest_s", &format!("wearer = \"{wearer}\"\nrest_s"));
    Experiment::new("open.toml", &text, &|_| Ok(SESSION.to_owned())).unwrap()
}

fn score(experiment: &Experiment) -> Score {
    Score::record(experiment, (5, 4)).unwrap().unwrap()
}

fn folder(name: &str) -> PathBuf {
    let dir = std::env::temp_dir().join(format!("flexor-{name}-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    dir
}

#[test]
fn every_drawn_body_moves_as_on_the_whole_device() {
    for wearer in ["rested", "same"] {
        let experiment = experiment(wearer);
        let score = score(&experiment);
        for index in 0..4 {
            let unit = experiment.unit(5, 4, index);
            let files = experiment.sessions(&unit.fields).unwrap();
            let alone = score.play(&experiment, &unit, &files).unwrap().unwrap();
            let device_trials = experiment.play(&unit, &files, &mut |_| ()).unwrap();
            assert_eq!(difference(&device_trials, &alone), None, "{wearer} {index}");
            assert_eq!(device_trials[0].1.samples.len(), alone[0].1.samples.len());
        }
        score
            .measure_unit(&experiment, &experiment.unit(5, 4, 3), true)
            .unwrap();
        assert_eq!(score.check_result().units, 1);
    }
}

/// A recorded pulse that comes a microsecond late, or is missing, stops the sweep.
#[test]
fn a_sweep_stops_at_what_the_whole_device_does_not_do() {
    let experiment = experiment("rested");
    let pulse_after = |score: &Score, at_us| {
        let touches = &score.parts[0].touches;
        let is = |pair: &(u64, BodyEvent)| pair.0 > at_us && matches!(pair.1, BodyEvent::Pulse(_));
        touches.iter().position(is).unwrap()
    };
    let swept = |score: &Score, name: &str| {
        let sweep = Sweep::new(&experiment, 5, 4, Shard::WHOLE);
        let dir = folder(name);
        let swept = sweep.run_with_score(&experiment, (&dir, &[]), Some(score), &mut |_| true);
        std::fs::remove_dir_all(&dir).unwrap();
        swept.map(|_| ()).map_err(|error| error.to_string())
    };
    assert_eq!(swept(&score(&experiment), "right"), Ok(()));
    let mut late = score(&experiment);
    let place = pulse_after(&late, 1_000_000);
    if let (_, BodyEvent::Pulse(pulse)) = &mut late.parts[0].touches[place] {
        pulse.t_us += 1;
    }
    let message = swept(&late, "late").unwrap_err();
    assert!(
        message.starts_with("E612 unit 0, the session:"),
        "{message}"
    );
    assert!(message.contains("the true angle at"), "{message}");
    let mut lost = score(&experiment);
    lost.parts[0].touches.remove(place);
    assert!(swept(&lost, "lost").unwrap_err().starts_with("E612 unit 0"));
    let mut other = score(&experiment);
    let changed = &mut other.parts[0].trials[0].1.samples;
    let mut samples = changed.to_vec();
    samples[50].amplitudes[0] = Some(1.0);
    *changed = samples.into();
    let message = swept(&other, "other").unwrap_err();
    assert!(message.contains("telemetry at"), "{message}");
}

#[test]
fn a_unit_with_a_schedule_of_its_own_runs_on_the_whole_device() {
    let text = DECLARED.replace("body.flexor_nm", "channel.1.limit");
    let text = text
        .replace("0.15", "26")
        .replace("0.5", "28\neven = \"whole\"");
    let texts = |_: &str| Ok(SESSION.to_owned());
    let experiment = Experiment::new("open.toml", &text, &texts).unwrap();
    let score = score(&experiment);
    let mut units = (0..4).map(|index| experiment.unit(5, 4, index));
    let first = units.next().unwrap();
    let unit = units.find(|unit| unit.fields != first.fields).unwrap();
    let files = experiment.sessions(&unit.fields).unwrap();
    assert!(score.play(&experiment, &unit, &files).unwrap().is_none());
    let measured = score.measure_unit(&experiment, &unit, true).unwrap();
    assert_eq!(measured, experiment.measure_unit(&unit).unwrap());
}

#[test]
fn a_joint_or_a_wall_is_no_open_loop() {
    let closed = include_str!("../../../../sessions/harris_wall/3_pre_wall_co_contraction.toml");
    let file = SessionFile::parse("wall.toml", closed).unwrap();
    assert!(!is_open(&file.session));
    let file = SessionFile::parse("open.toml", SESSION).unwrap();
    assert!(is_open(&file.session));
}
