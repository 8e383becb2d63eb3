//! Tests of a wearer who stays the same through a protocol: the effect of rests, and that nothing
//! else changes.

use host_core::link::Interruption;
use host_core::run::DeviceName;
use std::fs;
use std::path::{Path, PathBuf};
use studies::laboratory::{ConductedTrial, Experiment, LaboratoryError, Operator};

/// A flexor point at 40 Hz for three seconds, on a finger that fatigues.
const SESSION: &str = r#"
title = "A finger that tires"
duration_s = 3.0
[wearer]
max_current_ma = 20.0
max_charge_uc = 5.0
max_rms_ma = 10.0
rise_ms = 200
fall_ms = 50
host_timeout_ms = 100
[[channel]]
number = 1
name = "flexor A"
stage = { kind = "voltage", full_scale_v = 60.0, load_ohm = 2000 }
limit = 28.0
train = { shape = "monophasic-cathodic", width_us = 200, ground_us = 1000, frequency_hz = 40.0 }
[setpoints]
kind = "amplitudes"
values = [{ channel = 1, value = 27.0 }]
rate_hz = 90
[body]
kind = "finger"
participant = "P"
flexor_a = 1
flexor_b = 2
extensor = 3
fatigue_floor = 0.0
fatigue_time_s = 5.0
"#;

const DECLARED: &str = r#"
name = "tiring"
title = "Tiring"
source = "nobody"
session = "finger.toml"
seed = 3
draws = 3
measures = ["peak_deg", "charge_mc"]
[[draw]]
field = "body.flexor_nm"
low = 0.15
high = 0.3
source = "assumed"
"#;

fn experiment(protocol: &str) -> Result<Experiment, LaboratoryError> {
    let text = format!("{DECLARED}\n{protocol}");
    let texts = |_: &str| Ok(SESSION.to_owned());
    Experiment::new("tiring.toml", &text, &texts)
}

struct NoOperator;

impl Operator for NoOperator {
    fn ready(&mut self, _: &str) -> bool {
        true
    }

    fn rest(&mut self, _: f64) -> bool {
        true
    }

    fn progress(&mut self, _: f64) {}

    fn interruption(&self) -> Interruption {
        Interruption::default()
    }
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("same_wearer");
    fs::create_dir_all(&folder).unwrap();
    let folder = folder.join(name);
    let _ = fs::remove_dir_all(&folder);
    folder
}

/// Runs three trials with rests of `rest_s`.
fn three(wearer: &str, rest_s: f64, name: &str) -> Vec<ConductedTrial> {
    let protocol =
        format!("[protocol]\nrepetitions = 3\nwearer = \"{wearer}\"\nrest_s = {rest_s:?}");
    let place = (&DeviceName::Native, 3);
    let course = experiment(&protocol).unwrap();
    let course = course
        .conduct(&folder(name), place, &mut NoOperator)
        .unwrap();
    assert!(course.ended.is_none(), "{:?}", course.ended);
    course.trials
}

fn peak(trial: &ConductedTrial) -> f64 {
    trial.measured[0].unwrap()
}

#[test]
fn a_wearer_who_is_kept_is_more_tired_after_short_rests() {
    let short = three("same", 1.0, "short");
    let long = three("same", 120.0, "long");
    let peaks = |trials: &[ConductedTrial]| trials.iter().map(peak).collect::<Vec<_>>();
    let (short_deg, long_deg) = (peaks(&short), peaks(&long));
    // The first trial does not depend on the rest.
    assert_eq!(short[0].trial, long[0].trial);
    assert!(
        short_deg[2] < short_deg[0] - 5.0,
        "{short_deg:?} {long_deg:?}"
    );
    assert!(short_deg[2] < long_deg[2] - 5.0);
    // After two dozen time constants nothing measurable remains.
    assert!((long_deg[2] - long_deg[0]).abs() < 0.1, "{long_deg:?}");
    // Each trial has its own counts of the device.
    for trial in &short[1..] {
        let counted = |measurement: &ConductedTrial, name: &str| {
            let found = measurement
                .trial
                .counters
                .iter()
                .find(|(known, _)| known == name);
            found.map(|(_, n)| *n)
        };
        for name in ["pulses started", "setpoints carried out"] {
            assert!(counted(trial, name) > Some(0));
            assert_eq!(counted(trial, name), counted(&short[0], name), "{name}");
        }
        assert_eq!(trial.trial.pulses, short[0].trial.pulses);
    }
}

#[test]
fn a_rested_wearer_knows_nothing_of_rests() {
    let short = three("rested", 0.0, "rested_short");
    let long = three("rested", 3_000.0, "rested_long");
    assert!(short.iter().zip(&long).all(|(a, b)| a.trial == b.trial));
    assert_eq!(peak(&short[0]), peak(&short[2]));
}

/// The rest is longer than the device's clock takes to wrap, so that it starts again meanwhile.
#[test]
fn the_same_seed_gives_the_same_bytes_across_a_wrap_of_the_clock() {
    let files = |name: &str| {
        let trials = three("same", 5_000.0, name);
        let folders = fs::read_dir(folder_of(name)).unwrap().flatten();
        let files = folders.flat_map(|entry| fs::read_dir(entry.path()).unwrap().flatten());
        let file = |entry: fs::DirEntry| {
            let inside = entry
                .path()
                .strip_prefix(folder_of(name))
                .unwrap()
                .to_owned();
            (inside, fs::read(entry.path()).unwrap())
        };
        let mut bytes: Vec<_> = files.map(file).collect();
        bytes.sort();
        (trials, bytes)
    };
    let ((one, bytes), (two, again)) = (files("wrapped"), files("wrapped_again"));
    assert!(!bytes.is_empty() && bytes == again);
    assert!(one.iter().zip(&two).all(|(a, b)| a.trial == b.trial));
    assert!((peak(&one[2]) - peak(&one[0])).abs() < 0.1);
    assert_eq!(one[0].trial.edges, one[2].trial.edges);
}

fn folder_of(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("same_wearer")
        .join(name)
}

#[test]
fn a_drawn_wearer_who_is_kept_goes_through_the_whole_protocol() {
    let peak_of = |protocol: &str| {
        let experiment = experiment(protocol).unwrap();
        let unit = experiment.unit(3, 3, 1);
        let measured = experiment.measure_unit(&unit).unwrap();
        assert_eq!(measured, experiment.measure_unit(&unit).unwrap());
        measured[0][0].unwrap()
    };
    let rested = peak_of("");
    let short = peak_of("[protocol]\nrepetitions = 4\nwearer = \"same\"\nrest_s = 0.5");
    let long = peak_of("[protocol]\nrepetitions = 4\nwearer = \"same\"\nrest_s = 120.0");
    assert!(
        short < long - 5.0 && (long - rested).abs() < 0.1,
        "{short} {long} {rested}"
    );
    // With one trial, keeping the wearer equals a rested wearer.
    assert_eq!(peak_of("[protocol]\nwearer = \"same\""), rested);
}

#[test]
fn conditions_of_two_wearers_are_not_worn_by_one() {
    let refused = |level: &str, field: &str| {
        let factor = format!(
            "[protocol]\nwearer = \"same\"\n[[factor]]\nname = \"who\"\n[[factor.level]]\n\
             name = \"one\"\n[[factor.level]]\nname = \"other\"\nset = {{ {level} }}\n"
        );
        let error = experiment(&factor).unwrap_err().to_string();
        let wanted = format!("E611 protocol: wearer is \"same\", but `{field}` differs");
        assert!(error.starts_with(&wanted), "{error}");
        assert!(experiment(&factor.replace("same", "rested")).is_ok());
    };
    refused("\"body.extensor_nm\" = 0.2", "body");
    let stage = "{ kind = \"voltage\", full_scale_v = 50.0, load_ohm = 2000 }";
    refused(&format!("\"channel.1.stage\" = {stage}"), "channel.stage");
}
