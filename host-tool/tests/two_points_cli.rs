//! Tests of `flexor two-points`: output for people and machines, files and refusals.

use crate::program::{check_rerun_command, flexor_command, run_flexor, test_folder};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};

/// A cell, and another seed than the judged one.
const FEW: [&str; 5] = ["two-points", "--cell", "15", "--seed", "1001"];
const RESULT: [&str; 3] = ["result.json", "result.html", "draws.csv"];

/// Checks that the results in `out` and `other` are identical byte for byte.
fn same(folder: &Path, out: &str, other: &str) {
    for file in RESULT {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(read(out) == read(other), "{file} of {out} and {other}");
    }
}

#[test]
fn a_cell_is_told_and_written() {
    let folder = test_folder("two_points");
    let few = [&FEW[..], &["--draws", "3"]].concat();
    let (exit, people, _) = run_flexor(&folder, &few);
    assert_eq!(exit, Some(0), "{people}");
    for line in people.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    for out in ["one", "two"] {
        let (exit, output, _) =
            run_flexor(&folder, &[&["--json"], &few[..], &["--out", out]].concat());
        assert_eq!(exit, Some(0), "{output}");
        let document: Value = serde_json::from_str(&output).unwrap();
        let result = &document["result"];
        assert_eq!(result["simulated"], true);
        assert_eq!(result["declared"]["as_declared"], false, "{result}");
        let shares = result["shares"].as_array().unwrap();
        assert_eq!(shares.len(), 10, "eight claims, all of them, draws found");
        let rows = result["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 9);
        for field in [
            "id", "quantity", "unit", "paper", "ours", "low", "high", "n",
        ] {
            assert!(rows[0].get(field).is_some(), "{field}: {}", rows[0]);
        }
    }
    same(&folder, "one", "two");
    let rows = std::fs::read_to_string(folder.join("one/draws.csv")).unwrap();
    let fields: Vec<usize> = rows.lines().map(|row| row.split(',').count()).collect();
    assert_eq!(fields, [fields[0]; 4]);
    check_rerun_command(&folder, "one");
}

/// Shards of a cell merge into a result that one thread computes as well; incomplete sets are
/// refused.
#[test]
fn shards_merge_to_the_bytes_of_one() {
    let folder = test_folder("two_points_shards");
    let few = [&FEW[..], &["--draws", "4"]].concat();
    let mut alone = flexor_command(&folder, &[&few[..], &["--out", "whole"]].concat());
    let alone = alone.env("RAYON_NUM_THREADS", "1").output().unwrap();
    assert!(alone.status.success());
    for part in ["1", "2"] {
        let shard = format!("{part}/2");
        let words = [&["--json"], &few[..], &["--shard", &shard, "--out", part]].concat();
        let (exit, output, error) = run_flexor(&folder, &words);
        assert_eq!(exit, Some(0), "{error}");
        let document: Value = serde_json::from_str(&output).unwrap();
        assert_eq!(document["shard"]["of"], 2, "{document}");
        assert!(!folder.join(part).join("result.json").exists());
    }
    let merge = ["two-points", "--merge", "2", "1", "--out", "merged"];
    let (exit, people, error) = run_flexor(&folder, &merge);
    assert_eq!(exit, Some(0), "{error}");
    assert!(people.starts_with("cell "), "{people}");
    same(&folder, "merged", "whole");
    let (exit, _, error) = run_flexor(&folder, &["report", "merged"]);
    assert_eq!(exit, Some(0), "{error}");
    same(&folder, "merged", "whole");
    for (words, wanted) in [
        (
            "--merge 1 --out x",
            "E604 these folders are not all shards of one sweep: shard 2/2 is missing",
        ),
        (
            "--merge 1 1 --out x",
            "E604 these folders are not all shards of one sweep: 1 and 1 are both shard 1/2",
        ),
        (
            "--merge 1 . --out x",
            "E604 these folders are not all shards of one sweep: . has no sweep.json",
        ),
        (
            "--merge 1 2 --out 1",
            "E603 1 holds two-points, cell 15 (curvature 1 searched), seed",
        ),
        (
            "--cell 14 --seed 1001 --draws 4 --out whole",
            "E603 whole holds two-points, cell 15",
        ),
        (
            "--cell 15 --seed 1001 --draws 5 --out whole",
            "the command asks for two-points, cell 15",
        ),
        ("--cell 15 --draws 4 --out whole", "E603 whole holds"),
        (
            "--cell 15 --seed 1001 --draws 4 --out .",
            "E603 . holds files that are not a sweep",
        ),
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        let (exit, _, error) = run_flexor(&folder, &[&["two-points"], &words[..]].concat());
        assert_eq!(exit, Some(1), "{error}");
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    same(&folder, "merged", "whole");
}

/// The study has the same name, folders and shards as a sweep.
#[test]
fn a_sweep_of_this_name_is_the_same_study() {
    let folder = test_folder("two_points_sweep");
    for (command, out) in [("two-points", "own"), ("sweep two-points", "swept")] {
        let line = format!("{command} --seed 1001 --draws 1 --shard 16/49 --out {out}");
        let (exit, _, error) = run_flexor(&folder, &line.split(' ').collect::<Vec<_>>());
        assert_eq!(exit, Some(0), "{error}");
    }
    for file in ["draws.csv", "sweep.json", "declaration.toml"] {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(read("own") == read("swept"), "{file}");
    }
    let line = "sweep two-points --draws 1 --device chip --out chip";
    let (exit, _, error) = run_flexor(&folder, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(exit, Some(2));
    assert!(error.contains("allowed: native"), "{error}");
}

/// Counts the rows that a running study has written.
fn rows(folder: &Path) -> usize {
    let text = std::fs::read_to_string(folder.join("broken/draws.csv"));
    text.map_or(0, |text| text.lines().count().saturating_sub(1))
}

/// An interrupt and a kill during the draws, each followed by the same command.
#[cfg(unix)]
#[test]
fn an_interrupted_study_goes_on_to_the_same_bytes() {
    let folder = test_folder("two_points_broken");
    let few = [&FEW[..], &["--draws", "24", "--out", "broken"]].concat();
    for (signal, known, exit) in [("INT", 8, Some(130)), ("KILL", 16, None)] {
        let mut command = flexor_command(&folder, &few);
        let command = command.env("RAYON_NUM_THREADS", "1");
        let command = command.stdout(Stdio::null()).stderr(Stdio::piped());
        let mut program = command.spawn().unwrap();
        while rows(&folder) < known {
            assert!(program.try_wait().unwrap().is_none(), "it ended by itself");
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let id = program.id().to_string();
        let sent = Command::new("kill")
            .arg(format!("-{signal}"))
            .arg(id)
            .status();
        assert!(sent.unwrap().success());
        let ended = program.wait_with_output().unwrap();
        let error = String::from_utf8(ended.stderr).unwrap();
        assert_eq!(ended.status.code(), exit, "{error}");
        let goes_on = "run the same command again to continue";
        assert!(exit.is_none() || error.contains(goes_on), "{error}");
        assert!(rows(&folder) >= known, "what was computed is kept");
        // The result of the first draws is marked as incomplete.
        let result = std::fs::read_to_string(folder.join("broken/result.json")).unwrap();
        assert!(result.contains("\"Cut short: 0 of 1 cells"), "{result}");
    }
    let (exit, _, error) = run_flexor(&folder, &few);
    assert_eq!(exit, Some(0), "{error}");
    let arguments = [&FEW[..], &["--draws", "24", "--out", "whole"]].concat();
    assert_eq!(run_flexor(&folder, &arguments).0, Some(0));
    same(&folder, "broken", "whole");
}

#[test]
fn what_is_out_of_range_or_does_not_go_together_is_refused() {
    let folder = test_folder("two_points_refused");
    for (words, wanted) in [
        ("--draws 0", "E518 --draws is 0; allowed: 1 to"),
        ("--cell 49", "E518 --cell is 49; allowed: 0 to 48"),
        ("--cell 49 --timing", "E518 --cell is 49; allowed: 0 to 48"),
        ("--shard 3/2 --out x", "E605 --shard is `3/2`; allowed: I/N"),
        (
            "--shard half --out x",
            "E605 --shard is `half`; allowed: I/N",
        ),
        (
            "--shard 1/2",
            "E518 --shard needs a folder to write in: add --out DIR",
        ),
        (
            "--merge x",
            "E518 --merge needs a folder to write in: add --out DIR",
        ),
        (
            "--merge x --out y --shard 1/2",
            "E518 --merge takes cell, draws and seed from",
        ),
        ("--merge x --out y --cell 3", "leave out --cell"),
        ("--merge x --out y --cell 3 --shard 1/2", "leave out --cell"),
        ("--merge x --out y --seed 3", "leave out --seed"),
        ("--timing --out x", "E518 --timing measures this computer"),
        (
            "--timing --shard 1/2",
            "E518 --timing measures this computer",
        ),
    ] {
        let words: Vec<&str> = words.split(' ').collect();
        let (exit, _, error) = run_flexor(&folder, &[&["two-points"], &words[..]].concat());
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    assert!(!folder.join("x").exists() && !folder.join("y").exists());
}

/// Prints the computing time of draws, which is never part of a result.
#[test]
fn what_a_draw_costs_is_told_apart() {
    let folder = test_folder("two_points_cost");
    let words = [&FEW[..], &["--draws", "1", "--timing"]].concat();
    let (exit, output, error) = run_flexor(&folder, &[&["--json"], &words[..]].concat());
    assert_eq!(exit, Some(0), "{error}");
    let document: Value = serde_json::from_str(&output).unwrap();
    let timing = &document["timing"];
    assert!(
        document.get("result").is_none() && timing["draws"] == 1,
        "{document}"
    );
    assert_eq!(timing["wearers"]["stimulations"], 29 * 5 * 4, "{document}");
    for part in ["searches", "trials", "intensities", "all"] {
        assert!(timing["draw"][part]["mean_s"].is_f64(), "{document}");
    }
}
