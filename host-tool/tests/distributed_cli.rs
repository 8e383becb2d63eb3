//! Tests of `flexor experiment distributed`: output, files and refusals.

use crate::program::{run_flexor, test_folder};
use serde_json::Value;

const ONE: [&str; 4] = ["experiment", "distributed", "--draws", "1"];

#[test]
fn the_study_is_told_and_written_twice_alike() {
    let folder = test_folder("distributed");
    let (exit, people, _) = run_flexor(&folder, &[&ONE[..], &["--out", "one"]].concat());
    assert_eq!(exit, Some(0), "{people}");
    for line in people.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    assert!(people.contains("Rate: endurance by the rate"), "{people}");
    let (exit, output, _) = run_flexor(
        &folder,
        &[&["--json"], &ONE[..], &["--out", "two"]].concat(),
    );
    assert_eq!(exit, Some(0), "{output}");
    let report: Value = serde_json::from_str(&output).unwrap();
    assert_eq!(report["result"]["simulated"], true);
    assert_eq!(report["result"]["declared"]["as_declared"], false);
    for file in ["result.json", "result.html", "draws.csv"] {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(read("one") == read("two"), "{file}");
    }
    let rows = std::fs::read_to_string(folder.join("one/draws.csv")).unwrap();
    assert_eq!(rows.lines().count(), 1 + 15);
    let (exit, output, _) = run_flexor(&folder, &["report", "one"]);
    assert_eq!(exit, Some(0), "{output}");
}

#[test]
fn what_cannot_be_asked_is_told_at_once() {
    let folder = test_folder("distributed_refused");
    let wrong = ["--draws", "0", "--wearer", "P", "--device", "chip"];
    let (exit, _, error) = run_flexor(&folder, &[&ONE[..2], &wrong].concat());
    assert_eq!(exit, Some(2), "{error}");
    for why in [
        "allowed: 1 to",
        "generates its own wearers",
        "allowed: native",
    ] {
        assert!(error.contains(why), "{error}");
    }
}
