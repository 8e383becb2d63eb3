//! `flexor two-points`: what it tells people and machines, what it writes and refuses.

use crate::program::{folder, ran};
use serde_json::Value;

#[test]
fn a_cell_is_told_and_written() {
    let folder = folder("two_points");
    let few = [
        "two-points",
        "--cell",
        "15",
        "--draws",
        "3",
        "--seed",
        "1001",
    ];
    let (exit, people, _) = ran(&folder, &few);
    assert_eq!(exit, Some(0), "{people}");
    for line in people.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    for out in ["one", "two"] {
        let (exit, told, _) = ran(&folder, &[&["--json"], &few[..], &["--out", out]].concat());
        assert_eq!(exit, Some(0), "{told}");
        let told: Value = serde_json::from_str(&told).unwrap();
        let result = &told["result"];
        assert_eq!(result["simulated"], true);
        assert_eq!(result["declared"]["as_declared"], false, "{result}");
        assert_eq!(result["shares"].as_array().unwrap().len(), 9);
    }
    for file in ["result.json", "result.html", "draws.csv"] {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(
            read("one") == read("two"),
            "{file}: the same seed, the same bytes"
        );
    }
    let rows = std::fs::read_to_string(folder.join("one/draws.csv")).unwrap();
    let fields: Vec<usize> = rows.lines().map(|row| row.split(',').count()).collect();
    assert_eq!(fields, [fields[0]; 4]);
}

#[test]
fn what_is_out_of_range_is_refused_by_name() {
    let folder = folder("two_points_refused");
    for (arguments, wanted) in [
        (["--draws", "0"], "E518 --draws is 0, allowed is 1 to"),
        (["--cell", "41"], "E518 --cell is 41, allowed is 0 to 40"),
    ] {
        let (exit, _, error) = ran(&folder, &[&["two-points"], &arguments[..]].concat());
        assert_eq!(exit, Some(2), "{error}");
        assert!(error.contains(wanted), "{error}");
    }
}
