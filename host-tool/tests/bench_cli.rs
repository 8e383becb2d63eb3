//! Tests of `flexor selftest --bench-test` against a simulator with dummy loads: right and wrong values,
//! typed and from a file, interrupted and resumed.

use crate::program::{flexor_command, run_flexor, test_folder, write_file};
use serde_json::Value;
use std::io::Write;
use std::path::Path;
use std::process::Stdio;

const WHO: &str = "selftest --bench-test --device native --out sheet.json --operator A-1 \
                   --date 2026-01-02 --instruments scope,probe";

fn words(more: &str) -> Vec<String> {
    let line = format!("{WHO} {more}");
    line.split_whitespace().map(ToOwned::to_owned).collect()
}

fn run(folder: &Path, more: &str) -> (Option<i32>, String, String) {
    let words = words(more);
    run_flexor(
        folder,
        &words.iter().map(String::as_str).collect::<Vec<_>>(),
    )
}

/// Returns answers for every step as a board would give them, except for the given ones.
fn answers(but: &[(&str, &str)]) -> String {
    let mut lines = vec![
        "# typed at the bench".to_owned(),
        "pump-period 50.001 us".into(),
    ];
    for (load, peak) in [("2000", "9.9"), ("500", "2.5"), ("10000", "51")] {
        lines.push(format!("{load}-peak {peak} V"));
        for (step, value) in [
            ("first", "200.2 us"),
            ("gap", "50 µs"),
            ("second", "199.5 us"),
            ("period", "20 ms"),
            ("match", "0.4 %"),
            ("mean", "0.1 mV"),
        ] {
            lines.push(format!("{load}-{step} {value}"));
        }
    }
    lines.extend(["stop 0.3 ms".into(), "fall 52 ms".into()]);
    for (id, value) in but {
        let line = lines
            .iter_mut()
            .find(|line| line.split(' ').next() == Some(id));
        *line.expect("a step") = format!("{id} {value}");
    }
    lines.join("\n")
}

fn sheet(folder: &Path) -> Value {
    let text = std::fs::read_to_string(folder.join("sheet.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

#[test]
fn a_simulator_is_measured_to_the_end_and_never_passes_as_a_board() {
    let folder = test_folder("bench_whole");
    write_file(&folder, "values", answers(&[]));
    let (code, out, error) = run(&folder, "--answers values --nobody-connected --json");
    assert_eq!(code, Some(0), "{error}");
    let report: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(
        (&report["verdict"], &report["simulated"]),
        (&"simulated".into(), &true.into())
    );
    let sheet = sheet(&folder);
    assert_eq!(sheet, report["sheet"]);
    assert_eq!(sheet["verdict"], "simulated");
    assert_eq!(sheet["device"]["kind"], "native");
    let details = ["operator", "date", "instruments"].map(|key| sheet[key].as_str().unwrap());
    assert_eq!(details, ["A-1", "2026-01-02", "scope,probe"]);
    let answers = sheet["answers"].as_array().unwrap();
    assert_eq!(answers.len(), 24);
    assert!(answers.iter().all(|answer| answer["holds"] == true));
    let loads: Vec<_> = answers
        .iter()
        .map(|value| value["load_ohm"].as_u64().unwrap())
        .collect();
    assert!([500, 2_000, 10_000].iter().all(|ohm| loads.contains(ohm)));
    // The existing file is neither replaced nor accepted as a board's.
    let (code, _, error) = run(&folder, "--answers values --nobody-connected");
    assert_eq!(code, Some(2), "{error}");
    assert!(
        error.contains("E518") && error.contains("--resume"),
        "{error}"
    );
    let text = std::fs::read_to_string(folder.join("sheet.json")).unwrap();
    let forged = text.replace("\"simulated\": true", "\"simulated\": false");
    write_file(&folder, "sheet.json", forged);
    let (code, _, error) = run(&folder, "--answers values --nobody-connected --resume");
    assert_eq!(code, Some(1), "{error}");
    assert!(
        error.contains("E786") && error.contains("was changed"),
        "{error}"
    );
}

#[test]
fn a_wrong_value_fails_its_step_by_name() {
    let folder = test_folder("bench_wrong");
    write_file(
        &folder,
        "values",
        answers(&[("500-peak", "2.7 V"), ("stop", "0.9 ms")]),
    );
    let (code, out, error) = run(&folder, "--answers values --nobody-connected --json");
    assert_eq!(code, Some(1), "{error}");
    assert!(
        error.contains("E788") && error.contains("500-peak, stop"),
        "{error}"
    );
    let report: Value = serde_json::from_str(out.lines().next().unwrap()).unwrap();
    assert_eq!(report["failed"], serde_json::json!(["500-peak", "stop"]));
    let failed = sheet(&folder)["answers"]
        .as_array()
        .unwrap()
        .iter()
        .filter(|value| value["holds"] == false)
        .count();
    assert_eq!(failed, 2);
}

#[test]
fn nonsense_is_told_all_at_once_before_anything_is_put_out() {
    let folder = test_folder("bench_nonsense");
    let nonsense = [
        ("500-peak", "2.5 mV"),
        ("2000-first", "two hundred us"),
        ("2000-gap", "-50 us"),
        ("stop", ""),
    ];
    write_file(&folder, "values", answers(&nonsense) + "\n700-peak 3 V");
    let (code, _, error) = run(&folder, "--answers values --nobody-connected");
    assert_eq!(code, Some(1), "{error}");
    for part in [
        "E789",
        "the unit is V",
        "begin with a number",
        "negative",
        "is empty",
        "there is no step 700-peak",
    ] {
        assert!(error.contains(part), "{part}: {error}");
    }
    assert!(!folder.join("sheet.json").exists());
    let (code, _, error) = run(&folder, "--answers values");
    assert_eq!(code, Some(1));
    assert!(error.contains("E784"), "{error}");
    for (more, part) in [
        ("--channel 11", "11"),
        ("--device chip", "E518"),
        (
            "--device tcp:127.0.0.1:1 --nobody-connected --answers none",
            "E789",
        ),
    ] {
        let more = more.replace("--device", "--seed 1 --device");
        let words = words(&more).join(" ").replacen(
            "--device native ",
            "",
            usize::from(more.contains("--device")),
        );
        let words: Vec<_> = words.split_whitespace().collect();
        let (code, _, error) = run_flexor(&folder, &words);
        assert!(
            code != Some(0) && error.contains(part),
            "{more}: {code:?} {error}"
        );
    }
}

/// Values typed through a pipe: an invalid value is asked for again, and the end of the input keeps
/// the measured values.
#[test]
fn typed_values_are_asked_for_again_and_an_end_is_gone_on_from() {
    let folder = test_folder("bench_typed");
    let typed = "nobody is connected\n\n50 mm\nletters\n\n50.001 us\n-3 V\n9.9 V\nskip\n";
    let texts = words("");
    let arguments: Vec<_> = texts.iter().map(String::as_str).collect();
    let mut command = flexor_command(&folder, &arguments);
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut program = command.spawn().unwrap();
    program
        .stdin
        .take()
        .unwrap()
        .write_all(typed.as_bytes())
        .unwrap();
    let (code, _, error) = crate::program::command_result(program.wait_with_output().unwrap());
    assert_eq!(code, Some(1), "{error}");
    assert!(error.contains("E783"), "{error}");
    assert_eq!(error.matches("E785 ").count(), 4, "{error}");
    let kept = sheet(&folder);
    let ids: Vec<_> = kept["answers"]
        .as_array()
        .unwrap()
        .iter()
        .map(|value| value["id"].clone())
        .collect();
    assert_eq!(ids, ["pump-period", "2000-peak"]);
    // Resumed later, the bench test does not ask for measured values again.
    write_file(&folder, "values", answers(&[("pump-period", "1 us")]));
    let (code, _, error) = run(&folder, "--answers values --nobody-connected --resume");
    assert_eq!(code, Some(0), "{error}");
    let full_sheet = sheet(&folder);
    assert_eq!(full_sheet["answers"].as_array().unwrap().len(), 24);
    assert_eq!(full_sheet["answers"][0]["measured"], 50.001);
}

/// Sends Ctrl-C while the bench test asks for a value.
#[test]
fn a_signal_keeps_what_was_measured() {
    let folder = test_folder("bench_signal");
    let texts = words("--nobody-connected");
    let arguments: Vec<_> = texts.iter().map(String::as_str).collect();
    let mut command = flexor_command(&folder, &arguments);
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut program = command.spawn().unwrap();
    let mut stdin = program.stdin.take().unwrap();
    stdin.write_all(b"\n50.001 us\n").unwrap();
    let path = folder.join("sheet.json");
    let is_kept = || std::fs::read_to_string(&path).is_ok_and(|text| text.contains("50.001"));
    for _ in 0..600 {
        if is_kept() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(100));
    }
    assert!(is_kept(), "nothing was kept within a minute");
    let id = program.id().to_string();
    let sent = std::process::Command::new("kill")
        .args(["-INT", &id])
        .status()
        .unwrap();
    assert!(sent.success());
    let (code, _, error) = crate::program::command_result(program.wait_with_output().unwrap());
    drop(stdin);
    assert_eq!(code, Some(130), "{error}");
    assert!(
        error.contains("E580") && error.contains("--resume"),
        "{error}"
    );
    assert_eq!(sheet(&folder)["answers"].as_array().unwrap().len(), 1);
}
