//! Tests that records are never lost when they are read, and that missing data are reported.

use super::program::{Board, run_flexor, test_folder};
use super::record_again::{copy_record, files, run_failing, run_json, shortened_session};
use host_core::record;
use std::fs;
use std::path::{Path, PathBuf};

/// Makes a short record `one` in its own folder.
fn record_session(test: &str) -> PathBuf {
    let folder = test_folder(test);
    let file = shortened_session(&folder, "ten_channels.toml", 0.2);
    run_json(&folder, &format!("run {file} --out one"));
    folder
}

/// Copies the record `one` and lets `harm` change the copy.
fn damage_copy(folder: &Path, name: &str, harm: impl Fn(&Path)) {
    harm(&copy_record(folder, "one", name));
}

fn trial_of(record: &Path) -> PathBuf {
    let mut folders = fs::read_dir(record).unwrap().map(|e| e.unwrap().path());
    folders.find(|path| path.is_dir()).unwrap()
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn what_is_read_is_never_replaced() {
    let folder = record_session("sources");
    damage_copy(&folder, "two", |_| ());
    std::os::unix::fs::symlink(folder.join("one"), folder.join("link")).unwrap();
    let before = files(&folder.join("one"));
    let lines = [
        "compare one two --out one --overwrite",
        "compare two one --out ./one/../one --overwrite",
        "compare one two --out link --overwrite",
        "compare one two --out one",
        "rerun one --out one --overwrite",
        "rerun one --out link --overwrite",
        "rerun link --out one --overwrite",
    ];
    for line in lines {
        let (exit, error) = run_failing(&folder, line);
        assert_eq!(exit, Some(1), "{line}");
        assert!(error.contains("E586 --out"), "{line}: {error}");
        assert!(files(&folder.join("one")) == before, "{line} touched it");
    }
    // Another record may be replaced.
    run_json(&folder, "rerun one --out two --overwrite");
    assert_eq!(files(&folder.join("one")), before);
}

#[test]
fn what_a_record_has_lost_is_named() {
    let folder = record_session("damage");
    let summary = json(&folder.join("one/summary.json"));
    let rows = summary["trials"][0]["sample_rows"].as_u64().unwrap();
    let loaded = record::load(&folder.join("one")).unwrap();
    assert_eq!(rows as usize, loaded.trials[0].samples.len());
    assert!(rows > 10 && loaded.damage.is_empty(), "{rows} rows");

    let cut = |file: &'static str, from_end: usize| {
        move |copy: &Path| {
            let path = trial_of(copy).join(file);
            let text = fs::read_to_string(&path).unwrap();
            let lines: Vec<&str> = text.lines().collect();
            fs::write(path, lines[..lines.len() - from_end].join("\n") + "\n").unwrap();
        }
    };
    let gone =
        |file: &'static str| move |copy: &Path| fs::remove_file(trial_of(copy).join(file)).unwrap();
    damage_copy(&folder, "rows", cut("samples.csv", 3));
    damage_copy(&folder, "edges", cut("edges.csv", 1));
    damage_copy(&folder, "no_rows", gone("samples.csv"));
    damage_copy(&folder, "no_edges", gone("edges.csv"));
    damage_copy(&folder, "no_trial", gone("trial.json"));
    damage_copy(&folder, "no_folder", |copy| {
        fs::remove_dir_all(trial_of(copy)).unwrap();
    });
    damage_copy(&folder, "added", |copy| {
        let (first, added) = (trial_of(copy), copy.join("02-of-another"));
        fs::create_dir(&added).unwrap();
        for file in ["trial.json", "samples.csv", "edges.csv", "session.toml"] {
            fs::copy(first.join(file), added.join(file)).unwrap();
        }
    });
    let changed = |from: &'static str, to: &'static str| {
        move |copy: &Path| {
            let path = trial_of(copy).join("session.toml");
            let text = fs::read_to_string(&path).unwrap();
            assert!(text.contains(from));
            fs::write(path, text.replace(from, to)).unwrap();
        }
    };
    damage_copy(&folder, "no_session", gone("session.toml"));
    damage_copy(
        &folder,
        "session",
        changed("frequency_hz = ", "frequency_hz = 1"),
    );
    let left = rows - 3;
    let name = trial_of(&folder.join("one"));
    let name = name.file_name().unwrap().to_string_lossy().into_owned();
    #[rustfmt::skip]
    let copies = [
        ("rows", format!("{name}/samples.csv has {left} of {rows} rows")),
        ("edges", format!("{name}/edges.csv has ")),
        ("no_rows", format!("{name}/samples.csv is missing")),
        ("no_edges", format!("{name}/edges.csv is missing")),
        ("no_trial", format!("{name}/trial.json is missing")),
        ("no_folder", format!("the folder {name} is missing")),
        ("added", "the folder 02-of-another was added".to_owned()),
        ("no_session", format!("{name}/session.toml is missing")),
        ("session", format!("{name}/session.toml was changed after the run")),
    ];
    for (copy, damage) in copies {
        let says = format!("E585 the record in {copy} is damaged: {damage}");
        let (exit, error) = run_failing(&folder, &format!("rerun {copy} --out again"));
        assert_eq!(exit, Some(1), "{copy}");
        let is_told = match copy.ends_with("session") {
            true => error.contains(&format!("E595 {copy}/{name}/session.toml")),
            false => error.contains(&says),
        };
        assert!(is_told, "{copy}: {error}");
        assert!(!folder.join("again").exists(), "{copy}");

        // The page is written with the damage on it, also the second time.
        for _ in 0..2 {
            let reported = run_json(&folder, &format!("report {copy}"));
            let notice = reported["damaged"].as_str().unwrap();
            assert!(notice.contains(&says), "{copy}: {notice}");
            let page = fs::read_to_string(folder.join(copy).join("report.html")).unwrap();
            let headline = format!("<p class=\"result\">Damaged: {damage}");
            assert!(page.contains(&headline), "{copy}");
        }
        assert_eq!(json(&folder.join(copy).join("summary.json")), summary);
        let (_, text, _) = run_flexor(&folder, &["report", copy]);
        assert!(text.contains(" (damaged): "), "{text}");
        assert!(text.contains(&says), "{text}");

        let (exit, text, error) = run_flexor(&folder, &["compare", "one", copy]);
        assert_eq!(exit, Some(0), "{copy}: {error}");
        assert!(text.contains(&says), "{copy}: {text}");
        let compared = run_json(&folder, &format!("compare one {copy}"));
        assert_eq!(compared["damaged"].as_array().unwrap().len(), 1);
        // Rate and width of another session yield no numbers.
        let charge = compared.pointer("/rows/1/channels/0/cathodic_uc");
        let is_known = charge.is_some_and(serde_json::Value::is_number);
        let has_none = copy.ends_with("session") || copy == "no_trial" || copy == "no_folder";
        assert_eq!(is_known, !has_none, "{copy}: {charge:?}");
        let page = fs::read_to_string(folder.join(compared["page"].as_str().unwrap())).unwrap();
        assert!(page.contains(&format!("<b>Damaged: {damage}")), "{copy}");
    }
    let intact_report = run_json(&folder, "report one");
    assert_eq!(intact_report["damaged"], serde_json::Value::Null);
}

#[test]
fn files_that_are_none_have_a_number() {
    let folder = record_session("numbers");
    damage_copy(&folder, "torn", |copy| {
        fs::write(copy.join("run.json"), "{").unwrap();
    });
    damage_copy(&folder, "trial", |copy| {
        fs::write(trial_of(copy).join("trial.json"), "{").unwrap();
    });
    damage_copy(&folder, "column", |copy| {
        fs::write(trial_of(copy).join("samples.csv"), "a,b\n1,2\n").unwrap();
    });
    damage_copy(&folder, "bytes", |copy| {
        fs::write(trial_of(copy).join("samples.csv"), [0xff, 0xfe]).unwrap();
    });
    for (copy, says) in [
        ("torn", "E584 torn/run.json, line 1: EOF"),
        ("trial", "E584 trial/01-"),
        ("column", "E584 column/01-"),
        ("bytes", "E583 bytes/01-"),
    ] {
        for command in ["report", "rerun"] {
            let (exit, error) = run_failing(&folder, &format!("{command} {copy}"));
            assert_eq!(exit, Some(1), "{command} {copy}");
            assert!(error.contains(says), "{command} {copy}: {error}");
        }
    }
}

#[test]
fn a_run_counts_its_own_pulses_on_a_device_that_played_before() {
    let folder = test_folder("own_pulses");
    let file = shortened_session(&folder, "ten_channels.toml", 0.5);
    // In real time, together with other tests; host silence is not tested here.
    let path = folder.join(&file);
    let text = fs::read_to_string(&path).unwrap();
    let patient = text.replace("[wearer]", "[wearer]\nhost_timeout_ms = 1000");
    fs::write(path, patient).unwrap();
    let board = Board::tcp(&folder);
    for name in ["first", "second"] {
        let line = format!("run {file} --device {} --out {name}", board.at);
        run_json(&folder, &line);
    }
    drop(board);
    let counted = |name: &str| {
        let trial = record::load(&folder.join(name)).unwrap().trials.remove(0);
        let counter = |label: &str| trial.counters.iter().find(|(n, _)| n == label).unwrap().1;
        let (started_pulses, frames) = (counter("pulses started"), counter("frames understood"));
        let stopping = |(_, text): &&(f64, String)| text.starts_with("stopping");
        let (stop_s, _) = *trial.events.iter().find(stopping).unwrap();
        // Eleven channels at 50 Hz until the host stops them, and at most 0.1 s more while they
        // fall.
        let pulses = trial.pulses.unwrap();
        let due = 550.0 * stop_s - 22.0..550.0 * (stop_s + 0.1) + 22.0;
        assert!(
            due.contains(&(pulses as f64)),
            "{pulses} pulses in {stop_s} s"
        );
        (pulses, started_pulses, frames as f64 / stop_s)
    };
    let (first, first_all, first_frames) = counted("first");
    let (second, second_all, second_frames) = counted("second");
    // The pulses of the electrode check are the same.
    assert_eq!(second_all - second, first_all - first);
    assert!(
        second_frames < 1.5 * first_frames,
        "{second_frames} frames a second"
    );
    let compared = run_json(&folder, "compare first second");
    assert_eq!(compared["rows"][0]["pulses"], first);
    assert_eq!(compared["rows"][1]["pulses"], second);
}

#[test]
fn run_json_says_what_stimulated() {
    let folder = record_session("kind");
    let run = json(&folder.join("one/run.json"));
    assert_eq!(run["kind"], "native");
    assert_eq!(run["simulated"], true);
    // Unknown before a device has answered.
    let begun = folder.join("begun");
    record::write_run(&begun, &record::Run::default()).unwrap();
    let run = json(&begun.join("run.json"));
    assert!(run["kind"].is_null() && run["simulated"].is_null(), "{run}");
}
