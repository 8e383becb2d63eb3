//! Tests of `flexor faults`: output for people and machines, files and refusals.

use crate::program::{
    check_rerun_command, command_result, flexor_command, run_flexor, test_folder,
};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};

#[test]
fn declarations_on_the_native_simulator_are_told_and_written() {
    let folder = test_folder("faults_native");
    let asked = ["faults", "--class", "declarations", "--device", "native"];
    let few = [&asked[..], &["--draws", "12", "--seed", "1000"]].concat();
    let (exit, people, _) = run_flexor(&folder, &few);
    assert_eq!(exit, Some(0), "{people}");
    for line in people.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    for out in ["one", "two"] {
        let (exit, output, _) =
            run_flexor(&folder, &[&["--json"], &few[..], &["--out", out]].concat());
        assert_eq!(exit, Some(0), "{output}");
        let report: Value = serde_json::from_str(&output).unwrap();
        let result = &report["result"];
        assert_eq!(
            (&result["simulated"], &result["seed"]),
            (&true.into(), &1000.into())
        );
        assert!(result["declared"]["sha256"]["declarations.toml"].is_string());
        assert_eq!(result["shares"][0]["holds"], result["shares"][0]["of"]);
    }
    for file in ["result.json", "result.html", "faults.csv"] {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(
            read("one") == read("two"),
            "{file}: the same seed, the same bytes"
        );
    }
    let rows = std::fs::read_to_string(folder.join("one/faults.csv")).unwrap();
    assert_eq!(rows.lines().count(), 13);
    columns_are_documented(rows.lines().next().unwrap());
    kinds_have_rows(&rows, &folder.join("one/result.html"));
    check_rerun_command(&folder, "one");
    // Existing files stay.
    std::fs::create_dir(folder.join("other")).unwrap();
    std::fs::write(folder.join("other/file"), "mine").unwrap();
    let (exit, _, error) = run_flexor(&folder, &[&few[..], &["--out", "other"]].concat());
    assert_eq!(exit, Some(1));
    assert!(error.contains("E603 other holds files"), "{error}");
}

/// Checks that the page states how many cases of each kind were generated.
fn kinds_have_rows(csv: &str, page: &Path) {
    let page = std::fs::read_to_string(page).unwrap();
    let mut drawn = BTreeMap::<&str, usize>::new();
    for line in csv.lines().skip(1) {
        let description = line.splitn(4, ',').nth(3).unwrap().trim_start_matches('"');
        let kind = description.split([':', '"', ',']).next().unwrap();
        *drawn.entry(kind).or_default() += 1;
    }
    assert!(drawn.len() > 3, "{drawn:?}");
    for (kind, drawn) in drawn {
        let row = format!("<th scope=\"row\">{kind}</th><td>{drawn}</td>");
        assert!(page.contains(&row), "{row}");
    }
}

/// Checks that docs/evidence/faults.md lists each column in code, in the paragraph on the file.
fn columns_are_documented(head: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let text = std::fs::read_to_string(root.join("docs/evidence/faults.md")).unwrap();
    let (_, text) = text.split_once("`faults.csv` has").unwrap();
    let (text, _) = text.split_once("\n\n").unwrap();
    for column in head.split(',') {
        assert!(text.contains(&format!("`{column}`")), "{column}");
    }
}

/// An interrupted campaign is resumed, and ends with the same bytes as an uninterrupted one.
#[test]
fn a_campaign_goes_on_where_it_stopped_and_another_does_not() {
    let folder = test_folder("faults_resumed");
    let asked = ["faults", "--class", "declarations", "--device", "native"];
    let few = |count: &'static str, out: &'static str| {
        let rest = ["--draws", count, "--seed", "1000", "--out", out];
        [&asked[..], &rest].concat()
    };
    assert_eq!(run_flexor(&folder, &few("12", "whole")).0, Some(0));
    assert_eq!(run_flexor(&folder, &few("5", "parts")).0, Some(0));
    // The last line is incomplete.
    let units = folder.join("parts/units.jsonl");
    let mut text = std::fs::read(&units).unwrap();
    text.truncate(text.len() - 20);
    std::fs::write(&units, text).unwrap();
    let (exit, output, error) = run_flexor(&folder, &few("12", "parts"));
    assert_eq!(exit, Some(0), "{error}");
    assert!(output.contains("Ran 8 cases"), "{output}");
    for file in ["result.json", "result.html", "faults.csv", "units.jsonl"] {
        let read = |out: &str| std::fs::read(folder.join(out).join(file)).unwrap();
        assert!(read("whole") == read("parts"), "{file}");
    }
    // A smaller count would leave finished cases out of the table.
    let kept = std::fs::read(&units).unwrap();
    let (exit, _, error) = run_flexor(&folder, &few("5", "parts"));
    assert_eq!(exit, Some(1));
    let wanted =
        "E603 parts holds faults, --class declarations --device native, seed 1000, 12 draws";
    assert!(error.contains(wanted), "{error}");
    assert_eq!(std::fs::read(&units).unwrap(), kept);
    let other = [&asked[..], &["--seed", "1001", "--out", "parts"]].concat();
    let (exit, _, error) = run_flexor(&folder, &other);
    assert_eq!(exit, Some(1));
    assert!(error.contains("E603 parts holds faults"), "{error}");
    // Cases of another program version, or in an older format.
    let about = folder.join("parts/sweep.json");
    let text = std::fs::read_to_string(&about).unwrap();
    std::fs::write(&about, text.replace("\"version\": \"", "\"version\": \"9")).unwrap();
    let (exit, _, error) = run_flexor(&folder, &few("12", "parts"));
    assert_eq!(exit, Some(1));
    assert!(error.contains("the same with version 0"), "{error}");
    std::fs::create_dir(folder.join("earlier")).unwrap();
    std::fs::write(folder.join("earlier/faults.jsonl"), "{}\n").unwrap();
    let (exit, _, error) = run_flexor(&folder, &few("12", "earlier"));
    assert_eq!(exit, Some(1));
    assert!(error.contains("E790 earlier has a campaign"), "{error}");
}

/// Shards of a class and of all classes merge into the folders of undivided campaigns.
#[test]
fn shards_of_a_campaign_merge_to_the_bytes_of_one() {
    let folder = test_folder("faults_shards");
    let words = |line: &str| -> Vec<String> { line.split(' ').map(str::to_owned).collect() };
    let output = |line: &str| {
        let words = words(line);
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let (exit, text, error) = run_flexor(&folder, &words);
        assert_eq!(exit, Some(0), "{line}: {error}");
        text
    };
    let few = "--device native --draws 5 --seed 1000";
    for class in ["declarations", "all"] {
        output(&format!("faults --class {class} {few} --out {class}"));
        for n in 1..=2 {
            let shard = format!("faults --class {class} {few} --shard {n}/2 --out {class}-{n}");
            let merging = format!("flexor faults --class {class} --device native --merge");
            assert!(output(&shard).contains(&merging));
        }
        let merge = format!(
            "faults --class {class} --device native --merge {class}-1 {class}-2 --out {class}-merged"
        );
        assert!(output(&merge).starts_with("class, kind "));
    }
    for (campaign, other) in [
        ("declarations", "declarations-merged"),
        ("all/link", "all-merged/link"),
    ] {
        for file in ["result.json", "result.html", "faults.csv", "units.jsonl"] {
            let read = |dir: &str| std::fs::read(folder.join(dir).join(file)).unwrap();
            assert!(read(campaign) == read(other), "{other}: {file}");
        }
    }
    let other = "faults --class electrode --device native --merge declarations-1 declarations-2 \
                 --out no";
    let (exit, _, error) = run_flexor(&folder, &other.split_whitespace().collect::<Vec<_>>());
    assert_eq!(exit, Some(1));
    assert!(error.contains("E604"), "{error}");
}

#[test]
fn all_classes_of_a_simulator_are_one_table_and_a_folder_each() {
    let folder = test_folder("faults_all");
    let asked = "faults --class all --device native --draws 3 --seed 1000 --out all";
    let asked: Vec<&str> = asked.split(' ').collect();
    let (exit, output, error) = run_flexor(&folder, &asked);
    assert_eq!(exit, Some(0), "{error}");
    for class in ["declarations", "electrode"] {
        assert!(output.contains(&format!("\n{class} ")), "{output}");
        assert!(folder.join("all").join(class).join("result.json").is_file());
    }
    let (exit, _, error) = run_flexor(&folder, &["faults", "--class", "all", "--only", "1"]);
    assert_eq!(exit, Some(2));
    assert!(error.contains("E518 --only needs a class"), "{error}");
}

#[test]
fn what_cannot_be_played_is_refused_by_name() {
    let folder = test_folder("faults_refused");
    for (arguments, exits, wanted) in [
        (
            &["--class", "flips", "--device", "native"][..],
            1,
            "E620 --class flips needs",
        ),
        (
            &["--class", "bits"],
            2,
            "available: flips, declarations, registers, electrode, link, sensor, streams, cpu, \
             supply, pairs, allowance, or all",
        ),
        (
            &["--class", "flips", "--draws", "0"],
            2,
            "E518 --draws is 0",
        ),
        (
            &["--class", "flips", "--only", "1000000"],
            2,
            "E518 --only is 1000000; allowed: 0 to 999999",
        ),
        (
            &["--class", "flips", "--device", "qemu"],
            2,
            "E518 --device is qemu",
        ),
        (&["--class", "flips", "--image", "session.toml"], 1, "E531 "),
    ] {
        let (exit, _, error) = run_flexor(&folder, &[&["faults"], arguments].concat());
        assert_eq!(exit, Some(exits), "{error}");
        assert!(error.contains(wanted), "{error}");
    }
}

/// Finished cases are reported even if their folder disappears meanwhile.
#[test]
fn a_folder_that_vanishes_takes_only_what_would_be_in_it() {
    let folder = test_folder("faults_vanished");
    let asked = "--json faults --class declarations --device native --draws 100000 --out gone";
    let asked: Vec<&str> = asked.split(' ').collect();
    let gone = folder.join("gone");
    let report = loop {
        let mut command = flexor_command(&folder, &asked);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut program = command.spawn().unwrap();
        while !gone.join("units.jsonl").exists() {
            assert_eq!(program.try_wait().unwrap(), None, "it ended by itself");
            std::thread::yield_now();
        }
        while gone.exists() {
            let _ = std::fs::remove_dir_all(&gone);
        }
        let id = program.id().to_string();
        let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
        assert!(sent.success());
        let (exit, output, _) = command_result(program.wait_with_output().unwrap());
        assert_eq!(exit, Some(1), "{output}");
        let value: Value = serde_json::from_str(&output).unwrap();
        // Otherwise the folder disappeared before the first case.
        if value["result"].is_object() {
            break value;
        }
    };
    let error = report["error"].as_str().unwrap();
    assert!(error.contains("gone"), "{error}");
    assert!(report["folder"].is_null(), "{report}");
    let cut_short = report["result"]["cut_short"].as_str().unwrap();
    assert!(cut_short.starts_with("Cut short after "), "{cut_short}");
    // An endless image file is refused, too.
    let endless = ["faults", "--class", "flips", "--image", "/dev/zero"];
    let (exit, _, error) = run_flexor(&folder, &endless);
    assert_eq!(exit, Some(1));
    assert!(error.contains("E530 the image /dev/zero"), "{error}");
}
