//! Tests of `flexor monitor` in a pipe: a session in real time, one line per second, orderly ends.

use crate::program::{Board, flexor_command, test_folder};
use crate::steady::retry_after_stalls;
use serde_json::Value;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Writes the finger's session, cut to `seconds`.
fn session(seconds: u32) -> PathBuf {
    let text = include_str!("../sessions/hamana_exp4_two_point_finger.toml");
    let text = text.replace("duration_s = 30.0", &format!("duration_s = {seconds}.0"));
    let (before, after) = text.split_once("[measure]").unwrap();
    let (_, body) = after.split_once("[body]").unwrap();
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("live_{seconds}.toml"));
    std::fs::write(&path, format!("{before}[body]{body}")).unwrap();
    path
}

fn monitor() -> Command {
    flexor_command(Path::new("."), &["monitor"])
}

fn objects(text: &str) -> Vec<Value> {
    let lines = text.lines();
    lines
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

/// Returns all events of all lines in order.
fn events(lines: &[Value]) -> Vec<String> {
    let lists = lines.iter().filter_map(|line| line["events"].as_array());
    lists
        .flatten()
        .map(|e| e["text"].as_str().unwrap().to_owned())
        .collect()
}

#[test]
fn a_one_second_session_takes_a_second_and_ends_isolated() {
    let begin = Instant::now();
    let output = monitor().arg("--session").arg(session(1)).output().unwrap();
    assert!(begin.elapsed() >= Duration::from_secs(1));
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines.len() >= 2, "{text}");
    assert!(lines[0].contains(" s  stimulating  target"), "{text}");
    let last = lines.last().unwrap();
    assert!(last.contains("  idle "), "{text}");
    assert!(last.contains("1: 0.0 V"), "{text}");
    assert!(last.ends_with("session complete"), "{text}");
    assert!(!text.contains('\u{1b}'), "no escape codes in a pipe");
}

#[test]
fn json_lines_tell_a_moving_finger_and_the_counters() {
    let mut command = monitor();
    let command = command.args(["--json", "--session"]).arg(session(3));
    let output = command.output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let lines = objects(std::str::from_utf8(&output.stdout).unwrap());
    assert!(lines.len() >= 3, "{lines:?}");
    // The last line before the reference is low again, at 3 s.
    let is_high = |line: &&Value| {
        line["state"] == "stimulating" && line["t_s"].as_f64().is_some_and(|t_s| t_s < 2.3)
    };
    let running = lines.iter().rfind(is_high).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    assert!(number(&running["measured_deg"]) > 30.0, "{running}");
    let amplitude = number(&running["channels"][0]["amplitude"]);
    assert!(amplitude >= 20.0, "{running}");
    let setpoints = number(&running["counters"]["setpoints"]);
    assert!(setpoints > 90.0, "{running}");
    assert!(running["counters"]["lost"] == 0 && running["counters"]["bad"] == 0);
    let last = lines.last().unwrap();
    assert_eq!(last["state"], "idle");
    assert_eq!(
        events(&lines),
        ["stopping: Request", "stopped: Request", "session complete"]
    );
}

#[test]
fn seconds_end_a_session_early_and_properly() {
    let mut command = monitor();
    let command = command.args(["--json", "--seconds", "0.5", "--session"]);
    let output = command.arg(session(60)).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let lines = objects(std::str::from_utf8(&output.stdout).unwrap());
    assert_eq!(lines.last().unwrap()["state"], "idle");
    let expected_events = [
        "stopping: Request",
        "stopped: Request",
        "stopped on request",
    ];
    assert_eq!(events(&lines), expected_events);
}

#[cfg(unix)]
#[test]
fn a_signal_stops_stimulation_before_it_ends_the_program() {
    let mut command = monitor();
    let command = command.args(["--json", "--session"]).arg(session(50));
    let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
    // On any computer, the first line shows that the session runs.
    let mut output = BufReader::new(child.stdout.take().unwrap());
    let mut text = String::new();
    output.read_line(&mut text).unwrap();
    let id = child.id().to_string();
    let killed = Command::new("kill").args(["-TERM", &id]).status();
    assert!(killed.unwrap().success());
    output.read_to_string(&mut text).unwrap();
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(143), "{text}");
    let mut lines = objects(&text);
    // The reason of the end follows the lines of the dashboard.
    let error = lines.pop().unwrap()["error"].as_str().unwrap().to_owned();
    assert!(error.contains("E580 SIGTERM came at "), "{error}");
    assert!(events(&lines).contains(&"stopped: Request".to_owned()));
}

#[test]
fn a_simulator_without_a_session_is_wrong_use() {
    let output = monitor().output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("give --session"));
}

#[test]
fn a_device_is_watched_without_a_session() {
    let name = "a_device_is_watched_without_a_session";
    retry_after_stalls(name, is_watched);
}

/// Watches for 1.5 s of real time, in which the board's time continues.
fn is_watched() {
    let board = Board::tcp(&test_folder("live_lines"));
    let mut command = monitor();
    let command = command.args(["--json", "--seconds", "1.5", "--device"]);
    let output = command.arg(&board.at).output().unwrap();
    drop(board);
    assert!(output.status.success(), "{output:?}");
    let lines = objects(std::str::from_utf8(&output.stdout).unwrap());
    let last = lines.last().unwrap();
    assert_eq!(
        (&last["state"], &last["kind"]),
        (&"idle".into(), &"native".into())
    );
    assert!(last["counters"]["frames"].as_u64().unwrap() >= 5, "{last}");
    assert_eq!(last["counters"]["pulses"], 0);
    assert!(last["t_s"].as_f64().unwrap() > 1.0, "{last}");
}
