//! Tests of `flexor experiment sierotowicz`: output, files and refusals.

use crate::program::{run_flexor, test_folder};
use serde_json::Value;

const ONE: [&str; 4] = ["experiment", "sierotowicz", "--draws", "1"];
const RESULT: [&str; 4] = ["result.json", "result.html", "arms.html", "studies.jsonl"];

#[test]
fn a_study_is_told_and_written() {
    let folder = test_folder("sierotowicz");
    let (exit, output, _) = run_flexor(
        &folder,
        &[&["--json"], &ONE[..], &["--out", "one"]].concat(),
    );
    assert_eq!(exit, Some(0), "{output}");
    let report: Value = serde_json::from_str(&output).unwrap();
    let result = &report["result"];
    assert_eq!(result["simulated"], true);
    assert_eq!(result["declared"]["as_declared"], false);
    for file in RESULT {
        assert!(folder.join("one").join(file).exists(), "{file}");
    }
    // Two wearers in the frame of S1.
    assert_eq!(result["shares"][0]["of"], 2, "{result}");
    let arms = std::fs::read_to_string(folder.join("one/arms.html")).unwrap();
    assert_eq!(arms.matches("<svg").count(), 1 + 3 * 3);
    let page = std::fs::read_to_string(folder.join("one/result.html")).unwrap();
    for part in [
        "Figure 8: errors by axis",
        "Figure 8: tests by axis",
        "<td>jumps</td>",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let (exit, people, _) = run_flexor(&folder, &["report", "one"]);
    assert_eq!(exit, Some(0), "{people}");
}

#[test]
fn what_cannot_be_asked_is_wrong_use() {
    let folder = test_folder("sierotowicz_refused");
    for (args, why) in [
        (&["--draws", "0"][..], "allowed: 1 to"),
        (&["--wearer", "P"], "do not apply to sierotowicz"),
        (&["--device", "qemu"], "allowed: native, chip"),
    ] {
        let (exit, _, error) = run_flexor(&folder, &[&ONE[..2], args].concat());
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains(why), "{error}");
    }
}

/// A short `flexor experiment electrode-choice`: its numbers, its matrices, its refusals.
#[test]
fn a_choice_of_electrodes_is_told_and_written() {
    let folder = test_folder("electrode_choice");
    let command = ["experiment", "electrode-choice", "--draws", "2"];
    let args = [&["--json"], &command[..], &["--out", "two"]].concat();
    let (exit, output, _) = run_flexor(&folder, &args);
    assert_eq!(exit, Some(0), "{output}");
    let report: Value = serde_json::from_str(&output).unwrap();
    let result = &report["result"];
    assert_eq!(result["simulated"], true);
    assert_eq!(result["declared"]["as_declared"], false);
    assert_eq!(result["shares"][0]["of"], 2, "{result}");
    let page = std::fs::read_to_string(folder.join("two/result.html")).unwrap();
    // Two matrices of each method, of ten electrodes.
    assert_eq!(
        page.matches("extra miss without the electrode\"").count(),
        2
    );
    // And a figure of the error that leaving an electrode out causes.
    assert_eq!(page.matches(">brachioradialis</text>").count(), 4 + 1);
    let (exit, people, _) = run_flexor(&folder, &["report", "two"]);
    assert_eq!(exit, Some(0), "{people}");
    for (args, why) in [
        (&["--draws", "1"][..], "allowed: 2 to"),
        (&["--device", "chip"], "allowed: native"),
    ] {
        let (exit, _, error) = run_flexor(&folder, &[&command[..2], args].concat());
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains(why), "{error}");
    }
}
