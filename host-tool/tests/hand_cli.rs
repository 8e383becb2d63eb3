//! Tests of `flexor experiment hamana-4 --wearer` and `hamana-hold`: output, files and refusals.

use crate::program::{check_rerun_command, run_flexor, test_folder, write_file};
use serde_json::Value;
use std::collections::BTreeMap;

fn run_twice(name: &str, arguments: &[&str]) -> Value {
    let folder = test_folder(name);
    let (exit, people, _) = run_flexor(&folder, &[arguments, &["--out", "people"]].concat());
    assert_eq!(exit, Some(0), "{people}");
    for line in people.lines().filter(|line| !line.starts_with("Page:")) {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let (exit, output, _) = run_flexor(
        &folder,
        &[&["--json"], arguments, &["--out", "json"]].concat(),
    );
    assert_eq!(exit, Some(0), "{output}");
    for file in ["result.json", "result.html", "draws.csv"] {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(
            read("people") == read("json"),
            "{file}: the same seed, the same bytes"
        );
    }
    // The page depends on result.json alone.
    let page = || std::fs::read(folder.join("json/result.html")).unwrap();
    let made = page();
    std::fs::remove_file(folder.join("json/result.html")).unwrap();
    let (exit, _, error) = run_flexor(&folder, &["report", "json"]);
    assert_eq!(exit, Some(0), "{error}");
    assert!(page() == made, "the same page");
    let document: Value = serde_json::from_str(&output).unwrap();
    let made = String::from_utf8(made).unwrap();
    for number in numbers(&document["result"]) {
        assert!(made.contains(&format!("<h3>{number}: ")), "{number}");
    }
    document
}

/// Returns the paper's value for each row.
fn paper_values(result: &Value) -> BTreeMap<&str, &Value> {
    let rows = result["rows"].as_array().unwrap().iter();
    rows.map(|value| (value["id"].as_str().unwrap(), &value["paper"]))
        .collect()
}

/// Returns the cells of the sheet with this number and title.
fn cells(result: &Value, number: &str, title: &str) -> Vec<Vec<String>> {
    let mut sheets = result["sheets"].as_array().unwrap().iter();
    let sheet = sheets
        .find(|value| value["number"] == number && value["title"] == title)
        .unwrap();
    let rows = sheet["shows"]["table"]["rows"].clone();
    serde_json::from_value(rows).unwrap()
}

fn numbers(result: &Value) -> Vec<&str> {
    let sheets = result["sheets"].as_array().unwrap().iter();
    sheets
        .map(|value| value["number"].as_str().unwrap())
        .collect()
}

fn draws(folder: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    std::fs::read_to_string(path.join("json/draws.csv")).unwrap()
}

#[test]
fn a_hold_is_told_for_each_wearer() {
    let document = run_twice(
        "hand_hold",
        &["experiment", "hamana-hold", "--draws", "2", "--seed", "7"],
    );
    let result = &document["result"];
    assert_eq!(result["simulated"], true);
    assert_eq!(result["declared"]["as_declared"], false);
    let shares = result["shares"].as_array().unwrap();
    let ids: Vec<&str> = shares
        .iter()
        .map(|value| value["id"].as_str().unwrap())
        .collect();
    let names = [
        "two-better-P",
        "two-better-Q",
        "two-better-R",
        "two-better-S",
    ];
    assert_eq!(ids, names);
    // The paper reports three participants.
    assert_eq!(shares[2]["paper"], Value::Null);
    let papers = paper_values(result);
    for (wearer, [one, two]) in [("P", [21.9, 0.0]), ("Q", [44.8, 0.0]), ("S", [29.0, 13.6])] {
        for (method, printed) in [("one point", one), ("two points", two)] {
            let id = format!("{wearer}, {method} sinks/Sinks in 10 s (°)");
            assert_eq!(papers[&*id], printed, "{id}");
        }
    }
    assert_eq!(numbers(result), ["Figure 32"]);
    let rows = draws("hand_hold");
    let row = rows.lines().find(|line| line.contains(",whole,")).unwrap();
    let last: Vec<f64> = row
        .rsplit(',')
        .take(3)
        .map(|part| part.parse().unwrap())
        .collect();
    assert!((last[2] - last[1] - last[0]).abs() < 2e-3, "{row}");
}

/// Draws that the device refuses are counted with their reasons and never dropped; every trial is a
/// row; tables 7 to 9 appear next to the paper's.
#[test]
fn a_sine_is_followed_through_the_device() {
    let wanted = ["--wearer", "all", "--participants", "fixed"];
    let wanted = [&wanted[..], &["--draws", "1", "--seed", "7"]].concat();
    let document = run_twice(
        "hand_control",
        &[&["experiment", "hamana-4"], &wanted[..]].concat(),
    );
    let result = &document["result"];
    let notes = result["notes"].to_string();
    assert!(
        notes.contains("no electrode coupling in the allowed range gives"),
        "{notes}"
    );
    let papers = paper_values(result);
    for (id, printed) in [
        ("P, one point, paper's law/RMSE (°)", 17.6),
        ("P, two points, paper's law/RMSE (°)", 10.7),
        ("Q, one point, default law/RMSE (°)", 19.4),
        ("Q, two points, paper's law/RMSE (°)", 16.0),
        ("S, one point, paper's law/RMSE (°)", 14.5),
        ("S, two points, default law/RMSE (°)", 14.0),
        ("P, V_Ath/Voltage (V)", 24.0),
        ("Q, V_Bmax/Voltage (V)", 32.0),
        ("S, V_Emax/Voltage (V)", 26.0),
        ("S, r_th/r_th", 0.7),
        ("P, r_th·V_Bmax/Voltage (V)", 25.0),
        ("number of points, paper's law, F/Table 9: F", 4.3),
        ("participant, default law, p/Table 9: p", 0.193),
    ] {
        assert_eq!(papers[id], printed, "{id}");
    }
    // R failed in the paper.
    assert_eq!(papers["R, one point, paper's law/RMSE (°)"], &Value::Null);
    let shares = result["shares"].as_array().unwrap().iter();
    let ids: Vec<&str> = shares.map(|value| value["id"].as_str().unwrap()).collect();
    for id in [
        "two-better-R-paper",
        "table-8-recommended",
        "table-9-points-paper",
    ] {
        assert!(ids.contains(&id), "{id}: {ids:?}");
    }
    let table = cells(result, "Table 9", "analysis of variance of table 8");
    assert_eq!(table[0][..3], ["number of points, F", "4.30", "4.32"]);
    assert_eq!(table[1][..3], ["number of points, p", "0.0489", "0.0485"]);
    let figures = ["Table 7", "Table 8", "Table 9", "Figures 25 to 28"];
    assert!(
        figures
            .iter()
            .all(|figure| numbers(result).contains(figure))
    );
    // Two laws, three methods, five trials.
    let rows = draws("hand_control");
    let complete_rows = rows.lines().filter(|line| line.contains(",whole,")).count();
    assert!(
        complete_rows > 0 && complete_rows % 30 == 0,
        "{complete_rows}"
    );
    let mean_of_one = mean_of_better(&rows, "R", "paper");
    let row = result["rows"].as_array().unwrap().iter();
    let mut row = row.filter(|value| value["id"] == "R, one point, paper's law/RMSE (°)");
    let ours = row.next().unwrap()["ours"].as_f64();
    match (ours, mean_of_one) {
        (Some(ours), Some(mean)) => assert!((ours - mean).abs() < 1e-3, "{ours} {mean}"),
        (ours, mean) => assert_eq!(ours, mean),
    }
}

/// Returns the lower of the means of points A and B over five trials, from `draws.csv` with one
/// draw.
fn mean_of_better(rows: &str, wearer: &str, law: &str) -> Option<f64> {
    let mean = |point: &str| {
        let own = rows.lines().filter_map(|row| {
            let cells: Vec<&str> = row.split(',').collect();
            let is = cells[0] == wearer && cells.get(10..12) == Some(&[law, point]);
            is.then(|| cells[13].parse::<f64>().ok())
        });
        let trial_values: Option<Vec<f64>> = own.collect();
        let trial_values = trial_values.filter(|values| !values.is_empty())?;
        Some(trial_values.iter().sum::<f64>() / trial_values.len() as f64)
    };
    ["A", "B"].into_iter().filter_map(mean).reduce(f64::min)
}

/// Every experiment without a device: tables of 80 columns, a row for each trial, the same bytes
/// for the same seed.
#[test]
fn experiments_on_the_body_alone_are_told_and_written() {
    for (name, conditions, trials, wearers) in [
        ("hamana-1", 25, 5, 4),
        ("hamana-2", 29, 5, 4),
        ("hamana-3", 9, 5, 1),
        ("hamana-posture", 9, 3, 4),
    ] {
        let document = run_twice(
            &format!("hand_{name}"),
            &["experiment", name, "--draws", "1", "--seed", "11"],
        );
        let result = &document["result"];
        assert_eq!(result["simulated"], true, "{name}");
        assert_eq!(result["declared"]["as_declared"], false);
        assert!(result["declared"]["sha256"]["experiments.toml"].is_string());
        check_paper_values(name, result);
        let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
        let rows = folder.join(format!("hand_{name}/json/draws.csv"));
        let rows = std::fs::read_to_string(rows).unwrap();
        let (head, rows) = rows.split_once('\n').unwrap();
        let columns = head.split(',').count();
        let (mut complete_rows, mut missing) = (0, 0);
        for row in rows.lines() {
            // A condition's name contains commas and is quoted.
            let outside = row.split('"').step_by(2).collect::<String>();
            assert_eq!(outside.split(',').count(), columns, "{row}");
            match row.contains(",whole,") {
                true => complete_rows += 1,
                false => missing += 1,
            }
        }
        assert_eq!(complete_rows % trials, 0, "{name}");
        let drawn = wearers - missing;
        let ours = complete_rows / trials;
        assert!(
            ours <= drawn * conditions && ours >= drawn * (conditions - 1),
            "{name}: {ours} conditions of {drawn} draws"
        );
    }
}

/// Checks the tables and figures of the paper, and its printed values.
fn check_paper_values(name: &str, result: &Value) {
    let papers = paper_values(result);
    let (sheets, rows): (&[&str], &[(&str, f64)]) = match name {
        "hamana-1" => (
            &[
                "Table 2",
                "Figure 8",
                "Figures 9 to 11",
                "Figure 12",
                "Figure 13",
                "Figure 14",
                "Figure 15",
            ],
            &[
                ("P, V_Aapp/Voltage applied (V)", 28.0),
                ("R, V_Bapp/Voltage applied (V)", 32.0),
                ("friedman-statistic", 19.0),
            ],
        ),
        "hamana-2" => (
            &[
                "Table 3",
                "Table 4",
                "Table 5",
                "Figure 17",
                "Figure 18",
                "Figure 19",
                "Figure 20",
            ],
            &[
                ("Q, V_Aapp/Voltage applied (V)", 34.0),
                ("pattern 0/t against one point", 6.47),
                ("pattern 13/p against one point", 0.121),
                (
                    "one point, conducted/Torque, part of the greatest pattern",
                    0.28,
                ),
                (
                    "one point, isolated/Torque, part of the greatest pattern",
                    0.27,
                ),
            ],
        ),
        "hamana-3" => (&["Table 6", "Figure 21"], &[]),
        _ => (&["Figure 30", "Figure 31"], &[]),
    };
    for (id, printed) in rows {
        assert_eq!(papers[id], printed, "{name}: {id}");
    }
    let has_any = result["rows"].to_string().contains("\"n\":1");
    let sheet_numbers = numbers(result);
    assert!(
        !has_any || sheets == sheet_numbers,
        "{name}: {sheet_numbers:?}"
    );
    // Of table 4 only the averages are known.
    let cells = papers
        .iter()
        .filter(|(id, _)| id.contains("One point's torque"));
    assert!(cells.map(|(_, paper)| paper).all(|cell| cell.is_null()));
}

const OWN: &str = "schema = 1\nname = \"X-1\"\nevidence = \"assumed\"\nsource = \"a test\"\n\
                   [forearm]\nreach_m = 0.42\naround_m = 0.25\n\
                   thresholds_v = [20.0, 20.0, 16.0]\n";

/// A user's wearer file is accepted and identified by its checksum, or refused with all its
/// mistakes.
#[test]
fn a_wearer_of_one_s_own_comes_from_a_file() {
    let folder = test_folder("hand_own");
    write_file(&folder, "own.toml", OWN);
    let asked = ["--json", "experiment", "hamana-posture", "--draws", "2"];
    let asked = [&asked[..], &["--wearer", "own.toml", "--out", "own"]].concat();
    let (exit, output, _) = run_flexor(&folder, &asked);
    assert_eq!(exit, Some(0), "{output}");
    let document: Value = serde_json::from_str(&output).unwrap();
    check_rerun_command(&folder, "own");
    let sums = &document["result"]["declared"]["sha256"];
    assert!(sums["wearer"].is_string() && sums["wearers.toml"].is_null());
    let result_text = document["result"].to_string();
    assert!(
        result_text.contains("X-1") || result_text.contains("no"),
        "{result_text}"
    );
    let pads = |at: &str| format!("16.0]\npads_mm = [{at}]");
    for ((find, replace), wanted) in [
        (
            ("thresholds_v = [20.0, 20.0, 16.0]", ""),
            "E625 the wearer file bad.toml cannot be used here: the file has no thresholds",
        ),
        (("[forearm]", "[forearn]"), "E402"),
        (("20.0, 16.0", "42.0, 1.0"), "is 42.0; allowed: 2 to 40"),
        (("20.0, 16.0", "42.0, 1.0"), "is 1.0; allowed: 2 to 40"),
        (
            ("16.0]", "16.0, 3.0]"),
            "three numbers: for A, B and the extensor's point",
        ),
        (
            ("16.0]", &pads("[100, 120], [100, -120], [180, 30]")),
            "the electrodes of A and of B overlap",
        ),
        (
            ("0.42", "4.2"),
            "`forearm.reach_m` is 4.2; allowed: 0.3 to 0.6",
        ),
        (("reach_m", "reach"), "there is no field `forearm.reach`"),
        (("\"X-1\"", "\"a,b\""), "E652"),
        (
            ("16.0]", &pads("[100, 0], [110, 5], [180, 100]")),
            "the electrodes of A and of B overlap",
        ),
        (
            ("16.0]", &pads("[100, 0], [160, 5], [500, 100]")),
            "the electrode of the extensor lies outside the forearm",
        ),
    ] {
        assert!(OWN.contains(find), "{find}");
        write_file(&folder, "bad.toml", OWN.replace(find, replace));
        let asked = ["--json", "experiment", "hamana-1", "--wearer", "bad.toml"];
        let (exit, refusal_text, _) = run_flexor(&folder, &asked);
        assert_eq!(exit, Some(1), "{refusal_text}");
        let refusal: Value = serde_json::from_str(&refusal_text).unwrap();
        let error = refusal["error"].as_str().unwrap();
        assert!(error.contains("bad.toml"), "{error}");
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    for file in ["none.toml", "."] {
        let file = format!("{file}/x.toml");
        let (exit, _, error) = run_flexor(&folder, &["experiment", "hamana-1", "--wearer", &file]);
        assert_eq!(exit, Some(1), "{error}");
        assert!(error.contains("E650"), "{error}");
    }
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let folder = test_folder("hand_refused");
    let cases: [(&[&str], &str); 11] = [
        (
            &[
                "hamana-hold",
                "--ablation",
                "dry",
                "--participants",
                "prior",
            ],
            "E813 --participants prior has forearms of its own; leave out --wearer and",
        ),
        (
            &["hamana-participants", "--ablation", "dry"],
            "E814 hamana-participants conditions forearms on what the paper prints of P, Q,",
        ),
        (
            &["harris-wall", "--participants", "prior"],
            "E518 --participants applies to hamana-1, hamana-2,",
        ),
        (
            &["hamana-hold", "--ablation", "wet"],
            "E627 --ablation `wet` does not exist; choose one of limiter, found, narrow,",
        ),
        (
            &["harris-wall", "--ablation", "dry"],
            "E518 --ablation applies to hamana-1, hamana-2,",
        ),
        (
            &["hamana-2", "--device", "/dev/none"],
            "E518 --device is /dev/none; allowed: native, chip, qemu",
        ),
        (
            &["hamana-4", "--wearer", "X"],
            "E624 there is no wearer `X`",
        ),
        (
            &["harris-wall", "--wearer", "X"],
            "E518 --wearer of harris-wall must be a wearer file (NAME.toml) or",
        ),
        (
            &["harris-wall", "--wearer", "P"],
            "E663 P does not fit this experiment: the wearer file has no `[elbow]`",
        ),
        (
            &["hamana-4", "--wearer", "P", "--device", "/dev/none"],
            "E518 --device is /dev/none; allowed: native, chip, qemu",
        ),
        (
            &["hamana-hold", "--draws", "0"],
            "E518 --draws is 0; allowed: 1 to",
        ),
    ];
    for (arguments, wanted) in cases {
        let (exit, _, error) = run_flexor(&folder, &[&["experiment"], arguments].concat());
        assert_ne!(exit, Some(0), "{error}");
        assert!(error.contains(wanted), "{error}");
    }
}
