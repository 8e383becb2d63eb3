//! Tests of `flexor run --watch` at a terminal: keys reach the device, are recorded, and are
//! repeated.

use crate::program::{one_channel, run_flexor, test_folder, write_file};
use crate::record_again::files;
use crate::seated::{TerminalProgram, size};
use std::path::Path;
use std::time::{Duration, Instant};

const UP: &str = "\x1b[A";
const DOWN: &str = "\x1b[B";

/// Time after which a program counts as hanging.
const PATIENCE: Duration = Duration::from_secs(50);

/// Returns the rows of the record's markers that a key made: kind, intensity, text.
fn marker_rows(folder: &Path) -> Vec<(String, String, String)> {
    let dir = std::fs::read_dir(folder.join("out")).unwrap();
    let mut trials = dir.map(|entry| entry.unwrap().path());
    let Some(trial) = trials.find(|path| path.join("markers.csv").is_file()) else {
        return Vec::new();
    };
    let text = std::fs::read_to_string(trial.join("markers.csv")).unwrap();
    let rows = text.lines().skip(1).map(|line| {
        let fields: Vec<&str> = line.splitn(7, ',').collect();
        let field = |index: usize| fields[index].to_owned();
        (field(3), field(5), field(6))
    });
    rows.collect()
}

/// Reads the terminal until the record has a row of this kind.
fn wait_for_marker(seated: &mut TerminalProgram, folder: &Path, kind: &str) {
    let begin = Instant::now();
    while !folder.join("out").is_dir() || !marker_rows(folder).iter().any(|key| key.0 == kind) {
        seated.read();
        assert!(begin.elapsed() < PATIENCE, "no {kind}");
    }
}

fn wait_at_terminal(seated: &mut TerminalProgram, ms: u64) {
    let begin = Instant::now();
    while begin.elapsed() < Duration::from_millis(ms) {
        seated.read();
    }
}

#[test]
fn keys_pause_change_and_mark_a_session_that_is_repeated_to_the_byte() {
    let folder = test_folder("watch_keys");
    write_file(&folder, "session.toml", one_channel(60.0, 50));
    let words = "run session.toml --watch --out out";
    let mut seated = TerminalProgram::start(&folder, words, size(100, 30));
    seated.wait_for_text("STIMULATING");
    for (key, kind) in [(UP, "raise"), (DOWN, "lower"), (" ", "pause")] {
        seated.type_text(key);
        wait_for_marker(&mut seated, &folder, kind);
    }
    seated.wait_for_text("PAUSED");
    wait_at_terminal(&mut seated, 700);
    seated.type_text(" ");
    wait_for_marker(&mut seated, &folder, "resume");
    seated.type_text("mfelt, \"so\"\r");
    wait_for_marker(&mut seated, &folder, "mark");
    seated.type_text("q");
    assert_eq!(seated.wait_for_exit(), Some(0), "{}", seated.seen);
    let keys = marker_rows(&folder);
    let rows: Vec<_> = keys.iter().map(|(a, b, c)| (&**a, &**b, &**c)).collect();
    let expected = [
        ("raise", "105", ""),
        ("lower", "100", ""),
        ("pause", "", ""),
        ("resume", "", ""),
        ("mark", "", "\"felt, \"\"so\"\"\""),
        ("stop", "", ""),
    ];
    assert_eq!(rows, expected);
    let (code, people, error) = run_flexor(&folder, &["rerun", "out", "--out", "again"]);
    assert_eq!(code, Some(0), "{people}{error}");
    // Facts about the host may differ.
    let same = |dir: &str| {
        let mut files = files(&folder.join(dir));
        files.retain(|(name, _)| !name.ends_with("run.json") && !name.ends_with("report.html"));
        files
    };
    assert!(same("out") == same("again"));
}

#[test]
fn a_key_held_down_raises_by_its_press() {
    let folder = test_folder("watch_held");
    write_file(&folder, "session.toml", one_channel(60.0, 50));
    let words = "run session.toml --watch --out out";
    let mut seated = TerminalProgram::start(&folder, words, size(100, 30));
    seated.wait_for_text("STIMULATING");
    for _ in 0..50 {
        seated.type_text(UP);
    }
    wait_for_marker(&mut seated, &folder, "raise");
    wait_at_terminal(&mut seated, 200);
    seated.type_text("q");
    assert_eq!(seated.wait_for_exit(), Some(0), "{}", seated.seen);
    let raised = marker_rows(&folder)
        .into_iter()
        .filter(|key| key.0 == "raise");
    // On a computer that stalls, one press may be separated from the rest.
    let raised = raised.count();
    assert!((1..=3).contains(&raised), "{raised}");
}

#[test]
fn a_terminal_that_is_closed_stops_the_session_and_keeps_the_record() {
    let folder = test_folder("watch_closed");
    write_file(&folder, "session.toml", one_channel(60.0, 50));
    let words = "run session.toml --watch --out out";
    let mut seated = TerminalProgram::start(&folder, words, size(100, 30));
    seated.wait_for_text("STIMULATING");
    seated.type_text(UP);
    wait_for_marker(&mut seated, &folder, "raise");
    assert_eq!(seated.close().code(), Some(129));
    assert!(marker_rows(&folder).iter().any(|key| key.0 == "raise"));
    let summary = std::fs::read_to_string(folder.join("out/summary.json")).unwrap();
    assert!(summary.contains("SIGHUP"), "{summary}");
}

#[test]
fn without_a_terminal_it_is_refused() {
    let folder = test_folder("watch_refused");
    write_file(&folder, "session.toml", one_channel(1.0, 50));
    for more in [&[][..], &["--json"]] {
        let words = [&["run", "session.toml", "--watch", "--out", "out"], more].concat();
        let (code, _, error) = run_flexor(&folder, &words);
        assert_eq!(code, Some(2), "{error}");
        assert!(error.contains("--watch needs a terminal"), "{error}");
        assert!(!folder.join("out").exists());
    }
}
