//! Tests of `flexor hil`: what it refuses, what it leaves behind, and which lines it compares.

use crate::program::{FLEXOR, ProgramOutput, flexor_command, run_flexor, test_folder};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

fn hil(folder: &Path, arguments: &str) -> ProgramOutput {
    let words: Vec<&str> = ["hil"].into_iter().chain(arguments.split(' ')).collect();
    let (exit, output, error) = run_flexor(folder, &words);
    for line in output.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    (exit, output, error)
}

fn refused(folder: &Path, arguments: &str, exit: i32, words: &[&str]) {
    let (code, output, error) = hil(folder, arguments);
    assert_eq!(code, Some(exit), "{arguments}: {output}{error}");
    for word in words {
        assert!(error.contains(word), "{arguments}: {word}: {error}");
    }
}

#[test]
fn a_session_that_leaves_channels_unused_passes() {
    let folder = test_folder("hil_unused");
    // Sync does not move in this session, so the busiest line is in every capture.
    let (exit, plan, error) = hil(&folder, "drop_foot --plan");
    assert_eq!(exit, Some(0), "{error}");
    assert_eq!(plan.matches(" c1 ").count(), 3, "{plan}");
    assert_eq!(plan.matches(" sync ").count(), 1, "{plan}");
    let (exit, _, error) = hil(&folder, "drop_foot --rehearse q --seconds 0.2");
    assert_eq!(exit, Some(0), "{error}");
    let captures = "q/capture-1.sr q/capture-2.sr q/capture-3.sr";
    let judge = format!("drop_foot {captures} --seconds 0.18 --sheet sheet.json");
    let (exit, text, error) = hil(&folder, &judge);
    assert_eq!(exit, Some(0), "{text}{error}");
    assert!(text.starts_with("verdict: passed"), "{text}");
    assert!(!text.contains("not compared"), "{text}");
    let sheet: Value =
        serde_json::from_slice(&fs::read(folder.join("sheet.json")).unwrap()).unwrap();
    assert_eq!(
        (&sheet["common_line"], &sheet["verdict"]),
        (&"c1".into(), &"passed".into())
    );
}

#[test]
fn the_pump_of_the_reference_board_is_compared() {
    let folder = test_folder("hil_pump");
    let session = "ten_channels --seconds 0.2";
    for board in ["reference", "weact"] {
        let (exit, _, error) = hil(
            &folder,
            &format!("{session} --board {board} --rehearse {board}"),
        );
        assert_eq!(exit, Some(0), "{error}");
    }
    let judge = |captures: &str| {
        let files: Vec<String> = (1..=3)
            .map(|n| format!("{captures}/capture-{n}.sr"))
            .collect();
        hil(
            &folder,
            &format!(
                "ten_channels --board reference --seconds 0.2 {}",
                files.join(" ")
            ),
        )
    };
    let (exit, text, error) = judge("reference");
    assert_eq!(exit, Some(0), "{text}{error}");
    // A breadboard drives no pump.
    let (exit, text, _) = judge("weact");
    assert_eq!(exit, Some(1), "{text}");
    assert!(
        text.starts_with("verdict: failed") && text.contains("pump: "),
        "{text}"
    );
}

#[test]
fn a_session_that_the_board_cannot_run_has_no_plan() {
    let folder = test_folder("hil_plan");
    refused(&folder, "nonsense --plan", 1, &["nonsense"]);
    refused(
        &folder,
        "ten_channels --plan --board feather",
        1,
        &["E505", "channel 1:"],
    );
    for (options, option, range) in [
        ("--rehearse q --ppm nan", "--ppm", "999"),
        ("--rehearse q --ppm 1000", "--ppm", "999"),
        ("--rehearse q --rate 0", "--rate", "1..=1000"),
        ("--plan --inputs 0", "--inputs", "2..=64"),
        ("--plan --seconds 0", "--seconds", "60"),
    ] {
        refused(
            &folder,
            &format!("ten_channels {options}"),
            2,
            &[option, range],
        );
    }
    assert!(!folder.join("q").exists());
}

#[test]
fn inputs_are_neither_replaced_nor_waited_for() {
    let folder = test_folder("hil_files");
    for name in ["1.sr", "2.sr", "3.sr"] {
        fs::write(folder.join(name), name).unwrap();
    }
    let captures = "ten_channels 1.sr 2.sr 3.sr";
    refused(
        &folder,
        &format!("{captures} --overwrite --sheet ./2.sr"),
        1,
        &["E586", "2.sr"],
    );
    assert_eq!(fs::read(folder.join("2.sr")).unwrap(), b"2.sr");
    refused(
        &folder,
        "ten_channels --rehearse 1.sr",
        1,
        &["E583", "1.sr"],
    );
    fs::remove_file(folder.join("1.sr")).unwrap();
    let made = Command::new("mkfifo").arg(folder.join("1.sr")).status();
    assert!(made.unwrap().success());
    let words: Vec<&str> = ["hil"].into_iter().chain(captures.split(' ')).collect();
    let mut program = flexor_command(&folder, &words);
    let mut program = program.stderr(Stdio::null()).spawn().unwrap();
    let begin = Instant::now();
    while program.try_wait().unwrap().is_none() && begin.elapsed() < Duration::from_secs(60) {
        sleep(Duration::from_millis(20));
    }
    let _ = program.kill(); // if it waits for the pipe
    assert_eq!(program.wait().unwrap().code(), Some(1));
}

#[test]
fn ctrl_c_ends_a_rehearsal_and_leaves_no_damaged_capture() {
    let folder = test_folder("hil_signal");
    let words = ["hil", "ten_channels", "--seconds", "5", "--rehearse", "q"];
    let mut command = Command::new(FLEXOR);
    let command = command.current_dir(&folder).args(words);
    let program = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    while !folder.join("q").is_dir() {
        assert!(begin.elapsed() < Duration::from_secs(60));
        sleep(Duration::from_millis(5));
    }
    sleep(Duration::from_millis(200));
    let signal = Command::new("kill")
        .args(["-INT", &program.id().to_string()])
        .status();
    assert!(signal.unwrap().success());
    let ended = program.wait_with_output().unwrap();
    let error = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(130), "{error}");
    assert!(error.contains("E580 SIGINT"), "{error}");
    assert_eq!(fs::read_dir(folder.join("q")).unwrap().count(), 0);
}
