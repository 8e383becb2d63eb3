//! Tests of `flexor explain-model`.

use crate::program::{self, ProgramOutput, run_flexor, write_file};
use serde_json::Value;
use std::path::Path;
use std::process::Stdio;

const HEAD: &str = r#"
title = "One muscle"
duration_s = 20.0

[wearer]
rise_ms = 5000

[[channel]]
number = 1
name = "one"
stage = { kind = "current", full_scale_ma = 100.0 }
limit = 12.0
"#;
const MUSCLE: &str = "a_n_per_s = 121.9, k = 0.3, tau_c_ms = 20.8, tau1_ms = 33.1, \
                      tau2_ms = 194.4, motor_threshold = 8.0, reference = 12.0, slope_per_unit = 0.46";
const SETPOINTS: &str = r#"
[setpoints]
kind = "amplitudes"
values = [{ channel = 1, value = 10.0 }]
rate_hz = 50
"#;

/// Returns a session of one channel; `train` and `muscle` are added to their tables.
fn session(train: &str, muscle: &str) -> String {
    let shape = r#"shape = "biphasic-cathodic-first", width_us = 200"#;
    let muscle = match muscle {
        "none" => String::new(),
        more => format!("muscle = {{ {MUSCLE}{more} }}"),
    };
    format!("{HEAD}train = {{ {shape}, {train} }}\n{muscle}\n{SETPOINTS}")
}

fn flexor(name: &str, text: &str, arguments: &[&str]) -> ProgramOutput {
    let folder = program::test_folder(&format!("explained/{name}"));
    write_file(&folder, name, text);
    run_flexor(&folder, &[&["explain-model", name], arguments].concat())
}
#[test]
fn the_table_is_for_people_and_machines() {
    let text = session("frequency_hz = 50.0", "");
    let (exit, output, _) = flexor("people.toml", &text, &[]);
    assert_eq!(exit, Some(0), "{output}");
    assert!(output.contains("channel 1, one: calcium-force"), "{output}");
    assert!(output.contains("uses: the reported force"), "{output}");
    assert!(output.contains("\n  by a table of "), "{output}");
    let widest = output.lines().map(|line| line.chars().count()).max();
    assert!(widest <= Some(80), "{output}");
    let tiring = session("frequency_hz = 50.0", ", fatigue = {}");
    let channel = |name, options: &[&str]| -> Value {
        let (_, json_text, _) = flexor(name, &tiring, options);
        let value: Value = serde_json::from_str(&json_text).unwrap();
        value["channels"][0].clone()
    };
    // 20 s of work fatigue the muscle by more than 10 % and less than 60 %.
    let item = channel("machines.toml", &["--json"]);
    assert_eq!(item["model"], "calcium-force-fatigue");
    assert!(item["table_rows"].is_null(), "{item}");
    let models = item["models"].as_array().unwrap();
    let error = |name: &str| {
        let found = models.iter().find(|value| value["model"] == name).unwrap();
        found["report_pct"].as_f64().unwrap()
    };
    assert!((10.0..60.0).contains(&error("calcium-force")), "{item}");
    assert!(error("calcium-force-fatigue") < 10.0, "{item}");
    let item = channel("coarse.toml", &["--json", "--tolerance", "60"]);
    assert_eq!(item["model"], "calcium-force");
    // The changes in the file are printed with the model at the session's start.
    let more = ", model = \"calcium-force\", changes = [{ at_s = 4, model = \"none\" }]";
    let changing = session("frequency_hz = 50.0", more);
    let (_, output, _) = flexor("changing.toml", &changing, &[]);
    assert!(output.contains("Models at the session's start"), "{output}");
    assert!(
        output.contains("from 4 s on: none, set in the file"),
        "{output}"
    );
    let (_, json, _) = flexor("changing.toml", &changing, &["--json"]);
    let value: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value["models_at_s"], 0.0);
    let item = &value["channels"][0];
    assert_eq!(
        item["changes"][0],
        serde_json::json!({ "at_s": 4.0, "model": "none" })
    );
    assert!(
        item["models"][0]["worst_cycles_per_s"].is_number(),
        "{item}"
    );
}

#[test]
fn what_cannot_be_explained_is_refused_by_name() {
    let plain = session("frequency_hz = 50.0", "");
    let none = session("frequency_hz = 50.0", "none");
    for (name, text, tolerance, code, words) in [
        ("none.toml", &none, "10", 1, ["E554", "muscle"]),
        ("zero.toml", &plain, "0", 2, ["E518", "--tolerance"]),
        ("nan.toml", &plain, "NaN", 2, ["E518", "--tolerance"]),
        ("much.toml", &plain, "601", 2, ["E518", "600"]),
        ("fine.toml", &plain, "0.01", 1, ["E553", "smallest error"]),
    ] {
        let (exit, _, error) = flexor(name, text, &["--tolerance", tolerance]);
        assert_eq!(exit, Some(code), "{name}: {error}");
        for word in words {
            assert!(error.contains(word), "{name}: {error}");
        }
    }
}

/// The chosen model is recorded, and a rerun uses it.
#[test]
fn a_rerun_takes_the_model_from_the_record() {
    let folder = program::test_folder("explained/again");
    let coarse = format!(
        "{}\n[fidelity]\ntolerance_percent = 60\n",
        session("frequency_hz = 50.0", ", fatigue = {}")
    );
    write_file(&folder, "coarse.toml", coarse);
    let (exit, _, error) = run_flexor(&folder, &["run", "coarse.toml", "--out", "first"]);
    assert_eq!(exit, Some(0), "{error}");
    let trial = folder.join("first/01-one-muscle/trial.json");
    let trial: Value = serde_json::from_str(&std::fs::read_to_string(trial).unwrap()).unwrap();
    assert_eq!(trial["channels"][0]["model"], "calcium-force");
    let (exit, out, error) = run_flexor(&folder, &["rerun", "first"]);
    assert_eq!(exit, Some(0), "{out} {error}");
    // A record with an unknown model cannot be repeated.
    let unknown = folder.join("first/01-one-muscle/trial.json");
    let text = std::fs::read_to_string(&unknown).unwrap();
    std::fs::write(&unknown, text.replace("\"calcium-force\"", "\"lag\"")).unwrap();
    for command in ["rerun", "report"] {
        let (exit, _, error) = run_flexor(&folder, &[command, "first"]);
        assert!(exit == Some(1) && error.contains("E584"), "{error}");
        assert!(error.contains("`lag` is not a muscle model"), "{error}");
    }
    // A tolerance that no model meets is refused before anything is simulated.
    let fine = session("frequency_hz = 50.0", "") + "\n[fidelity]\ntolerance_percent = 0.01\n";
    write_file(&folder, "fine.toml", fine);
    let (exit, _, error) = run_flexor(&folder, &["run", "fine.toml", "--out", "second"]);
    assert!(exit == Some(1) && error.contains("E553"), "{error}");
    assert!(!folder.join("second").exists());
}

/// A model that the file names stays, and its error is reported.
#[test]
fn a_given_model_beyond_the_tolerance_is_told() {
    let folder = program::test_folder("explained/given");
    let given = session("frequency_hz = 50.0", ", model = \"none\"");
    write_file(
        &folder,
        "given.toml",
        given + "\n[fidelity]\ntolerance_percent = 3\n",
    );
    let (exit, _, error) = run_flexor(&folder, &["run", "given.toml", "--out", "first"]);
    assert_eq!(exit, Some(0), "{error}");
    let warning = "channel 1: the file's model `none` has an error of";
    assert!(
        error.contains(warning) && error.contains("tolerance of 3.00 %"),
        "{error}"
    );
}

/// Runs `flexor explain-model … | head` and `… > /a/full/disk`.
#[test]
fn a_reader_that_went_is_no_failure_and_a_full_disk_is_one() {
    let folder = program::test_folder("explained/gone");
    write_file(&folder, "gone.toml", session("frequency_hz = 50.0", ""));
    let explain = |stdout: Stdio| {
        let mut command = program::flexor_command(&folder, &["explain-model", "gone.toml"]);
        let command = command.stdout(stdout).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        drop(child.stdout.take());
        child.wait_with_output().unwrap()
    };
    let gone = explain(Stdio::piped());
    assert!(gone.status.success(), "{gone:?}");
    assert!(gone.stderr.is_empty(), "{gone:?}");
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full");
    if let Ok(full) = full {
        let full = explain(full.into());
        let error = String::from_utf8(full.stderr).unwrap();
        assert!(!full.status.success() && error.contains("E523"), "{error}");
    }
}

/// The detail of a simulated hand is chosen within the tolerance, is recorded, and a rerun repeats
/// the run byte for byte.
#[test]
fn a_hand_gets_no_more_motor_units_than_it_needs() {
    let shipped = include_str!("../sessions/hamana_exp4_two_point.toml");
    let short = shipped
        .replace("duration_s = 30.0", "duration_s = 3.0")
        .replace("from_s = 10.0\nto_s = 30.0", "from_s = 1.0\nto_s = 3.0");
    let folder = program::test_folder("explained/hand");
    write_file(&folder, "without.toml", &short);
    let (exit, output, _) = run_flexor(&folder, &["explain-model", "without.toml"]);
    assert_eq!(exit, Some(0), "{output}");
    assert!(
        output.contains("all 32 motor units of each pool"),
        "{output}"
    );
    let chosen = |percent: f64| -> (u64, Value) {
        let text = format!("{short}\n[fidelity]\ntolerance_percent = {percent}\n");
        write_file(&folder, "hand.toml", &text);
        let (exit, output, _) = run_flexor(&folder, &["explain-model", "hand.toml", "--json"]);
        assert_eq!(exit, Some(0), "{output}");
        let value: Value = serde_json::from_str(&output).unwrap();
        let hand = value["hand"].clone();
        (hand["chosen_units"].as_u64().unwrap(), hand)
    };
    let (fine, _) = chosen(0.01);
    let (coarse, hand) = chosen(30.0);
    assert_eq!(fine, 32, "only every unit has no error");
    assert!(coarse < 8, "{hand}");
    let tried = hand["tried"].as_array().unwrap();
    let error = |units: u64| {
        let found = tried.iter().find(|effect| effect["units"] == units);
        found
            .and_then(|effect| effect["change_pct"].as_f64())
            .unwrap()
    };
    assert_eq!(error(32), 0.0);
    assert!(error(coarse) > 0.0 && error(coarse) <= 30.0, "{hand}");
    let recorded = run_and_rerun(&folder, "hand.toml");
    assert_eq!(recorded["fidelity"]["hand_units"], coarse);
}

/// The time step of a simulated arm is chosen within the tolerance, is recorded, and a rerun repeats
/// the run byte for byte. A tolerance without `[fidelity]` leaves the arm as it is.
#[test]
fn an_arm_gets_no_finer_step_than_it_needs() {
    let shipped = include_str!("../sessions/endpoint_arm.toml");
    let wearer = concat!(env!("CARGO_MANIFEST_DIR"), "/wearers/arm-1.toml");
    let held = shipped.replace("../wearers/arm-1.toml", wearer);
    let free = held.replace("held = \"cuff\"", "held = \"freely\"");
    let folder = program::test_folder("explained/arm");
    write_file(&folder, "without.toml", &free);
    let (exit, output, _) = run_flexor(&folder, &["explain-model", "without.toml"]);
    assert_eq!(exit, Some(0), "{output}");
    assert!(output.contains("9 of 11 muscles"), "{output}");
    assert!(output.contains("in steps of 1 ms"), "{output}");
    let chosen = |percent: f64| -> (u64, Value) {
        let text = format!("{free}\n[fidelity]\ntolerance_percent = {percent}\n");
        write_file(&folder, "arm.toml", &text);
        let (exit, output, _) = run_flexor(&folder, &["explain-model", "arm.toml", "--json"]);
        assert_eq!(exit, Some(0), "{output}");
        let value: Value = serde_json::from_str(&output).unwrap();
        let arm = value["arm"].clone();
        (arm["chosen_step_ms"].as_u64().unwrap(), arm)
    };
    let (fine, _) = chosen(0.01);
    assert_eq!(fine, 1, "only the finest step has no error");
    let (coarse, arm) = chosen(1.5);
    assert!((2..20).contains(&coarse), "{arm}");
    let tried = arm["tried"].as_array().unwrap();
    let errors = tried.iter().map(|effect| effect["change_pct"].as_f64());
    let errors: Vec<f64> = errors.collect::<Option<_>>().unwrap();
    assert_eq!(errors[0], 0.0);
    assert!(errors.is_sorted() && errors[1] > 0.0, "{arm}");
    let recorded = run_and_rerun(&folder, "arm.toml");
    assert_eq!(recorded["fidelity"]["arm_step_ms"], coarse);
}

/// Runs a session file and reruns its record. Checks that both wrote the same trial, and returns it.
fn run_and_rerun(folder: &Path, file: &str) -> Value {
    let (exit, output, _) = run_flexor(folder, &["run", file, "--out", "first"]);
    assert_eq!(exit, Some(0), "{output}");
    let (exit, output, _) = run_flexor(folder, &["rerun", "first", "--out", "again"]);
    assert_eq!(exit, Some(0), "{output}");
    let trial = |record: &str| {
        let mut trials = std::fs::read_dir(folder.join(record)).unwrap();
        trials
            .find_map(|entry| std::fs::read_to_string(entry.ok()?.path().join("trial.json")).ok())
            .unwrap()
    };
    assert_eq!(trial("first"), trial("again"));
    serde_json::from_str(&trial("first")).unwrap()
}
