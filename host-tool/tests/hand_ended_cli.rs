//! Tests of interrupted studies of Hamana 2022: finished work is reported and written.

use crate::program::{command_result, flexor_command, test_folder};
use serde_json::Value;
use std::process::{Command, Stdio};

/// A folder that disappears during a study takes its files, but not the computed results.
#[test]
fn what_was_computed_is_told_when_its_folder_is_gone_and_a_signal_came() {
    let folder = test_folder("hand_vanished");
    let asked = [
        "experiment",
        "hamana-hold",
        "--draws",
        "1000",
        "--out",
        "gone",
    ];
    let mut program = flexor_command(&folder, &asked);
    program.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut program = program.spawn().unwrap();
    while !folder.join("gone/.lock").exists() {
        assert!(program.try_wait().unwrap().is_none(), "it has ended");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    // Some draws are finished by then; the number does not matter.
    std::thread::sleep(std::time::Duration::from_millis(1500));
    std::fs::remove_dir_all(folder.join("gone")).unwrap();
    let id = program.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(sent.success());
    let (exit, people, error) = command_result(program.wait_with_output().unwrap());
    assert_eq!(exit, Some(1), "{people}{error}");
    assert!(people.contains("P, angle lost with one point"), "{people}");
    assert!(people.contains("Cut short after "), "{people}");
    assert!(error.contains("gone"), "{error}");
}

/// After a signal, finished work is reported and written, and the exit code is the signal's.
#[test]
fn a_signal_leaves_what_was_computed() {
    let folder = test_folder("hand_signal");
    let wanted = [
        "--json",
        "experiment",
        "hamana-4",
        "--wearer",
        "all",
        "--draws",
        "1000",
    ];
    let mut program = flexor_command(&folder, &[&wanted[..], &["--out", "cut"]].concat());
    program.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut program = program.spawn().unwrap();
    while !folder.join("cut/.lock").exists() {
        assert!(program.try_wait().unwrap().is_none(), "it has ended");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    std::thread::sleep(std::time::Duration::from_millis(1500));
    let id = program.id().to_string();
    let sent = Command::new("kill").args(["-TERM", &id]).status().unwrap();
    assert!(sent.success());
    let (exit, output, error) = command_result(program.wait_with_output().unwrap());
    assert_eq!(exit, Some(143), "{output}{error}");
    let document: Value = serde_json::from_str(&output).unwrap();
    let cut_short = document["result"]["cut_short"].as_str().unwrap();
    assert!(cut_short.starts_with("Cut short after "), "{cut_short}");
    let written = std::fs::read_to_string(folder.join("cut/result.json")).unwrap();
    let written: Value = serde_json::from_str(&written).unwrap();
    assert_eq!(written, document["result"]);
    assert!(folder.join("cut/draws.csv").is_file());
}
