//! Tests of output paths: nothing that was read or recorded is lost, nothing else is changed
//! without an order, and messages about a record agree with the disk.

use super::program::{
    Board, FLEXOR, command_result, one_channel, run_flexor, test_folder, write_file,
};
use super::record_again::{files, run_failing, run_json, shortened_session};
use host_core::record::{self, Ending};
use std::fs;
use std::net::TcpListener;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

/// Checks that a command is refused without any change in `folder`.
fn assert_refused(folder: &Path, line: &str, exit: i32, says: &str) {
    let before = files(folder);
    let (code, error) = run_failing(folder, line);
    assert_eq!(code, Some(exit), "{line}: {error}");
    assert!(error.contains(says), "{line}: {error}");
    assert!(files(folder) == before, "{line}: something was touched");
}

#[test]
fn a_file_is_replaced_only_where_it_is_meant() {
    let folder = test_folder("files");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    run_json(&folder, &format!("run {file} --out one"));
    fs::write(folder.join("there"), "years").unwrap();
    symlink("one/01-ten-channels/samples.csv", folder.join("link")).unwrap();
    fs::create_dir(folder.join("new")).unwrap();
    for command in ["run --out new --vcd", "edges --seconds 0.1 --csv"] {
        let (command, option) = command.rsplit_once(' ').unwrap();
        let line = |path: &str| format!("{command} {file} {option} {path}");
        assert_refused(&folder, &line("there"), 1, "E587 there already exists");
        assert_refused(&folder, &line("absent/x"), 1, "E583 absent/x cannot be");
        assert_refused(&folder, &line("one"), 1, "E58");
        for kept in [
            file.as_str(),
            "one/run.json",
            "one/01-ten-channels/new.vcd",
            "./one/../link",
        ] {
            assert_refused(&folder, &line(kept), 1, "E586");
            assert_refused(&folder, &(line(kept) + " --overwrite"), 1, "E586");
        }
    }
    let line = format!("run {file} --out new --vcd new/run.json");
    assert_refused(&folder, &line, 1, "E586");
    run_json(&folder, &format!("run {file} --vcd there --overwrite"));
    let made = fs::read_to_string(folder.join("there")).unwrap();
    assert!(made.starts_with("$"), "no VCD: {made:.40}");
    let line = format!("edges {file} --seconds 0.1 --csv there --overwrite");
    run_json(&folder, &line);
    let made = fs::read_to_string(folder.join("there")).unwrap();
    assert!(made.starts_with("t_us,"), "no edges: {made:.40}");
    // The record's own VCD file belongs to the record.
    let line = format!("run {file} --out own --vcd own/outputs.vcd");
    run_json(&folder, &line);
    run_json(&folder, &(line + " --overwrite"));
}

#[test]
fn a_record_goes_only_for_a_device_that_answers() {
    let folder = test_folder("mute");
    let file = "short.toml";
    write_file(&folder, file, one_channel(0.2, 50));
    run_json(&folder, &format!("run {file} --out one"));
    let mute = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = mute.local_addr().unwrap();
    let again = format!("run {file} --out one --overwrite --device");
    assert_refused(&folder, &format!("{again} tcp:{at}"), 1, "E501");
    // A device that answers replaces the record.
    let board = Board::tcp(&folder);
    run_json(&folder, &format!("{again} {}", board.at));
    let run = record::load(&folder.join("one")).unwrap();
    assert_eq!(run.ending, Ending::complete());
    assert!(!run.is_repeatable());
}

#[test]
fn a_link_in_a_record_is_never_followed() {
    let folder = test_folder("links");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    let trial = folder.join("one/01-ten-channels");
    for has_trial in [true, false] {
        let _ = fs::remove_dir_all(folder.join("one"));
        let _ = fs::remove_dir_all(folder.join("precious"));
        run_json(&folder, &format!("run {file} --out one"));
        fs::rename(&trial, folder.join("precious")).unwrap();
        symlink("../precious", &trial).unwrap();
        if !has_trial {
            fs::remove_file(folder.join("precious/trial.json")).unwrap();
        }
        let before = files(&folder.join("precious"));
        let line = format!("run {file} --out one --seed 2 --overwrite");
        run_json(&folder, &line);
        assert!(files(&folder.join("precious")) == before, "{has_trial}");
        assert!(!trial.is_symlink());
        assert_eq!(record::load(&folder.join("one")).unwrap().trials.len(), 1);
    }
}

/// Every file size up to a page's is too large, as with a quota or a full disk.
#[test]
fn what_is_said_of_a_record_is_what_lies_there() {
    let folder = test_folder("too_large");
    let file = shortened_session(&folder, "ten_channels.toml", 0.2);
    let mut page_failures = 0;
    for most in (1_000..40_000).step_by(1_500) {
        let _ = fs::remove_dir_all(folder.join("out"));
        let output = Command::new("prlimit")
            .arg(format!("--fsize={most}"))
            .args([FLEXOR, "run", &file, "--out", "out"])
            .current_dir(&folder)
            .output()
            .unwrap();
        let (exit, _, error) = command_result(output);
        let ending = Ending::load(&folder.join("out"));
        let says_incomplete = error.contains("marked incomplete");
        if exit == Some(0) {
            assert_eq!(ending, Ending::complete(), "{most}");
            continue;
        }
        assert_eq!(exit, Some(1), "{most}: {error}");
        assert!(error.contains("E582 cannot write"), "{most}: {error}");
        assert!(
            ending.is_incomplete() || !says_incomplete,
            "{most}: {error}"
        );
        if !ending.is_incomplete() {
            assert!(error.contains("complete and in out"), "{most}: {error}");
            assert!(error.contains("flexor report out"), "{most}: {error}");
            assert_eq!(ending.exit_code, Some(1), "{most}");
            assert!(ending.reason.unwrap().contains("E582"), "{most}");
            page_failures += 1;
        }
    }
    assert!(
        page_failures > 3,
        "{page_failures} times the page alone was too large"
    );
    run_json(&folder, "report out");
}

#[test]
fn a_long_title_can_run() {
    let folder = test_folder("long");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    let text = fs::read_to_string(folder.join(&file)).unwrap();
    let line = text.lines().find(|l| l.starts_with("title")).unwrap();
    let title = "筋".repeat(90);
    let text = text.replace(line, &format!("title = \"{title}\""));
    fs::write(folder.join(&file), text).unwrap();
    run_json(&folder, &format!("run {file} --out one"));
    let run = record::load(&folder.join("one")).unwrap();
    assert_eq!((&run.title, run.damage), (&title, vec![]));
    run_json(&folder, "rerun one --out two");
}

#[test]
fn the_seed_behind_a_port_is_not_ours_to_tell() {
    let folder = test_folder("seed");
    let file = "short.toml";
    write_file(&folder, file, one_channel(0.2, 50));
    let board = Board::tcp(&folder);
    let line = format!("run {file} --out one --device {}", board.at);
    for option in ["--seed 7", "--vcd x.vcd"] {
        let (exit, error) = run_failing(&folder, &format!("{line} {option}"));
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains("E518 --seed and --vcd"), "{error}");
    }
    assert!(run_json(&folder, &line)["seed"].is_null());
    assert_eq!(record::load(&folder.join("one")).unwrap().seed, None);
    let summary = fs::read_to_string(folder.join("one/summary.json")).unwrap();
    assert!(summary.contains("\"seed\": null"), "{summary}");
    let page = fs::read_to_string(folder.join("one/report.html")).unwrap();
    assert!(page.contains("Seed unknown"));
}

#[test]
fn links_to_nothing_and_pipes_are_refused() {
    let folder = test_folder("pipes");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    symlink("nowhere", folder.join("dangling")).unwrap();
    for line in [
        format!("run {file} --out dangling"),
        format!("run {file} --vcd dangling"),
        format!("edges {file} --seconds 0.1 --csv dangling"),
    ] {
        let (exit, error) = run_failing(&folder, &line);
        assert_eq!(exit, Some(1), "{error}");
        let says = "E583 dangling cannot be used: it is a symbolic link";
        assert!(error.contains(says), "{line}: {error}");
    }
    let pipe = folder.join("pipe");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    for line in ["check pipe", "run pipe"] {
        let (exit, error) = run_failing(&folder, line);
        assert_eq!(exit, Some(1), "{error}");
        assert!(error.contains("E400"), "{error}");
        assert!(error.contains("not a regular file"), "{error}");
    }
}

#[test]
fn a_terminal_obeys_no_session_file() {
    let folder = test_folder("obeyed");
    let title = r#"title = "a\u001b[2J\u0000\u202eb\nE999: c""#;
    let text = one_channel(0.1, 50).replace("title = \"One channel\"", title);
    write_file(&folder, "good.toml", &text);
    write_file(
        &folder,
        "bad.toml",
        text.replace("number = 1", "number = 1 \u{1b}[2J\u{202e}"),
    );
    let (_, error) = run_failing(&folder, "check good.toml");
    assert!(
        error.contains("E412") && error.contains("U+001B"),
        "{error}"
    );
    for line in [
        "check good.toml",
        "run good.toml --out one",
        "check bad.toml",
    ] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let (_, out, error) = run_flexor(&folder, &arguments);
        for text in [out, error] {
            let obeyed = |c: char| c.is_control() && c != '\n' || c == '\u{202e}';
            assert!(!text.contains(obeyed), "{line}: {text:?}");
            assert!(!text.contains("\nE999"), "{line}: {text}");
        }
    }
}

#[test]
fn a_comparison_replaces_its_own_page_and_nothing_else() {
    let folder = test_folder("compare_page");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    for (name, seed) in [("one", 1), ("two", 2)] {
        run_json(&folder, &format!("run {file} --seed {seed} --out {name}"));
    }
    run_json(&folder, "compare one two --out both");
    assert_refused(&folder, "compare one two --out both", 1, "E590");
    run_json(&folder, "compare two one --out both --overwrite");
    fs::write(folder.join("both/thesis.tex"), "years").unwrap();
    assert_refused(&folder, "compare one two --out both --overwrite", 1, "E592");
}
