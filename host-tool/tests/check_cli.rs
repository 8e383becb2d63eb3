//! Tests of `flexor check` and `flexor new`: every mistake of every file, and a first file.

use crate::program::{run_flexor, test_folder, write_file};
use host_core::session::Session;
use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

/// Returns the exit code, the JSON object, and the text for people.
fn run_check(folder: &Path, files: &[&str]) -> (Option<i32>, serde_json::Value, String) {
    let begun = Instant::now();
    let arguments = [&["--json", "check"], files].concat();
    let (exit, out, _) = run_flexor(folder, &arguments);
    println!("{files:?}: {} ms", begun.elapsed().as_millis());
    let arguments = [&["check"], files].concat();
    let (_, _, text) = run_flexor(folder, &arguments);
    (exit, serde_json::from_str(&out).unwrap(), text)
}

/// Returns the numbers of a file's mistakes, after a check that each has a place and a remedy.
fn numbers(checked: &serde_json::Value, file: usize) -> Vec<&str> {
    let mistakes = checked["sessions"][file]["mistakes"].as_array().unwrap();
    let numbers = mistakes
        .iter()
        .map(|value| value["number"].as_str().unwrap());
    numbers.collect()
}

#[test]
fn good_files_are_good_and_every_mistake_of_every_bad_one_is_told() {
    let folder = test_folder("check_files");
    let good = std::fs::read_to_string(folder.join("session.toml")).unwrap();
    let (exit, report, _) = run_check(&folder, &["session.toml"]);
    assert_eq!(
        (exit, &report["error"]),
        (Some(0), &serde_json::Value::Null)
    );
    assert_eq!(numbers(&report, 0), [""; 0]);
    let bad = good
        .replace("rise_ms = 10", "rise_ms = 0")
        .replace("width_us", "widht_us");
    std::fs::write(folder.join("bad.toml"), bad).unwrap();
    std::fs::create_dir(folder.join("folder.toml")).unwrap();
    let files = ["bad.toml", "session.toml", "absent.toml", "folder.toml"];
    let (exit, report, people) = run_check(&folder, &files);
    assert_eq!(exit, Some(1));
    assert_eq!(numbers(&report, 0), ["E407", "E402"]);
    assert_eq!(report["sessions"][0]["mistakes"][1]["line"], 14);
    assert_eq!(numbers(&report, 1), [""; 0]);
    assert_eq!(numbers(&report, 2), ["E400"]);
    assert_eq!(numbers(&report, 3), ["E400"]);
    let parts = [
        "bad.toml:6:11",
        "did you mean `width_us`?",
        "absent.toml",
        "E524 4 mistakes in 3 of 4",
    ];
    for part in parts {
        assert!(people.contains(part), "{part}: {people}");
    }
    assert_eq!(run_flexor(&folder, &["check"]).0, Some(2));
}

/// Files that no person writes are refused quickly, too; the test prints the time.
#[test]
fn monstrous_files_are_told_apart() {
    let folder = test_folder("check_monsters");
    let good = std::fs::read_to_string(folder.join("session.toml")).unwrap();
    let huge = format!("{good}{}", "# nothing\n".repeat(1 << 20));
    let mut hundred = good.replace("duration_s = 30.0", "duration_s = 30.0\n");
    hundred.push_str("[simulated_trigger]\nat_s = [1.0]\n[study]\n");
    for number in 0..100 {
        let _ = writeln!(hundred, "mistake_{number} = {number}");
    }
    // The largest file that is read at all, full of mistakes.
    let mut worst = String::from("[study]\n");
    while worst.len() < (1 << 20) - 30 {
        let _ = writeln!(worst, "m{} = 1", worst.len());
    }
    let digits = "1234567890".repeat(4);
    let long = good
        .replace("limit = 15.0", &format!("limit = {digits}.5"))
        .replace("width_us = 200", &format!("width_us = {digits}"));
    let twice = format!("{good}\n[wearer]\nrise_ms = 20\n[setpoints]\nrate_hz = 1\n");
    let cases: [(&str, &str, &[&str], usize); 5] = [
        ("huge.toml", &huge, &["E400"], 1),
        ("hundred.toml", &hundred, &["E402", "E465"], 101),
        ("worst.toml", &worst, &["E402", "E404", "E411"], 201),
        ("long.toml", &long, &["E406"], 2),
        ("twice.toml", &twice, &["E401"], 4),
    ];
    for (name, text, expected, count) in cases {
        write_file(&folder, name, text);
        let (exit, report, people) = run_check(&folder, &[name]);
        let mut numbers = numbers(&report, 0);
        assert_eq!(
            (exit, numbers.len()),
            (Some(1), count),
            "{name}: {numbers:?}"
        );
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!(numbers, expected, "{name}");
        assert!(people.contains("E524"), "{name}: {people}");
    }
}

#[test]
fn a_new_file_is_good_and_never_replaces_one() {
    let folder = test_folder("new");
    let new = |arguments: &[&str]| {
        let arguments = [&["--json", "new"], arguments].concat();
        let (exit, out, _) = run_flexor(&folder, &arguments);
        (exit, out)
    };
    assert_eq!(new(&["plain.toml"]).0, Some(0));
    let line = "ten.toml --channels 10 --stage voltage --limit 30 --schema schema.json --title";
    let options: Vec<_> = line.split(' ').chain(["Ten \"new\""]).collect();
    assert_eq!(new(&options).0, Some(0));
    let (exit, report, _) = run_check(&folder, &["plain.toml", "ten.toml"]);
    assert_eq!(exit, Some(0));
    assert_eq!(report["sessions"][1]["title"], "Ten \"new\"");
    let before = std::fs::read(folder.join("ten.toml")).unwrap();
    assert!(before.starts_with(b"#:schema schema.json\n"));
    let (exit, out) = new(&["ten.toml"]);
    assert!(exit == Some(1) && out.contains("E525"), "{out}");
    assert_eq!(std::fs::read(folder.join("ten.toml")).unwrap(), before);
    let (exit, out) = new(&["bad.toml", "--frequency", "300"]);
    assert!(exit == Some(2) && out.contains("frequency_hz"), "{out}");
    assert!(!folder.join("bad.toml").exists());
}

/// Wearer files are checked together with sessions, with all their mistakes; a good wearer file
/// makes a session.
#[test]
fn wearer_files_are_checked_and_make_sessions() {
    let folder = test_folder("check_wearer");
    let shipped = host_core::wearer::builtin_wearer("K05").unwrap();
    write_file(&folder, "K05.toml", shipped);
    let bad = shipped
        .replace("motor_threshold = 10\n", "motor_threshold = 15\n")
        .replace("name = \"K05\"", "name = \"Jane Doe\"");
    write_file(&folder, "bad.toml", bad);
    let other = shipped.replace("schema = 1", "schema = 3");
    write_file(&folder, "other.toml", other);
    let (exit, report, people) = run_check(
        &folder,
        &["K05.toml", "session.toml", "bad.toml", "other.toml"],
    );
    assert_eq!(exit, Some(1), "{people}");
    assert_eq!(report["sessions"][0]["wearer"], "K05.toml");
    assert_eq!(numbers(&report, 0), [""; 0]);
    assert_eq!(numbers(&report, 2), ["E652", "E653"]);
    assert_eq!(numbers(&report, 3), ["E651"]);
    assert_eq!(report["sessions"][0]["name"], "K05");
    assert_eq!(report["sessions"][0]["evidence"], "printed");
    assert!(
        people.contains("E524 3 mistakes in 2 of 4 files"),
        "{people}"
    );
    let (exit, _, error) = run_flexor(&folder, &["new", "mine.toml", "--wearer", "K05.toml"]);
    assert_eq!(exit, Some(0), "{error}");
    let (exit, report, people) = run_check(&folder, &["mine.toml"]);
    assert_eq!(exit, Some(0), "{people}");
    assert_eq!(numbers(&report, 0), [""; 0]);
    let session = Session::load(folder.join("mine.toml")).unwrap();
    assert_eq!(session.channels[0].spec.limit.get(), 15_000);
    assert!(session.channels[0].muscle.is_some());
    // The session is in another folder than the wearer file.
    std::fs::create_dir(folder.join("deep")).unwrap();
    let arguments = [
        "new",
        "deep/mine.toml",
        "--wearer",
        "K05.toml",
        "--amplitude",
        "12",
    ];
    assert_eq!(run_flexor(&folder, &arguments).0, Some(0));
    Session::load(folder.join("deep/mine.toml")).unwrap();
    let arguments = [
        "new",
        "deep/high.toml",
        "--wearer",
        "K05.toml",
        "--amplitude",
        "16",
    ];
    let (exit, _, error) = run_flexor(&folder, &arguments);
    assert_eq!(exit, Some(2), "{error}");
    assert!(error.contains("E453"), "{error}");
}
