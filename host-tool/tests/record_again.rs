//! Tests of records that are used again: repeated, reported, compared, kept.

use super::program::{run_flexor, test_folder, write_file};
use host_core::record::{self, sha256};
use host_core::wearer::builtin_wearer;
use std::fs;
use std::path::{Path, PathBuf};

fn session(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("sessions")
        .join(name)
}

/// Writes the session, shortened to `seconds`, in `folder`.
pub(crate) fn shortened_session(folder: &Path, name: &str, seconds: f64) -> String {
    let text = fs::read_to_string(session(name)).unwrap();
    let line = text.lines().find(|l| l.starts_with("duration_s")).unwrap();
    let text = text.replace(line, &format!("duration_s = {seconds:?}"));
    let (before, measure) = text.split_once("[measure]").unwrap_or((&text, ""));
    let after = measure.find("\n[").map_or("", |at| &measure[at..]);
    let file = name.replace('/', "_");
    write_file(
        folder,
        &file,
        with_wearer(folder, &format!("{before}{after}")),
    );
    file
}

/// Returns the session, and copies the shipped wearer file that it refers to into `folder`.
pub(crate) fn with_wearer(folder: &Path, session: &str) -> String {
    let Some((before, after)) = session.split_once("wearers/") else {
        return session.to_owned();
    };
    let (name, after) = after.split_once('"').unwrap();
    write_file(folder, name, builtin_wearer(name).unwrap());
    let (before, _) = before.rsplit_once('"').unwrap();
    format!("{before}\"{name}\"{after}")
}

/// Runs a command that must succeed, and returns its JSON.
pub(crate) fn run_json(folder: &Path, line: &str) -> serde_json::Value {
    let arguments: Vec<&str> = line.split_whitespace().chain(["--json"]).collect();
    let (exit, json, error) = run_flexor(folder, &arguments);
    assert_eq!(exit, Some(0), "{line}: {error}{json}");
    serde_json::from_str(json.lines().last().unwrap()).unwrap()
}

/// Returns exit code and message of a command.
pub(crate) fn run_failing(folder: &Path, line: &str) -> (Option<i32>, String) {
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let (exit, _, error) = run_flexor(folder, &arguments);
    (exit, error)
}

/// Returns every file below a record, with its relative path and its bytes.
pub(crate) fn files(dir: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(dir).unwrap().to_owned();
                found.push((name, fs::read(path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

/// Copies a record in `folder` to another name.
pub(crate) fn copy_record(folder: &Path, record: &str, name: &str) -> PathBuf {
    let copy = folder.join(name);
    for (file, bytes) in files(&folder.join(record)) {
        fs::create_dir_all(copy.join(&file).parent().unwrap()).unwrap();
        write_file(&copy, file.to_str().unwrap(), bytes);
    }
    copy
}

/// Checks that two records are identical except for `host` in `run.json`.
fn assert_same_records(first: &Path, other: &Path) {
    let (first_files, other) = (files(first), files(other));
    let names =
        |entries: &[(PathBuf, Vec<u8>)]| entries.iter().map(|f| f.0.clone()).collect::<Vec<_>>();
    assert_eq!(names(&first_files), names(&other));
    for ((name, a), (_, b)) in first_files.iter().zip(&other) {
        if name == Path::new("run.json") {
            let json = |bytes: &[u8]| {
                let mut json: serde_json::Value = serde_json::from_slice(bytes).unwrap();
                assert!(json["host"].take().is_object());
                json
            };
            assert_eq!(json(a), json(b));
        } else {
            assert!(a == b, "{} differs", name.display());
        }
    }
}

/// Runs a session, then repeats it from the record alone, without the session file.
fn check_repeat(name: &str, seconds: f64, options: &str) {
    let folder = test_folder(&format!("again_{}", name.replace(['/', '.'], "_")));
    let file = shortened_session(&folder, name, seconds);
    run_json(&folder, &format!("run {file} --out first {options}"));
    fs::remove_file(folder.join(&file)).unwrap();
    let _ = fs::remove_file(folder.join("harris-1.toml"));
    fs::rename(folder.join("first"), folder.join("moved")).unwrap();
    let json = run_json(&folder, "rerun moved --out second");
    assert_eq!(json["same"], true, "{json}");
    let samples = &record::load(&folder.join("second")).unwrap().trials[0].samples;
    assert!(samples.len() > 20, "{name}: {} samples", samples.len());
    if options.contains("--vcd") {
        let given = fs::read(folder.join("out.vcd")).unwrap();
        let made = folder.join("second/outputs.vcd");
        assert!(given == fs::read(&made).unwrap(), "the waveforms differ");
        fs::remove_file(made).unwrap();
    }
    assert_same_records(&folder.join("moved"), &folder.join("second"));
}

#[test]
fn each_kind_of_session_repeats() {
    let wall = "harris_wall/3_pre_wall_co_contraction.toml";
    for (name, seconds, options) in [
        ("ten_channels.toml", 1.0, "--vcd out.vcd --notes first"),
        ("hamana_exp4_two_point.toml", 2.0, "--law paper --seed 77"),
        ("force_ramp.toml", 2.0, "--seed 3"),
        (wall, 2.0, "--seed 5"),
        ("trigger.toml", 1.0, ""),
    ] {
        check_repeat(name, seconds, options);
    }
}
#[test]
fn the_flashed_image_and_qemu_repeat() {
    for device in ["chip", "qemu"] {
        let folder = test_folder(&format!("again_{device}"));
        let file = shortened_session(&folder, "ten_channels.toml", 0.3);
        let line = format!("run {file} --device {device} --out first");
        run_json(&folder, &line);
        assert_eq!(run_json(&folder, "rerun first --out second")["same"], true);
        assert_same_records(&folder.join("first"), &folder.join("second"));
    }
}

/// An image inside the record that is replaced is read before it is deleted.
#[test]
fn an_image_inside_the_replaced_record_survives() {
    let folder = test_folder("own_image");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    run_json(&folder, &format!("run {file} --device chip --out first"));
    let image = hal_sim::images::Image::Stimulator
        .build(&Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .unwrap();
    fs::copy(&image, folder.join("first/image.elf")).unwrap();
    let line = format!("run {file} --device chip --image first/image.elf --out first --overwrite");
    run_json(&folder, &line);
    let kept = fs::read(folder.join("first/image.elf")).unwrap();
    assert_eq!(kept, fs::read(image).unwrap());
}

#[test]
fn an_experiment_repeats() {
    let folder = test_folder("again_experiment");
    let line = "experiment harris-wall --draws 1 --seed 9 --out first";
    run_json(&folder, line);
    let json = run_json(&folder, "rerun first --out second");
    assert_eq!(
        (&json["same"], &json["rerun_of"]),
        (&true.into(), &"first".into())
    );
    assert!(json["result"]["shares"].is_array(), "{json}");
    assert_same_records(&folder.join("first"), &folder.join("second"));
    // The random wearers and the result are compared, too.
    for (file, from, to) in [
        ("draws.csv", ",0.", ",7."),
        ("result.json", "\"n\": 1", "\"n\": 2"),
    ] {
        let copy = copy_record(&folder, "first", "changed");
        let text = fs::read_to_string(copy.join(file)).unwrap();
        let changed = text.replacen(from, to, 1);
        assert_ne!(text, changed, "{file}");
        let line = 1 + text
            .lines()
            .zip(changed.lines())
            .take_while(|(a, b)| a == b)
            .count();
        fs::write(copy.join(file), changed).unwrap();
        let (exit, error) = run_failing(&folder, "rerun changed --out third --overwrite");
        assert_eq!(exit, Some(1), "{file}: {error}");
        let wanted = format!("E596 the rerun differs from the record: {file}, line {line}");
        assert!(error.contains(&wanted), "{wanted}: {error}");
    }
    let copy = copy_record(&folder, "first", "lacking");
    fs::remove_file(copy.join("result.json")).unwrap();
    let json = run_json(&folder, "report lacking");
    let damaged = json["damaged"].as_str().unwrap();
    assert!(
        damaged.contains("E607 cannot read or write lacking/result.json"),
        "{damaged}"
    );
}

/// A user's declaration is repeated from its record alone; a changed record is refused.
#[test]
fn a_declaration_of_ones_own_repeats_from_its_record() {
    let folder = test_folder("again_own");
    shortened_session(&folder, "hamana_exp4_two_point.toml", 1.0);
    let declaration = r#"
name = "own"
title = "Own"
source = "nobody"
session = "hamana_exp4_two_point.toml"
seed = 3
draws = 1
measures = ["charge_mc"]
[[factor]]
name = "law"
[[factor.level]]
name = "the default"
[[factor.level]]
name = "the paper's"
set = { "joint.law" = "paper" }
"#;
    write_file(&folder, "own.toml", declaration);
    run_json(&folder, "experiment own.toml --draws 0 --out first");
    let page = fs::read_to_string(folder.join("first/result.html")).unwrap();
    let command = "flexor experiment own.toml --seed 3 --draws 0";
    assert!(page.contains(command), "{page}");
    for name in ["own.toml", "hamana_exp4_two_point.toml"] {
        fs::remove_file(folder.join(name)).unwrap();
    }
    fs::rename(folder.join("first"), folder.join("moved")).unwrap();
    run_json(&folder, "rerun moved --out second");
    assert_same_records(&folder.join("moved"), &folder.join("second"));
    for (file, number) in [
        (
            "declaration.toml",
            "its SHA-256 differs from that in the record",
        ),
        ("declared/01-hamana_exp4_two_point.toml", "No such file"),
    ] {
        let copy = copy_record(&folder, "moved", "changed");
        match number.starts_with("No") {
            true => fs::remove_file(copy.join(file)).unwrap(),
            false => fs::write(copy.join(file), "").unwrap(),
        }
        let (exit, error) = run_failing(&folder, "rerun changed --out third");
        assert_eq!(exit, Some(1));
        let wanted = format!("E613 changed/{file} differs from what the record was made with");
        assert!(error.contains(&wanted) && error.contains(number), "{error}");
        assert!(!folder.join("third").exists());
        let json = run_json(&folder, "report changed");
        assert!(json["damaged"].as_str().unwrap().contains(number), "{json}");
    }
    // A replaced record leaves no file behind.
    shortened_session(&folder, "hamana_exp4_two_point.toml", 1.0);
    let line = "run hamana_exp4_two_point.toml --out moved --overwrite";
    run_json(&folder, line);
    assert!(!folder.join("moved/declared").exists());
    assert!(!folder.join("moved/declaration.toml").exists());
}

/// The demo is an experiment's record with a picture, and is repeated as such.
#[test]
fn the_demo_repeats() {
    let folder = test_folder("again_demo");
    let json = run_json(&folder, "demo --out first --seed 4");
    assert_eq!(json["trials"].as_array().unwrap().len(), 6);
    for row in json["trials"].as_array().unwrap() {
        for key in ["rmse_deg", "paper_mean_deg", "pulses"] {
            assert!(row[key].as_f64().unwrap() > 1.0, "{row}");
        }
    }
    // The output begins with the comparison, and counts pulses as the page does.
    let compared = &json["comparison"];
    assert_eq!(compared["this"], "two points");
    assert_eq!(compared["pairs"].as_array().unwrap().len(), 2);
    let played = record::load(&folder.join("first")).unwrap();
    for row in json["trials"].as_array().unwrap() {
        let mut trials = played.trials.iter();
        let own = trials.find(|trial| row["trial"] == *trial.name).unwrap();
        assert_eq!(row["pulses"].as_u64(), own.pulses, "{row}");
    }
    let page = fs::read_to_string(folder.join("first/report.html")).unwrap();
    let begins = "<p class=\"result\">RMSE with two points against the better point alone: ";
    assert!(page.contains(begins));
    run_json(&folder, "rerun first --out second");
    let trial = |dir: &str| record::load(&folder.join(dir)).unwrap();
    let (first, second) = (trial("first"), trial("second"));
    assert_eq!(first.trials, second.trials);
    assert_eq!(first.paper.len(), 6);
    for file in ["picture.svg", "result.json", "declaration.toml"] {
        let bytes = |dir: &str| fs::read(folder.join(dir).join(file)).unwrap();
        assert!(bytes("first") == bytes("second"), "{file}");
    }
}

#[test]
fn runs_never_meet() {
    let folder = test_folder("never_meet");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    let line = format!("run {file}");
    let records: Vec<String> = std::thread::scope(|scope| {
        let run = || {
            run_json(&folder, &line)["record"]
                .as_str()
                .unwrap()
                .to_owned()
        };
        let threads: Vec<_> = (0..3).map(|_| scope.spawn(run)).collect();
        let joined = threads.into_iter().map(|thread| thread.join().unwrap());
        joined.collect()
    });
    let mut names = records.clone();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), 3, "{records:?}");
    for name in names {
        let kept = record::load(&folder.join(name)).unwrap();
        assert!(!kept.ending.is_incomplete());
    }
}

#[test]
fn a_record_is_replaced_only_where_it_is_meant() {
    let folder = test_folder("overwrite");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    run_json(&folder, &format!("run {file} --out one"));
    fs::write(folder.join("one/thesis.tex"), "years").unwrap();
    let before = files(&folder.join("one"));
    let (exit, error) = run_failing(&folder, &format!("run {file} --out one --seed 2"));
    assert_eq!(exit, Some(1));
    assert!(error.contains("E590 one is not empty"), "{error}");
    assert_eq!(files(&folder.join("one")), before);
    let line = format!("run {file} --out one --seed 2 --overwrite");
    run_json(&folder, &line);
    assert_eq!(record::load(&folder.join("one")).unwrap().seed, Some(2));
    let kept = fs::read_to_string(folder.join("one/thesis.tex")).unwrap();
    assert_eq!(kept, "years");
    fs::create_dir(folder.join("other")).unwrap();
    fs::write(folder.join("other/thesis.tex"), "years").unwrap();
    let (_, error) = run_failing(&folder, &format!("run {file} --out other --overwrite"));
    assert!(error.contains("E592 other is not a record"), "{error}");
    assert_eq!(files(&folder.join("other")).len(), 1);
}

#[test]
fn what_is_no_record_is_named() {
    let folder = test_folder("no_record");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    run_json(&folder, &format!("run {file} --out one"));
    // Changes the file that contains one of these keys.
    let change = |name: &str, key: &str, to: &[(&str, serde_json::Value)]| {
        let copy = copy_record(&folder, "one", name);
        for file in ["run.json", "01-ten-channels/trial.json"] {
            let bytes = fs::read(copy.join(file)).unwrap();
            let mut json: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
            if json.get(key).is_some() {
                for (pointer, value) in to {
                    *json.pointer_mut(pointer).unwrap() = value.clone();
                }
            }
            write_file(&copy, file, json.to_string());
        }
    };
    change("newer", "format", &[("/format", 99.into())]);
    let board = [
        ("/identity/kind", "board".into()),
        ("/identity/in_process", false.into()),
        ("/identity/unique_id", "24003900".into()),
    ];
    change("board", "identity", &board);
    change("port", "identity", &board[1..2]);
    let another = sha256(b"another").into();
    change("altered", "session_sha256", &[("/session_sha256", another)]);
    fs::create_dir(folder.join("empty")).unwrap();
    let rows = [
        ("rerun empty", "E593 empty is not a record"),
        ("report empty", "E593 empty is not a record"),
        ("compare one empty", "E593 empty is not a record"),
        ("report absent", "E593 absent is not a record"),
        ("report newer", "E594 the record in newer has format 99"),
        ("rerun newer", "E594"),
        ("rerun altered", "E595 altered/01-"),
        (
            "rerun board",
            "E597 board is the record of a board (24003900)",
        ),
        ("rerun port", "E598 port was recorded in real time"),
    ];
    let before = files(&folder);
    for (line, says) in rows {
        let (exit, error) = run_failing(&folder, line);
        assert_eq!(exit, Some(1), "{line}");
        assert!(error.contains(says), "{line}: {error}");
    }
    assert_eq!(files(&folder), before, "something was touched");
}

#[test]
fn a_row_that_differs_is_named() {
    let folder = test_folder("differs");
    let file = shortened_session(&folder, "ten_channels.toml", 0.3);
    run_json(&folder, &format!("run {file} --out one"));
    let trial = record::load(&folder.join("one")).unwrap().trials.remove(0);
    let path = record::trial_folder(&folder.join("one"), 0, &trial.name).join("samples.csv");
    let text = fs::read_to_string(&path).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[4] = lines[4].replacen("0.0", "0.1", 1);
    fs::write(&path, lines.join("\n") + "\n").unwrap();
    let (exit, error) = run_failing(&folder, "rerun one --out two");
    assert_eq!(exit, Some(1));
    assert!(error.contains("E596"), "{error}");
    assert!(error.contains("samples.csv"), "{error}");
    assert!(error.contains("line 5"), "{error}");
}

#[test]
fn the_page_is_made_again_and_records_are_compared() {
    let folder = test_folder("page_again");
    let file = shortened_session(&folder, "hamana_exp4_two_point.toml", 2.0);
    for (name, law) in [("one", "recommended"), ("two", "paper")] {
        run_json(&folder, &format!("run {file} --law {law} --out {name}"));
    }
    let before = files(&folder.join("one"));
    fs::remove_file(folder.join("one/report.html")).unwrap();
    run_json(&folder, "report one");
    assert_eq!(files(&folder.join("one")), before);
    let page = fs::read_to_string(folder.join("one/report.html")).unwrap();
    assert!(page.contains("flexor rerun ."), "how to reproduce");

    let json = run_json(&folder, "compare one two --out both");
    assert_eq!(json["rows"].as_array().unwrap().len(), 2);
    let rmse = |row: usize| json["rows"][row]["rmse_deg"].as_f64().unwrap();
    assert!(rmse(0) != rmse(1));
    let page = fs::read_to_string(folder.join("both/compare.html")).unwrap();
    assert!(page.contains("no evidence about people"));
    for request in ["https:", "<script", "src=", "@import", "<link"] {
        assert!(!page.contains(request), "{request}");
    }
    let (_, text, _) = run_flexor(&folder, &["run", &file, "--out", "three"]);
    assert!(
        text.contains("°; report: three") && !text.contains("refused"),
        "{text}"
    );
    let (_, text, _) = run_flexor(&folder, &["compare", "one", "two"]);
    for line in text.lines().filter(|line| !line.starts_with("page:")) {
        assert!(line.chars().count() <= 80, "{line}");
    }
}

#[test]
fn the_study_is_in_the_record_and_options_go_first() {
    let folder = test_folder("study");
    let file = shortened_session(&folder, "ten_channels.toml", 0.1);
    let text = fs::read_to_string(folder.join(&file)).unwrap();
    let study = "\n[study]\npseudonym = \"P07\"\nethics = \"EC 2026-014\"\n\
                 electrodes = [{ channel = 1, place = \"wrist\" }]\n";
    fs::write(folder.join(&file), format!("{text}{study}")).unwrap();
    let options = "--operator AB --electrode 1=elbow --pseudonym P08";
    run_json(&folder, &format!("run {file} --out one {options}"));
    let run = record::load(&folder.join("one")).unwrap();
    assert_eq!(run.study.pseudonym.as_deref(), Some("P08"));
    assert_eq!(run.study.operator.as_deref(), Some("AB"));
    assert_eq!(run.study.ethics.as_deref(), Some("EC 2026-014"));
    assert_eq!(run.study.notes, None);
    assert_eq!(run.study.electrodes[0].place, "elbow");
    let trial = &run.trials[0];
    assert_eq!(trial.session_text, format!("{text}{study}"));
    let sum = sha256(trial.session_text.as_bytes());
    assert_eq!(trial.session_sha256, Some(sum));
    assert!(trial.clock.unwrap().exchanges > 5);
    assert!(run.host.started_utc.ends_with('Z'));
    let (_, error) = run_failing(&folder, &format!("run {file} --electrode 11=nowhere"));
    assert!(error.contains("E518 --electrode 11=nowhere"), "{error}");
}

#[test]
fn docs_record_md_is_made_from_the_columns() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/record.md");
    let text = record::document();
    if std::env::var_os("FLEXOR_OVERWRITE").is_some() {
        fs::write(&path, &text).unwrap();
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    assert!(
        kept == text,
        "docs/reference/record.md is stale: FLEXOR_OVERWRITE=1 cargo test -p host-tool docs_record_md"
    );
}

/// A record of a session with a wearer keeps the wearer file, names the wearer, and is repeated
/// from its folder alone, but not with another file.
#[test]
fn a_record_keeps_its_wearer() {
    let folder = test_folder("again_wearer");
    let text = fs::read_to_string(session("harris_wall/1_pre_wall.toml")).unwrap();
    let text = text.replace("duration_s = 14.0", "duration_s = 0.5");
    write_file(&folder, "wall.toml", with_wearer(&folder, &text));
    run_json(&folder, "run wall.toml --out first");
    let path = folder.join("harris-1.toml");
    let wearer = fs::read(&path).unwrap();
    fs::remove_file(&path).unwrap();
    let trial = folder.join("first/01-harris-2017-virtual-wall-pre-wall");
    assert_eq!(fs::read(trial.join("wearer.toml")).unwrap(), wearer);
    let loaded = record::load(&folder.join("first")).unwrap();
    let kept = loaded.trials[0].wearer.as_ref().unwrap();
    let identity = (&*kept.file, &*kept.name, &*kept.evidence, &*kept.sha256);
    assert_eq!(
        identity,
        ("harris-1.toml", "harris-1", "simulated", &*sha256(&wearer))
    );
    assert_eq!(run_json(&folder, "rerun first --out second")["same"], true);
    assert_same_records(&folder.join("first"), &folder.join("second"));
    run_json(&folder, "report first");
    let page = fs::read_to_string(folder.join("first/report.html")).unwrap();
    assert!(
        page.contains("harris-1 (simulated)"),
        "the page does not say whose numbers"
    );
    // The session runs again from the record, where its wearer file is.
    let again = trial.join("session.toml");
    let again = again.strip_prefix(&folder).unwrap().display().to_string();
    run_json(&folder, &format!("check {again}"));
    run_json(&folder, &format!("run {again} --out third"));
    // Another wearer file is refused.
    for changed in [None, Some("schema = 1\n")] {
        let path = trial.join("wearer.toml");
        match changed {
            Some(text) => fs::write(&path, text).unwrap(),
            None => fs::remove_file(&path).unwrap(),
        }
        let (exit, error) = run_failing(&folder, "rerun first --out fourth");
        assert_eq!(exit, Some(1));
        assert!(
            error.contains("E595") && error.contains("wearer.toml"),
            "{error}"
        );
    }
}

/// The stimulated wearer must be the one in the wearer file, however it is named.
#[test]
fn another_person_than_the_file_s_is_refused_before_anything_is_recorded() {
    let folder = test_folder("again_person");
    let file = shortened_session(&folder, "hamana_exp4_two_point_wearer.toml", 0.1);
    let (exit, error) = run_failing(&folder, &format!("run {file} --pseudonym Q --out out"));
    assert_eq!(exit, Some(1));
    assert!(
        error.contains("E660 --pseudonym is Q, but the wearer file belongs to P"),
        "{error}"
    );
    assert!(!folder.join("out").exists());
    run_json(&folder, &format!("run {file} --pseudonym P --out out"));
}

/// An experiment with a wearer file states the file, and is repeated from its record alone.
#[test]
fn an_experiment_on_a_wearer_file_repeats() {
    let folder = test_folder("again_on_wearer");
    let text = builtin_wearer("harris-2").unwrap();
    let text = text.replace("motor_threshold = 25", "motor_threshold = 23");
    write_file(&folder, "mine.toml", text);
    let line = "experiment harris-wall --wearer mine.toml --draws 0 --seed 9 --out first";
    let json = run_json(&folder, line);
    let declared = &json["result"]["declared"];
    assert_eq!(declared["as_declared"], false);
    assert_eq!(
        declared["command"],
        "experiment harris-wall --wearer mine.toml --draws 0"
    );
    fs::remove_file(folder.join("mine.toml")).unwrap();
    assert_eq!(run_json(&folder, "rerun first --out second")["same"], true);
    assert_same_records(&folder.join("first"), &folder.join("second"));
    let (exit, error) = run_failing(
        &folder,
        "experiment harris-wall --wearer mine.toml --out third",
    );
    assert_eq!(exit, Some(1));
    assert!(error.contains("E650"), "{error}");
}
