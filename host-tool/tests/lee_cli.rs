//! Tests of `flexor experiment lee`: results after an interruption, and refusals.

use crate::program::{flexor_command, run_flexor, test_folder};
use serde_json::Value;
use std::process::{Command, Stdio};
use std::time::Duration;

/// After a signal, finished work is complete and reported, and the program states that it was
/// interrupted.
#[test]
fn a_signal_leaves_what_was_computed() {
    let folder = test_folder("lee_cut_short");
    let words = ["experiment", "lee", "--draws", "500", "--out", "broken"];
    let mut command = flexor_command(&folder, &words);
    let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
    let program = command.spawn().unwrap();
    std::thread::sleep(Duration::from_secs(4));
    let id = program.id().to_string();
    let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(sent.success());
    let ended = program.wait_with_output().unwrap();
    let error = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(130), "{error}");
    let text = std::fs::read_to_string(folder.join("broken/result.json")).unwrap();
    let result: Value = serde_json::from_str(&text).unwrap();
    let cut_short = result["cut_short"].as_str().unwrap();
    assert!(cut_short.starts_with("Cut short after"), "{cut_short}");
    let rows = std::fs::read_to_string(folder.join("broken/draws.csv")).unwrap();
    let fields: Vec<usize> = rows.lines().map(|row| row.matches(',').count()).collect();
    assert!(rows.ends_with('\n') && fields.iter().all(|field| *field == fields[0]));
}

#[test]
fn what_it_cannot_do_is_wrong_use() {
    let folder = test_folder("lee_wrong");
    for (words, wanted) in [
        ("--draws 0", "--draws is 0; allowed: 1 to 1000"),
        ("--device tcp:nowhere:1", "the test rig is simulated"),
        ("--wearer P", "do not apply to lee"),
    ] {
        let words: Vec<&str> = ["experiment", "lee"]
            .into_iter()
            .chain(words.split(' '))
            .collect();
        let (exit, _, error) = run_flexor(&folder, &words);
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
}
