//! An interrupted experiment is resumed by the same command.

use super::program::test_folder;
use super::record_again::{copy_record, run_failing, run_json};
use std::fs;

#[test]
fn an_interrupted_experiment_goes_on_with_its_wearers() {
    let folder = test_folder("experiment_again");
    let command = "experiment open-trains --draws 30 --seed 4";
    run_json(&folder, &format!("{command} --out whole"));
    let cut = copy_record(&folder, "whole", "cut");
    let read =
        |record: &str, file: &str| fs::read_to_string(folder.join(record).join(file)).unwrap();
    let rows = read("whole", "draws.csv");
    fs::write(cut.join("draws.csv"), &rows[..rows.len() / 2]).unwrap();
    // A complete record is not replaced.
    let (exit, error) = run_failing(&folder, &format!("{command} --out cut"));
    assert_eq!(exit, Some(1), "{error}");
    assert!(error.contains("E590"), "{error}");
    let summary = read("cut", "summary.json");
    let cut_short = summary.replacen("\"complete\"", "\"incomplete\"", 1);
    assert_ne!(summary, cut_short);
    fs::write(cut.join("summary.json"), cut_short).unwrap();
    fs::remove_file(cut.join("result.html")).unwrap();
    // A record with another seed is not replaced, either.
    let other = command.replace("--seed 4", "--seed 5");
    let (_, error) = run_failing(&folder, &format!("{other} --out cut"));
    assert!(error.contains("E590"), "{error}");
    run_json(&folder, &format!("{command} --out cut"));
    for file in [
        "draws.csv",
        "result.json",
        "result.html",
        "summary.json",
        "sweep.json",
    ] {
        assert!(read("whole", file) == read("cut", file), "{file}");
    }
}

/// A record that is replaced leaves no file behind.
#[test]
fn a_record_that_is_replaced_leaves_no_folder_of_a_trial() {
    let folder = test_folder("replaced");
    run_json(&folder, "run session.toml --out one");
    run_json(&folder, "run trigger --out one --overwrite");
    let entries = fs::read_dir(folder.join("one")).unwrap().flatten();
    let folders = entries.filter(|entry| entry.path().is_dir()).count();
    assert_eq!(folders, 1);
}
