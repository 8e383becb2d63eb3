//! Tests of `flexor search`: output for people and machines, and refusals.

use crate::program::{Board, run_flexor, test_folder, write_file};
use serde_json::Value;

const FINGER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/searches/finger.toml");

#[test]
fn the_shipped_searches_find_the_shipped_finger() {
    let folder = test_folder("search_finger");
    let (exit, out, _) = run_flexor(&folder, &["--json", "search", FINGER]);
    assert_eq!(exit, Some(0), "{out}");
    let document: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(document["error"], Value::Null);
    let searches = document["searches"].as_array().unwrap();
    // Participant P: 24 and 28 V, r_th 0.7 (Hamana 2022, table 7).
    for (search, truth) in searches.iter().zip([24.0, 28.0, 0.7]) {
        let end = |name: &str| search[name].as_f64().unwrap();
        assert!(end("low") <= truth && truth < end("high"), "{search}");
        assert_eq!(search["set"], search["high"]);
        let trail = search["trail"].as_array().unwrap().iter();
        let pulses: u64 = trail.map(|step| step["pulses"].as_u64().unwrap()).sum();
        assert_eq!(search["pulses"], pulses);
    }
    assert_eq!(searches[3]["set"], searches[3]["low"]);
    let (_, people, _) = run_flexor(&folder, &["search", FINGER]);
    println!("{people}");
    for line in people.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
}

#[test]
fn what_cannot_be_searched_is_refused_before_anything_is_stimulated() {
    let folder = test_folder("search_refused");
    let stair = "session = \"session.toml\"\n[[search]]\nkind = \"threshold\"\nstart = 2.0\n\
                 step = 2.0\nlimit = 20.0\n";
    let cases = [
        (format!("{stair}channel = 1"), "wearer's limit of 15 mA"),
        (format!("{stair}channel = 2"), "channel 2"),
        (format!("{stair}channel = 1\nk_sigma = 0.5"), "k_sigma"),
        (
            stair.replace("threshold", "comfort") + "channel = 1\nrating = 3",
            "simulated_rating",
        ),
        ("session = 3".to_owned(), "line 1"),
    ];
    for (text, named) in cases {
        write_file(&folder, "search.toml", text);
        let (exit, _, error) = run_flexor(&folder, &["search", "search.toml"]);
        let is_told = error.contains("E527") && error.contains(named);
        assert!(exit == Some(1) && is_told, "{named}: {error}");
    }
    write_file(
        &folder,
        "search.toml",
        stair.replace("20.0", "14.0") + "channel = 1",
    );
    let board = Board::tcp(&folder);
    let (exit, _, refusal) = run_flexor(&folder, &["search", "search.toml", "--device", &board.at]);
    assert!(exit == Some(1) && refusal.contains("E529"), "{refusal}");
    let seeded = [
        "search",
        "search.toml",
        "--device",
        &board.at,
        "--seed",
        "2",
    ];
    assert_eq!(run_flexor(&folder, &seeded).0, Some(2));
}
