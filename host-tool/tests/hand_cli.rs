//! `flexor experiment hamana-4 --wearer` and `hamana-hold`: what they tell, write, refuse.

use crate::program::{folder, ran, repeats, written};
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
    assert!(
        notes.contains("the limiter holds a point below its threshold"),
        "{notes}"
    );
}

/// Every experiment on the body alone: tables of 80 columns, each trial a row, the same
/// bytes for the same seed.
#[test]
fn experiments_on_the_body_alone_are_told_and_written() {
    for (name, conditions, trials, wearers) in [
        ("hamana-1", 25, 5, 4),
        ("hamana-2", 29, 5, 4),
        ("hamana-3", 9, 5, 1),
        ("hamana-posture", 9, 3, 4),
    ] {
        let told = twice(
            &format!("hand_{name}"),
            &["experiment", name, "--draws", "1", "--seed", "11"],
        );
        let result = &told["result"];
        assert_eq!(result["simulated"], true, "{name}");
        assert_eq!(result["declared"]["as_declared"], false);
        assert!(result["declared"]["sha256"]["experiments.toml"].is_string());
        let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
        let rows = folder.join(format!("hand_{name}/json/draws.csv"));
        let rows = std::fs::read_to_string(rows).unwrap();
        let (head, rows) = rows.split_once('\n').unwrap();
        let columns = head.split(',').count();
        let (mut whole, mut missing) = (0, 0);
        for row in rows.lines() {
            // A condition's name has commas of its own, quoted.
            let outside = row.split('"').step_by(2).collect::<String>();
            assert_eq!(outside.split(',').count(), columns, "{row}");
            match row.contains(",whole,") {
                true => whole += 1,
                false => missing += 1,
            }
        }
        assert_eq!(whole % trials, 0, "{name}");
        let drawn = wearers - missing;
        let ours = whole / trials;
        assert!(
            ours <= drawn * conditions && ours >= drawn * (conditions - 1),
            "{name}: {ours} conditions of {drawn} draws"
        );
    }
}

const OWN: &str = "name = \"X-1\"\nreach_m = 0.42\naround_m = 0.25\n\
                   thresholds_v = [20.0, 20.0, 16.0]\n";

/// A wearer's file: taken, told by its sum; and refused with all that is wrong.
#[test]
fn a_wearer_of_one_s_own_comes_from_a_file() {
    let folder = folder("hand_own");
    written(&folder, "own.toml", OWN);
    let asked = ["--json", "experiment", "hamana-posture", "--draws", "2"];
    let asked = [&asked[..], &["--wearer", "own.toml", "--out", "own"]].concat();
    let (exit, told, _) = ran(&folder, &asked);
    assert_eq!(exit, Some(0), "{told}");
    let told: Value = serde_json::from_str(&told).unwrap();
    repeats(&folder, "own");
    let sums = &told["result"]["declared"]["sha256"];
    assert!(sums["wearer"].is_string() && sums["wearers.toml"].is_null());
    let told = told["result"].to_string();
    assert!(told.contains("X-1") || told.contains("no"), "{told}");
    for (edit, wanted) in [
        (
            ("thresholds_v = [20.0, 20.0, 16.0]", ""),
            "`thresholds_v` is missing",
        ),
        (("20.0, 16.0", "42.0, 1.0"), "the threshold of B is 42 V"),
        (
            ("20.0, 16.0", "42.0, 1.0"),
            "the threshold of the extensor's point is 1 V",
        ),
        (("0.42", "4.2"), "`reach_m` is 4.2, allowed is 0.3 to 0.6"),
        (("reach_m", "reach"), "unknown field `reach`"),
        (("\"X-1\"", "\"a,b\""), "`name` must be letters"),
        (
            ("16.0]", "16.0]\npads_mm = [[100, 0], [110, 5], [180, 100]]"),
            "the electrodes of A and of B overlap",
        ),
        (
            ("16.0]", "16.0]\npads_mm = [[100, 0], [160, 5], [500, 100]]"),
            "the electrode of the extensor lies off the forearm",
        ),
    ] {
        written(&folder, "bad.toml", OWN.replace(edit.0, edit.1));
        let (exit, _, error) = ran(&folder, &["experiment", "hamana-1", "--wearer", "bad.toml"]);
        assert_eq!(exit, Some(1), "{error}");
        assert!(error.contains("E625 bad.toml: "), "{error}");
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    for file in ["none.toml", "."] {
        let file = format!("{file}/x.toml");
        let (exit, _, error) = ran(&folder, &["experiment", "hamana-1", "--wearer", &file]);
        assert_eq!(exit, Some(1), "{error}");
        assert!(error.contains("E626"), "{error}");
    }
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let folder = folder("hand_refused");
    let cases: [(&[&str], &str); 5] = [
        (
            &["hamana-2", "--device", "chip"],
            "E518 hamana-2 is of the body alone",
        ),
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
