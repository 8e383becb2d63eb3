//! Tests of `flexor chart accuracy --error`: it names the cheapest method of the committed chart.

use crate::program::run_flexor;
use serde_json::Value;
use std::path::Path;

fn ask(more: &str) -> (Option<i32>, String, String) {
    let line = format!("chart accuracy {more}");
    let words: Vec<&str> = line.split_whitespace().collect();
    run_flexor(Path::new("."), &words)
}

/// Returns the rows of the chart at one interval of reading, as cells.
fn chart(output_us: &str) -> Vec<Vec<String>> {
    let text = include_str!("../../docs/charts/accuracy.csv");
    let cells = |line: &str| line.split(',').map(ToOwned::to_owned).collect::<Vec<_>>();
    let rows = text.lines().skip(1).map(cells);
    rows.filter(|row| row[3] == output_us).collect()
}

#[test]
fn the_answer_is_the_cheapest_row_of_the_chart() {
    for (error, hz, output_us) in [
        ("0.1", "50", "20000"),
        ("0.02", "1000", "1000"),
        ("5", "30", "20000"),
    ] {
        let (code, out, err) = ask(&format!("--error {error} --readings-hz {hz} --json"));
        assert_eq!(code, Some(0), "{err}");
        let answer: Value = serde_json::from_str(&out).unwrap();
        let best = &answer["methods"][0];
        let limit: f64 = error.parse().unwrap();
        let cheapest = chart(output_us)
            .into_iter()
            .filter(|row| row[4].parse::<f64>().unwrap() <= limit)
            .min_by_key(|row| row[5].parse::<u64>().unwrap())
            .unwrap();
        assert_eq!(best["method"], cheapest[0]);
        assert_eq!(best["cycles_per_s"].to_string(), cheapest[5]);
        let (_, people, _) = ask(&format!("--error {error} --readings-hz {hz}"));
        assert!(people.contains(&cheapest[5]), "{people}");
        assert!(
            people.lines().all(|line| line.chars().count() <= 80),
            "{people}"
        );
    }
}

#[test]
fn impossible_questions_are_refused() {
    let (code, _, err) = ask("--error 0.000000001 --readings-hz 50");
    assert_eq!(code, Some(1));
    assert!(err.contains("E572") && err.contains("smallest"), "{err}");
    for words in [
        "--error 0.1",
        "--readings-hz 50",
        "--error nan --readings-hz 50",
        "--error 0.1 --readings-hz 0",
        "--error 0.1 --readings-hz 1001",
        "--error 0.1 --readings-hz 50 --draws 3",
    ] {
        let (code, out, err) = ask(words);
        assert_eq!(code, Some(2), "{words}: {err}");
        assert!(out.is_empty());
    }
}

/// Building the images takes minutes, so only the arguments are tested here; `studies::flags` tests
/// the rule and the table.
#[test]
fn flags_are_compared_from_the_first_on() {
    for first in ["0", "10", "x"] {
        let words = ["chart", "flags", "--first", first];
        let (code, _, err) = run_flexor(Path::new("."), &words);
        assert_eq!(code, Some(2), "{err}");
        assert!(err.contains("--first"), "{err}");
    }
}
