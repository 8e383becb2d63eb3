//! Tests of `flexor compare`: differences between stimulations, experiments and sweeps.

use super::program::{run_flexor, test_folder, write_file};
use super::record_again::{run_failing, run_json, shortened_session};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

/// Writes two open-loop sessions of half a second; the second is stronger on channel 2.
fn sessions(test: &str) -> PathBuf {
    let folder = test_folder(test);
    let file = shortened_session(&folder, "ten_channels.toml", 0.5);
    let text = fs::read_to_string(folder.join(file)).unwrap();
    let stronger = text.replace(
        "{ channel = 2, value = 6.0 }",
        "{ channel = 2, value = 8.0 }",
    );
    assert_ne!(text, stronger);
    write_file(&folder, "stronger.toml", stronger);
    folder
}

fn line<'a>(lines: &[&'a str], begins: &str) -> &'a str {
    let mut found = lines.iter().filter(|line| line.starts_with(begins));
    found
        .next()
        .unwrap_or_else(|| panic!("{begins}: {lines:?}"))
}

/// Runs the commands of docs/reference/record.md in a folder with the sessions that they use.
#[test]
fn the_commands_of_the_document_show_what_differs() {
    let folder = sessions("compare_differs");
    let document = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/record.md");
    let document = fs::read_to_string(document).unwrap();
    let (_, section) = document.split_once("## Comparing stimulations").unwrap();
    let (section, _) = section.split_once("\n## ").unwrap();
    let commands = section
        .lines()
        .filter_map(|line| line.strip_prefix("    flexor "));
    let commands: Vec<&str> = commands.collect();
    assert_eq!(commands.len(), 3, "{commands:?}");
    let mut text = String::new();
    for command in commands {
        let arguments: Vec<&str> = command.split(' ').collect();
        let (exit, output, error) = run_flexor(&folder, &arguments);
        assert_eq!(exit, Some(0), "{command}: {error}");
        text = output;
    }
    let lines: Vec<&str> = text.lines().collect();
    for line in lines.iter().filter(|line| !line.starts_with("page:")) {
        assert!(line.chars().count() <= 80, "{line}");
    }
    // Only channel 2 differs: 25 pulses of 200 µs that rise to 6 or 8 mA.
    let place = lines
        .iter()
        .position(|line| line.starts_with("  channel 2 "))
        .unwrap();
    let peaks: Vec<&str> = lines[place + 1..][..2]
        .iter()
        .map(|line| line[..14].trim())
        .collect();
    assert_eq!(peaks, ["1   6.00 mA", "2   8.00 mA"]);
    let change = line(&lines, "    setpoints.values[channel 2].value");
    assert!(change.ends_with(": 6.0 -> 8.0"), "{change}");
}

fn channel(json: &Value, row: usize, number: usize) -> &Value {
    &json["rows"][row]["channels"][number - 1]
}

#[test]
fn json_and_page_have_doses_traces_and_files() {
    let folder = sessions("compare_page_parts");
    run_json(&folder, "run ten_channels.toml --out one");
    run_json(&folder, "run stronger.toml --out two");
    let json = run_json(&folder, "compare one two --out both");
    let number = |row: usize, channel_number: usize, key: &str| {
        channel(&json, row, channel_number)[key].as_f64().unwrap()
    };
    assert_eq!(number(0, 2, "peak"), 6.0);
    assert_eq!(number(1, 2, "peak"), 8.0);
    assert_eq!(number(1, 2, "charge_per_phase_uc"), 1.6);
    let grows = number(1, 2, "cathodic_uc") / number(0, 2, "cathodic_uc");
    assert!(grows > 1.2 && grows < 8.0 / 6.0 + 1e-9, "{grows}");
    assert_eq!(channel(&json, 0, 3), channel(&json, 1, 3));
    let keys = &json["files"][0]["keys"];
    let wanted = serde_json::json!([{
        "key": "setpoints.values[channel 2].value", "from": "6.0", "to": "8.0",
    }]);
    assert_eq!(*keys, wanted);
    let unified = json["files"][0]["unified"].as_str().unwrap();
    assert!(
        unified.starts_with("--- record 1\n+++ record 2\n@@"),
        "{unified}"
    );

    let page = fs::read_to_string(folder.join("both/compare.html")).unwrap();
    assert!(
        page.contains("<td><b>8.00 mA</b></td>"),
        "what differs is bold"
    );
    assert!(page.contains("--- record 1\n+++ record 2"), "line by line");
    let (_, figure) = page
        .split_once("aria-label=\"Amplitude of every channel")
        .unwrap();
    let (figure, _) = figure.split_once("</svg>").unwrap();
    // Two lines for each of eleven panels or more, and two in the legend.
    let channels = json["rows"][0]["channels"].as_array().unwrap().len();
    let lines = figure.matches("stroke-width=\"4\"").count();
    assert_eq!(lines, channels + 1);

    // The summary of a record has the same numbers.
    let summary = fs::read_to_string(folder.join("two/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(
        summary["trials"][0]["channels"],
        json["rows"][1]["channels"]
    );
}

#[test]
fn the_same_session_twice_differs_in_nothing() {
    let folder = sessions("compare_same");
    run_json(&folder, "run ten_channels.toml --out one");
    run_json(&folder, "run ten_channels.toml --out two");
    let (_, text, _) = run_flexor(&folder, &["compare", "one", "two"]);
    assert!(
        text.contains("The output of every channel is the same in each record."),
        "{text}"
    );
    assert!(text.contains("The session files are the same."), "{text}");
    let json = run_json(&folder, "compare one two");
    assert_eq!(json["files"], serde_json::json!([]));
}

#[test]
fn the_page_of_an_open_loop_begins_with_what_channels_put_out() {
    let folder = sessions("compare_open_loop");
    run_json(&folder, "run ten_channels.toml --out one");
    let page = fs::read_to_string(folder.join("one/report.html")).unwrap();
    let (begin, _) = page.split_once("<section>").unwrap();
    assert!(
        begin.contains("Amplitude of every channel over time"),
        "{begin}"
    );
    for head in ["peak", "µC/phase", "charge µC", "rms mA", "on-time s"] {
        assert!(begin.contains(&format!("<th>{head}</th>")), "{head}");
    }
    assert!(
        begin.contains("<td>6.00 mA</td><td>1.20</td><td>±"),
        "{begin}"
    );
    assert_eq!(
        page.matches("Amplitude of every channel over time").count(),
        1
    );
}

#[test]
fn every_folder_that_cannot_be_compared_is_named() {
    let folder = sessions("compare_mistakes");
    run_json(&folder, "run ten_channels.toml --out one");
    fs::create_dir(folder.join("empty")).unwrap();
    fs::create_dir(folder.join("begun")).unwrap();
    write_file(&folder, "begun/sweep.json", "{}");
    let (exit, error) = run_failing(&folder, "compare one absent empty ./one begun");
    assert_eq!(exit, Some(1));
    for says in [
        "E588 4 of 5 folders cannot be compared:",
        "\nE593 absent is not a record",
        "\nE593 empty is not a record",
        "\nE518 ./one is the folder one again",
        "\nE518 begun holds an unfinished sweep",
    ] {
        assert!(error.contains(says), "{says}: {error}");
    }
    let (exit, error) = run_failing(&folder, "compare one ./one");
    assert_eq!(exit, Some(2));
    assert!(
        error.contains("E518 ./one is the folder one again"),
        "{error}"
    );
    assert!(!folder.join("out").exists());
}

const DECLARATION: &str = "name = \"own\"\ntitle = \"Own\"\nsource = \"nobody\"\n\
    session = \"ten_channels.toml\"\nseed = 3\ndraws = 2\nmeasures = [\"charge_mc\"]\n\
    [[factor]]\nname = \"gap\"\n[[factor.level]]\nname = \"none\"\n\
    [[factor.level]]\nname = \"longer\"\nset = { \"setpoints.rate_hz\" = 25 }\n";

/// Records of experiments have trials and results, sweeps have results, runs have trials.
#[test]
fn experiments_and_sweeps_are_compared_by_what_they_have_in_common() {
    let folder = sessions("compare_kinds");
    write_file(&folder, "own.toml", DECLARATION);
    let louder = DECLARATION.replace("seed = 3", "seed = 4");
    write_file(&folder, "other.toml", louder);
    run_json(&folder, "run ten_channels.toml --out run");
    run_json(&folder, "experiment own.toml --draws 0 --out first");
    run_json(&folder, "experiment other.toml --draws 0 --out second");
    run_json(&folder, "sweep own.toml --out sweep");

    let comparison = run_json(&folder, "compare first second --out both");
    assert_eq!(comparison["rows"].as_array().unwrap().len(), 4);
    let rows = comparison["results"].as_array().unwrap();
    let row = rows
        .iter()
        .find(|row| row["id"] == "none/charge_mc")
        .unwrap();
    let told_mc = row["values"][0]["value"].as_f64().unwrap();
    assert_eq!(row["values"].as_array().unwrap().len(), 2);
    // The measure holds amplitudes until the next row; doses count pulses.
    let channels = comparison["rows"][0]["channels"].as_array().unwrap();
    let uc = channels
        .iter()
        .map(|value| value["cathodic_uc"].as_f64().unwrap());
    let counted_mc = uc.sum::<f64>() / 1e3;
    assert!(
        (counted_mc / told_mc - 1.0).abs() < 0.05,
        "{counted_mc} {told_mc}"
    );
    let key = &comparison["declarations"][0]["keys"][0];
    assert_eq!((&key["key"], &key["to"]), (&"seed".into(), &"4".into()));

    let mixed = run_json(&folder, "compare first sweep --out mixed");
    assert_eq!(mixed["rows"], serde_json::json!([]));
    assert!(!mixed["results"].as_array().unwrap().is_empty());
    let page = fs::read_to_string(folder.join("mixed/compare.html")).unwrap();
    assert!(page.contains("<h2>Results</h2>") && !page.contains("Output of the channels"));

    let trials = run_json(&folder, "compare run first --out trials");
    assert_eq!(trials["rows"].as_array().unwrap().len(), 3);
    assert_eq!(trials["results"], serde_json::json!([]));
    // Without common names, the first trial is compared with the first.
    let (_, text, _) = run_flexor(&folder, &["compare", "run", "first"]);
    assert!(text.contains("1 trial is in one record only"), "{text}");
    assert!(text.contains("    no key differs in value"), "{text}");

    let (exit, error) = run_failing(&folder, "compare run sweep");
    assert_eq!(exit, Some(2));
    let says = "run is a record without a result, sweep is a result without recorded trials";
    assert!(error.contains("E518") && error.contains(says), "{error}");
    for line in ["compare first second", "compare first sweep"] {
        let arguments: Vec<&str> = line.split(' ').collect();
        let (_, text, _) = run_flexor(&folder, &arguments);
        for line in text.lines().filter(|line| !line.starts_with("page:")) {
            assert!(line.chars().count() <= 80, "{line}");
        }
    }
}
