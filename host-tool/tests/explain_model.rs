//! `flexor explain-model`.

use crate::program::{self, Said, ran, written};
use serde_json::Value;
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

/// A session of one channel with this train's rest and this muscle's.
fn session(train: &str, muscle: &str) -> String {
    let shape = r#"shape = "biphasic-cathodic-first", width_us = 200"#;
    let muscle = match muscle {
        "none" => String::new(),
        more => format!("muscle = {{ {MUSCLE}{more} }}"),
    };
    format!("{HEAD}train = {{ {shape}, {train} }}\n{muscle}\n{SETPOINTS}")
}

fn flexor(name: &str, text: &str, arguments: &[&str]) -> Said {
    let folder = program::folder(&format!("explained/{name}"));
    written(&folder, name, text);
    ran(&folder, &[&["explain-model", name], arguments].concat())
}
#[test]
fn the_table_is_for_people_and_machines() {
    let text = session("frequency_hz = 50.0", "");
    let (exit, said, _) = flexor("people.toml", &text, &[]);
    assert_eq!(exit, Some(0), "{said}");
    assert!(said.contains("channel 1, one: calcium-force, "), "{said}");
    let widest = said.lines().map(|line| line.chars().count()).max();
    assert!(widest <= Some(80), "{said}");
    let tiring = session("frequency_hz = 50.0", ", fatigue = {}");
    let (_, said, _) = flexor("machines.toml", &tiring, &["--json"]);
    let value: Value = serde_json::from_str(&said).unwrap();
    assert_eq!(value["channels"][0]["model"], "calcium-force-fatigue");
}

#[test]
fn what_cannot_be_explained_is_refused_by_name() {
    let none = session("frequency_hz = 50.0", "none");
    let (exit, _, said) = flexor("none.toml", &none, &[]);
    assert_eq!(exit, Some(1), "{said}");
    assert!(said.contains("E554") && said.contains("muscle"), "{said}");
}

/// `flexor explain-model … | head` and `… > /a/full/disk`.
#[test]
fn a_reader_that_went_is_no_failure_and_a_full_disk_is_one() {
    let folder = program::folder("explained/gone");
    written(&folder, "gone.toml", session("frequency_hz = 50.0", ""));
    let explain = |stdout: Stdio| {
        let mut command = program::flexor(&folder, &["explain-model", "gone.toml"]);
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
        let told = String::from_utf8(full.stderr).unwrap();
        assert!(!full.status.success() && told.contains("E523"), "{told}");
    }
}
