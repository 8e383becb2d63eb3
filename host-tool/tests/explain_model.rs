//! `flexor explain-model`, and the scenes that sessions become.

use crate::program::{self, Said, ran, written};
use firmware::muscle::Rung;
use host_core::choice::{Scene, Share};
use host_core::session::Session;
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

fn parsed(text: &str) -> Session {
    Session::parse("test", text).unwrap()
}

fn needs(text: &str) -> host_core::session::scene::Needs {
    let session = parsed(text);
    let needs = session.needs(&session.channels[0], Share::JUST_NOTICEABLE);
    needs.unwrap()
}

#[test]
fn a_session_becomes_the_scene_that_it_is() {
    let hold = needs(&session("frequency_hz = 50.0", ""));
    let scene = Scene {
        burst_ms: Scene::UNBROKEN,
        slowest_mhz: 50_000,
        fastest_mhz: 50_000,
        ramp_ms: 5_000,
        session_s: 0,
    };
    assert_eq!(hold.scene, scene);
    let tiring = needs(&session("frequency_hz = 50.0", ", fatigue = {}"));
    let works = Scene {
        session_s: 20,
        ..scene
    };
    assert_eq!(tiring.scene, works);
    let short = needs(&session("frequency_hz = 40.0, repeats = 4", ""));
    assert_eq!(short.scene.burst_ms, 100);
    let doublets = "frequency_hz = 20.0, burst_count = 2, burst_interval_us = 5000";
    let doublets = needs(&session(doublets, ""));
    assert_eq!(doublets.scene.slowest_mhz, 20_000);
    assert_eq!(doublets.scene.fastest_mhz, 200_000);
}

/// The lowest sufficient rung of each kind, and what `"auto"` makes of it.
#[test]
fn each_kind_of_scene_gets_its_rung() {
    #[rustfmt::skip]
    let rows = [
        ("frequency_hz = 50.0", "", Rung::Static),
        ("frequency_hz = 50.0", ", fatigue = {}", Rung::CalciumForceFatigue),
        ("frequency_hz = 40.0, repeats = 4", "", Rung::CalciumForce),
        ("frequency_hz = 10.0", "", Rung::CalciumForce),
    ];
    for (train, muscle, rung) in rows {
        let text = session(train, muscle);
        assert_eq!(needs(&text).rung, rung, "{train} {muscle}");
        let muscle = parsed(&text).channels[0].muscle.clone().unwrap();
        assert_eq!((muscle.rung(), muscle.spec().rung), (rung, rung));
    }
    // What the file says goes before.
    let fixed = session("frequency_hz = 50.0", r#", model = "lag""#);
    assert_eq!(needs(&fixed).rung, Rung::Lag);
    assert_eq!(needs(&fixed).choice.unwrap().rung, Rung::Static);
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
    assert!(said.contains("channel 1, one: static"), "{said}");
    let widest = said.lines().map(|line| line.chars().count()).max();
    assert!(widest <= Some(80), "{said}");
    let json = |name, options: &[&str]| -> Value {
        let (_, said, _) = flexor(name, &text, options);
        serde_json::from_str(&said).unwrap()
    };
    let value = json("machines.toml", &["--json"]);
    let channel = &value["channels"][0];
    assert_eq!(channel["model"], "static");
    assert_eq!(channel["models"].as_array().unwrap().len(), 4);
    let change = channel["change_pct"].as_f64().unwrap();
    assert!(change > 1.0 && change <= 10.0, "{change}");
    assert!(channel["error_pct"].as_f64().unwrap() > 1.0);
    assert!(channel["change_if_it_tires_pct"].as_f64().unwrap() > change);
    let value = json("finer.toml", &["--json", "--tolerance", "2"]);
    assert_eq!(value["channels"][0]["model"], "lag");
}

#[test]
fn what_cannot_be_explained_is_refused_by_name() {
    let plain = session("frequency_hz = 50.0", "");
    let tiring = session("frequency_hz = 50.0", ", fatigue = {}");
    let none = session("frequency_hz = 50.0", "none");
    for (name, text, tolerance, code, words) in [
        ("none.toml", &none, "10", 1, ["E554", "muscle"]),
        ("zero.toml", &plain, "0", 2, ["E518", "--tolerance"]),
        ("nan.toml", &plain, "NaN", 2, ["E518", "--tolerance"]),
        ("much.toml", &plain, "601", 2, ["E518", "600"]),
        ("fine.toml", &tiring, "1", 1, ["E553", "least possible"]),
    ] {
        let (exit, _, said) = flexor(name, text, &["--tolerance", tolerance]);
        assert_eq!(exit, Some(code), "{name}: {said}");
        for word in words {
            assert!(said.contains(word), "{name}: {said}");
        }
    }
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
