//! `flexor experiment hamana-4 --wearer` and `hamana-hold`: what they tell, write, refuse.

use crate::program::{folder, ran};
use serde_json::Value;

fn twice(name: &str, arguments: &[&str]) -> Value {
    let folder = folder(name);
    let (exit, people, _) = ran(&folder, &[arguments, &["--out", "people"]].concat());
    assert_eq!(exit, Some(0), "{people}");
    for line in people.lines().filter(|line| !line.starts_with("Page:")) {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let (exit, told, _) = ran(
        &folder,
        &[&["--json"], arguments, &["--out", "json"]].concat(),
    );
    assert_eq!(exit, Some(0), "{told}");
    for file in ["result.json", "result.html", "draws.csv"] {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(
            read("people") == read("json"),
            "{file}: the same seed, the same bytes"
        );
    }
    serde_json::from_str(&told).unwrap()
}

#[test]
fn a_hold_is_told_for_each_wearer() {
    let told = twice(
        "hand_hold",
        &["experiment", "hamana-hold", "--draws", "2", "--seed", "7"],
    );
    let result = &told["result"];
    assert_eq!(result["simulated"], true);
    assert_eq!(result["declared"]["as_declared"], false);
    let shares = result["shares"].as_array().unwrap();
    let who: Vec<&str> = shares.iter().map(|it| it["at"].as_str().unwrap()).collect();
    assert_eq!(who, ["P", "Q", "R", "S"]);
    // The paper tells of three.
    assert_eq!(shares[2]["paper"], Value::Null);
}

/// Draws that the device refuses are counted with its reason, none is dropped.
#[test]
fn a_sine_is_followed_through_the_device() {
    let wanted = ["--wearer", "Q", "--draws", "3", "--seed", "7"];
    let told = twice(
        "hand_control",
        &[&["experiment", "hamana-4"], &wanted[..]].concat(),
    );
    let shares = told["result"]["shares"].as_array().unwrap();
    assert_eq!(shares.len(), 2, "a law each");
    let notes = told["result"]["notes"].to_string();
    assert!(notes.contains("no contact gives the thresholds"), "{notes}");
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let folder = folder("hand_refused");
    let cases: [(&[&str], &str); 4] = [
        (
            &["hamana-4", "--wearer", "X"],
            "E624 there is no wearer `X`",
        ),
        (
            &["harris-wall", "--wearer", "P"],
            "E518 --wearer belongs to hamana-4",
        ),
        (
            &["hamana-hold", "--device", "/dev/none"],
            "E518 a drawn forearm is simulated",
        ),
        (
            &["hamana-hold", "--draws", "0"],
            "E518 --draws is 0, allowed is 1 to",
        ),
    ];
    for (arguments, wanted) in cases {
        let (exit, _, error) = ran(&folder, &[&["experiment"], arguments].concat());
        assert_ne!(exit, Some(0), "{error}");
        assert!(error.contains(wanted), "{error}");
    }
}
