//! Tests of `flexor experiment harris-ramps`, and of the wall for one wearer: output, files and
//! refusals.

use crate::program::{run_flexor, test_folder};
use serde_json::Value;

const FEW: [&str; 4] = ["experiment", "harris-ramps", "--draws", "3"];
const RESULT: [&str; 5] = [
    "result.json",
    "result.html",
    "draws.csv",
    "harris-1.toml",
    "harris-2.toml",
];

#[test]
fn ramps_are_told_and_written() {
    let folder = test_folder("harris_ramps");
    let (exit, people, _) = run_flexor(&folder, &FEW);
    assert_eq!(exit, Some(0), "{people}");
    for line in people.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    assert!(people.contains("Angles: effect of ±15°"), "{people}");
    assert!(
        people.contains("1000 to 1000 µs; the design value is 1000"),
        "{people}"
    );
    for out in ["one", "two"] {
        let (exit, output, _) =
            run_flexor(&folder, &[&["--json"], &FEW[..], &["--out", out]].concat());
        assert_eq!(exit, Some(0), "{output}");
        let document: Value = serde_json::from_str(&output).unwrap();
        let result = &document["result"];
        assert_eq!(result["simulated"], true);
        assert_eq!(result["declared"]["as_declared"], false);
        assert_eq!(result["sheets"].as_array().unwrap().len(), 7);
    }
    for file in RESULT {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(read("one") == read("two"), "{file}");
    }
    // 19 tests of each of three subjects.
    let rows = std::fs::read_to_string(folder.join("one/draws.csv")).unwrap();
    assert_eq!(rows.lines().count(), 1 + 3 * 19);
    let (exit, report, _) = run_flexor(&folder, &["report", "one"]);
    assert_eq!(exit, Some(0), "{report}");
}

#[test]
fn what_cannot_be_asked_is_wrong_use() {
    let folder = test_folder("harris_ramps_refused");
    for (args, why) in [
        (&["--draws", "1"][..], "allowed: 2 to"),
        (&["--wearer", "P"], "generates its own wearers"),
        (&["--device", "tcp:127.0.0.1:1"], "native, chip, qemu"),
    ] {
        let (exit, _, error) = run_flexor(&folder, &[&FEW[..2], args].concat());
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains(why), "{error}");
    }
}

/// The wall uses a wearer that the study wrote.
#[test]
fn the_wall_reads_a_wearer() {
    let folder = test_folder("harris_wall_worn");
    let (exit, output, _) = run_flexor(&folder, &[&FEW[..], &["--out", "ramps"]].concat());
    assert_eq!(exit, Some(0), "{output}");
    let wearer = "ramps/harris-2.toml";
    let wall = [
        "experiment",
        "harris-wall",
        "--draws",
        "0",
        "--wearer",
        wearer,
    ];
    let (exit, _, error) = run_flexor(&folder, &[&wall[..], &["--out", "wall"]].concat());
    assert_eq!(exit, Some(0), "{error}");
    let result = std::fs::read_to_string(folder.join("wall/result.json")).unwrap();
    assert!(result.contains("harris-2.toml"));
}
