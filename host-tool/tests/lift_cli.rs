//! Tests of `flexor experiment buatier`: output, files and refusals.

use crate::program::{run_flexor, test_folder};
use serde_json::Value;

const ONE: [&str; 4] = ["experiment", "buatier", "--draws", "1"];

#[test]
fn a_study_of_lifts_is_told_and_written() {
    let folder = test_folder("buatier");
    let (exit, output, _) = run_flexor(
        &folder,
        &[&["--json"], &ONE[..], &["--out", "one"]].concat(),
    );
    assert_eq!(exit, Some(0), "{output}");
    let document: Value = serde_json::from_str(&output).unwrap();
    let result = &document["result"];
    assert_eq!(result["simulated"], true);
    assert_eq!(result["declared"]["as_declared"], false);
    // Eight participants, then one study.
    assert_eq!(result["shares"][0]["of"], 8, "{result}");
    assert_eq!(result["shares"][1]["of"], 1, "{result}");
    for file in ["result.json", "result.html", "studies.jsonl"] {
        assert!(folder.join("one").join(file).exists(), "{file}");
    }
    // A short run does not test which assumption decides.
    assert!(!folder.join("one/deciding.json").exists());
    let (exit, people, _) = run_flexor(&folder, &["report", "one"]);
    assert_eq!(exit, Some(0), "{people}");
}

#[test]
fn what_cannot_be_asked_is_wrong_use() {
    let folder = test_folder("buatier_refused");
    for (args, why) in [
        (&["--draws", "0"][..], "allowed: 1 to"),
        (&["--wearer", "P"], "generates its own wearers"),
        (&["--device", "chip"], "without the rest of the firmware"),
    ] {
        let (exit, _, error) = run_flexor(&folder, &[&ONE[..2], args].concat());
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains(why), "{error}");
    }
}
