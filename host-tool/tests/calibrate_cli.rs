//! Tests of `flexor calibrate` as people and programs start it.

use crate::calibrate_lines;
use crate::program::{Board, ProgramOutput, command_result, run_flexor, test_folder, write_file};
use crate::steady::retry_after_stalls;
use std::io::{BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout};

pub const PLAN: &str = "wearer = \"W01\"
[limits]
max_current_ma = 30.0
[[electrode]]
channel = 3
place = \"wrist extensors\"
ceiling = 24.0
";

fn calibrate(folder: &Path, more: &[&str]) -> ProgramOutput {
    let mut words = vec!["--json", "calibrate", "--electrodes", "plan.toml", "--auto"];
    words.extend(more);
    run_flexor(folder, &words)
}

pub fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

#[test]
fn a_plan_becomes_a_wearer_file_and_only_its_owner_goes_on() {
    let folder = test_folder("calibrate");
    write_file(&folder, "plan.toml", PLAN);
    let (exit, output, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert_eq!(exit, Some(0), "{output}{error}");
    let done: serde_json::Value = serde_json::from_str(&output).unwrap();
    assert_eq!(
        (&done["event"], &done["electrodes"]),
        (&"done".into(), &1.into())
    );
    let file = read(&folder, "w.toml");
    assert!(file.contains("motor_threshold = ") && file.contains("host_timeout_ms = 100"));
    let refused = |more: &[&str], number: &str, detail: &str| {
        let (exit, text, error) = calibrate(&folder, more);
        assert_eq!(exit, Some(1), "{text}{error}");
        assert!(error.contains(number) && error.contains(detail), "{error}");
        assert_eq!(read(&folder, "w.toml"), file);
    };
    refused(&["--out", "w.toml"], "E672", "--resume");
    refused(
        &["--out", "w.toml", "--resume", "--wearer", "W02"],
        "E673",
        "W02",
    );
    refused(
        &["--out", "w.toml", "--resume", "--seed", "2"],
        "E673",
        "seed 2",
    );
    refused(&["--out", "other.toml", "--resume"], "E673", "no journal");
    write_file(&folder, "plan.toml", PLAN.replace("24.0", "23.0"));
    refused(
        &["--out", "w.toml", "--resume"],
        "E673",
        "the plan has changed",
    );
    write_file(&folder, "plan.toml", PLAN);
}

#[test]
fn files_of_others_and_damaged_journals_are_not_gone_on_with() {
    let folder = test_folder("calibrate_others");
    write_file(&folder, "plan.toml", PLAN);
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert_eq!(exit, Some(0), "{error}");
    let file = read(&folder, "w.toml");
    write_file(&folder, "w.toml", file.replace("\"W01\"", "\"W09\""));
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml", "--resume"]);
    assert!(
        exit == Some(1) && error.contains("E673") && error.contains("W09"),
        "{error}"
    );
    write_file(&folder, "w.toml", &file);
    // Nothing is left to do.
    let (exit, output, error) = calibrate(&folder, &["--out", "w.toml", "--resume"]);
    assert_eq!(exit, Some(0), "{output}{error}");
    assert_eq!(read(&folder, "w.toml"), file);
    // A damaged journal.
    let journal = read(&folder, "w.toml.journal");
    let cut: String = journal
        .lines()
        .skip(1)
        .map(|line| format!("{line}\n"))
        .collect();
    write_file(&folder, "w.toml.journal", cut);
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml", "--resume"]);
    assert!(
        exit == Some(1) && error.contains("E674") && error.contains("line 1"),
        "{error}"
    );
    assert_eq!(read(&folder, "w.toml"), file);
}

#[test]
fn every_mistake_of_a_plan_is_told_at_once_before_a_device_is_touched() {
    let folder = test_folder("calibrate_plan");
    let wrong = PLAN
        .replace("\"W01\"", "\"a person\"")
        .replace("24.0", "0.0001")
        + "[[electrode]]\nchannel = 11\nplace = \"\"\nceiling = 2.0\nfrequency_hz = 20.0\n";
    write_file(&folder, "plan.toml", wrong);
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert_eq!(exit, Some(1));
    for part in [
        "E670",
        "pseudonym",
        "ceiling is 0.0001",
        "channels are 1 to 10",
        "20",
        "start is 4",
    ] {
        assert!(error.contains(part), "{part}: {error}");
    }
    let beyond = PLAN.replace(
        "max_current_ma = 30.0",
        "max_current_ma = 20.0\nhost_timeout_ms = 101",
    );
    write_file(&folder, "plan.toml", &beyond);
    let (_, _, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert!(
        error.contains("E670") && error.contains("needs 100 or less"),
        "{error}"
    );
    write_file(
        &folder,
        "plan.toml",
        beyond.replace("\nhost_timeout_ms = 101", ""),
    );
    let (_, _, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert!(error.contains("E670") && error.contains("24 mA"), "{error}");
    let written = PLAN.replace("wrist extensors", "");
    std::fs::write(folder.join("plan.toml"), written).unwrap();
    let (_, _, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert!(error.contains("E670") && error.contains("place"), "{error}");
    assert!(!folder.join("w.toml.journal").exists() || read(&folder, "w.toml.journal").is_empty());
}

#[test]
fn no_program_answers_for_a_person_on_a_board() {
    let folder = test_folder("calibrate_board");
    write_file(&folder, "plan.toml", PLAN);
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml", "--device", "tcp:127.0.0.1:1"]);
    assert!(exit == Some(1) && error.contains("E679"), "{error}");
    let words = ["calibrate", "--electrodes", "plan.toml", "--out", "w.toml"];
    let (exit, _, error) = run_flexor(&folder, &words);
    assert!(exit == Some(1) && error.contains("E688"), "{error}");
}

#[test]
fn a_check_is_added_to_the_file_and_refuses_what_has_drifted() {
    let folder = test_folder("calibrate_check");
    write_file(&folder, "plan.toml", PLAN);
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert_eq!(exit, Some(0), "{error}");
    let check = |more: &[&str]| {
        let mut words = vec!["--json", "calibrate", "--check", "w.toml", "--auto"];
        words.extend(more);
        run_flexor(&folder, &words)
    };
    let (exit, output, error) = check(&[]);
    assert_eq!(exit, Some(0), "{output}{error}");
    assert!(output.contains("\"accepted\":true"), "{output}");
    let (exit, _, error) = check(&["--body", "still"]);
    assert!(exit == Some(1) && error.contains("E682"), "{error}");
    let file = read(&folder, "w.toml");
    assert_eq!(file.matches("[[check]]").count(), 2, "{file}");
    assert_eq!(file.matches("accepted = false").count(), 1, "{file}");
}

#[test]
fn a_check_that_would_say_nothing_is_refused_before_anything_is_given() {
    let folder = test_folder("calibrate_no_check");
    write_file(&folder, "plan.toml", PLAN);
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert_eq!(exit, Some(0), "{error}");
    let file = read(&folder, "w.toml");
    let check = ["calibrate", "--check", "w.toml", "--auto"];
    let (exit, _, error) = run_flexor(&folder, &[&check[..], &["--tolerance", "30"]].concat());
    assert!(exit == Some(1) && error.contains("E696"), "{error}");
    let measured = file.replace("evidence = \"simulated\"", "evidence = \"measured\"");
    assert_ne!(measured, file);
    write_file(&folder, "w.toml", &measured);
    let (exit, _, error) = run_flexor(&folder, &check);
    assert!(exit == Some(1) && error.contains("E695"), "{error}");
    assert_eq!(read(&folder, "w.toml"), measured);
}

#[test]
fn where_nothing_is_found_or_could_be_kept_the_command_says_so() {
    let folder = test_folder("calibrate_nothing");
    write_file(&folder, "plan.toml", PLAN);
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml", "--body", "still"]);
    assert!(exit == Some(1) && error.contains("E694"), "{error}");
    assert!(error.contains("was left out at placement"), "{error}");
    assert!(!folder.join("w.toml").exists());
    let (exit, _, error) = calibrate(&folder, &["--out", "none/w.toml"]);
    assert!(exit == Some(1) && error.contains("E693"), "{error}");
    let seed = ["--out", "v.toml", "--seed", "9223372036854775808"];
    let (exit, _, error) = calibrate(&folder, &seed);
    assert!(exit == Some(2) && error.contains("--seed"), "{error}");
    assert!(!folder.join("v.toml.journal").exists());
}

#[test]
fn a_level_changed_in_the_journal_is_no_limit() {
    let folder = test_folder("calibrate_changed");
    write_file(&folder, "plan.toml", PLAN);
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml"]);
    assert_eq!(exit, Some(0), "{error}");
    let journal = read(&folder, "w.toml.journal");
    let found = journal
        .lines()
        .find(|line| line.contains("\"step\":\"comfort\",\"value\""));
    let found = found.unwrap();
    let level = found.split("\"level\":").nth(1).unwrap();
    let level = level.split('}').next().unwrap();
    let changed = found.replace(&format!("\"level\":{level}"), "\"level\":24.0");
    assert_ne!(changed, found);
    write_file(&folder, "w.toml.journal", journal.replace(found, &changed));
    let (exit, _, error) = calibrate(&folder, &["--out", "w.toml", "--resume"]);
    assert!(exit == Some(1) && error.contains("E674"), "{error}");
}

/// The program, driven by JSON lines.
pub struct ScriptedProgram {
    pub process: Child,
    orders: Option<ChildStdin>,
    lines: BufReader<ChildStdout>,
}

impl ScriptedProgram {
    fn start(folder: &Path) -> Self {
        Self::start_on(folder, &[])
    }

    pub fn start_on(folder: &Path, more: &[&str]) -> Self {
        let mut process = calibrate_lines::start_calibration(folder, more);
        let orders = process.stdin.take();
        let lines = BufReader::new(process.stdout.take().unwrap());
        Self {
            process,
            orders,
            lines,
        }
    }

    pub fn send_order(&mut self, line: &str) {
        writeln!(self.orders.as_mut().unwrap(), "{line}").unwrap();
    }

    /// Returns the next line that satisfies the condition.
    pub fn next_line(&mut self, is: impl Fn(&serde_json::Value) -> bool) -> serde_json::Value {
        calibrate_lines::next_line(&mut self.lines, is)
    }

    pub fn wait_until_ready(&mut self) -> serde_json::Value {
        self.next_line(|value| {
            value["event"] == "view" && value["phase"] == "ready" && value["question"].is_null()
        })
    }

    pub fn wait_for_end(mut self) -> ProgramOutput {
        drop(self.orders.take());
        let mut rest = String::new();
        std::io::Read::read_to_string(&mut self.lines, &mut rest).unwrap();
        let (exit, _, error) = command_result(self.process.wait_with_output().unwrap());
        (exit, rest, error)
    }
}

#[test]
fn another_program_orders_by_lines_and_nonsense_changes_nothing() {
    let name = "another_program_orders_by_lines_and_nonsense_changes_nothing";
    retry_after_stalls(name, order_by_lines);
}

/// The second raise comes during the second in which the first level is presented.
fn order_by_lines() {
    let folder = test_folder("calibrate_lines");
    write_file(&folder, "plan.toml", PLAN);
    let mut driven = ScriptedProgram::start(&folder);
    let view = driven.wait_until_ready();
    assert_eq!(
        (&view["raise"], &view["orders"][0]),
        (&2.0.into(), &"raise".into())
    );
    for nonsense in [
        "raise",
        "{}",
        "{\"order\":\"raise\",\"by\":99}",
        "[1]",
        "\u{7f}",
    ] {
        driven.send_order(nonsense);
        let refusal = driven.next_line(|value| value["event"] == "refused");
        assert!(
            refusal["error"].as_str().unwrap().starts_with("E678 "),
            "{refusal}"
        );
    }
    driven.send_order("{\"order\":\"yes\"}");
    let refusal = driven.next_line(|value| value["event"] == "refused");
    assert!(
        refusal["error"].as_str().unwrap().starts_with("E671 "),
        "{refusal}"
    );
    driven.send_order("{\"order\":\"raise\"}");
    driven.next_line(|value| {
        value["event"] == "view" && value["phase"] == "on" && value["given"] == 2.0
    });
    // A second raise during the first is not a second step.
    driven.send_order("{\"order\":\"raise\"}");
    let refusal = driven.next_line(|value| value["event"] == "refused");
    assert!(
        refusal["error"].as_str().unwrap().contains("being given"),
        "{refusal}"
    );
    driven.next_line(|value| value["question"].is_string());
    driven.send_order("{\"order\":\"no\"}");
    driven.send_order("{\"order\":\"abort\"}");
    let (exit, rest, error) = driven.wait_for_end();
    assert!(exit == Some(1) && error.contains("E683"), "{rest}{error}");
    assert!(read(&folder, "w.toml.journal").contains("\"ended\""));
}

#[test]
fn an_input_that_ends_and_a_signal_end_it_with_the_journal_whole() {
    let folder = test_folder("calibrate_ended");
    write_file(&folder, "plan.toml", PLAN);
    let mut driven = ScriptedProgram::start(&folder);
    driven.wait_until_ready();
    driven.send_order("{\"order\":\"raise\"}");
    driven.next_line(|value| value["phase"] == "on");
    let (exit, _, error) = driven.wait_for_end();
    assert!(exit == Some(1) && error.contains("E684"), "{error}");
    std::fs::remove_file(folder.join("w.toml.journal")).unwrap();
    let mut driven = ScriptedProgram::start(&folder);
    driven.wait_until_ready();
    driven.send_order("{\"order\":\"raise\"}");
    driven.next_line(|value| value["phase"] == "on");
    let id = driven.process.id().to_string();
    let sent = std::process::Command::new("sh")
        .args(["-c", &format!("kill -INT {id}")])
        .status();
    assert!(sent.unwrap().success());
    // The input stays open, so only the signal ends the program.
    let mut rest = String::new();
    std::io::Read::read_to_string(&mut driven.lines, &mut rest).unwrap();
    let (exit, _, error) = driven.wait_for_end();
    assert!(exit == Some(130) && error.contains("E580"), "{rest}{error}");
    let journal = read(&folder, "w.toml.journal");
    assert!(
        journal.ends_with('\n') && journal.contains("E580"),
        "{journal}"
    );
    let (exit, output, error) = calibrate(&folder, &["--out", "w.toml", "--resume"]);
    assert_eq!(exit, Some(0), "{output}{error}");
}

/// Orders for a board behind a socket, whose connection is cut during a presentation.
#[test]
fn a_board_behind_a_port_is_ordered_by_lines_until_it_is_lost() {
    let folder = test_folder("calibrate_port");
    write_file(&folder, "plan.toml", PLAN);
    let board = Board::tcp(&folder);
    let at = board.at.clone();
    let mut driven = ScriptedProgram::start_on(&folder, &["--device", &at]);
    let view = driven.wait_until_ready();
    assert!(
        view["reading_n"].is_null(),
        "a board has no instrument: {view}"
    );
    driven.send_order("{\"order\":\"raise\"}");
    driven.next_line(|value| value["question"].is_string());
    driven.send_order("{\"order\":\"no\"}");
    driven.wait_until_ready();
    driven.send_order("{\"order\":\"raise\"}");
    driven.next_line(|value| value["phase"] == "on" && value["given"] == 4.0);
    drop(board);
    let mut rest = String::new();
    std::io::Read::read_to_string(&mut driven.lines, &mut rest).unwrap();
    let (exit, _, error) = driven.wait_for_end();
    assert!(exit == Some(1) && error.contains("E50"), "{rest}{error}");
    let journal = read(&folder, "w.toml.journal");
    assert!(
        journal.ends_with('\n') && journal.contains("\"ended\""),
        "{journal}"
    );
}
