//! Tests of irregular files: wherever a file is read, they are refused with a number, without
//! waiting or filling the memory. The contents of an unrelated file are never shown.

use super::program::{
    ProgramOutput, command_result, flexor_command, run_flexor, test_folder, write_file,
};
use super::record_again::{run_json, shortened_session, with_wearer};
use std::fs;
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Time after which a command counts as hanging.
const PATIENCE: Duration = Duration::from_secs(30);

/// Runs `flexor`, and kills it if it hangs.
fn run_or_kill(folder: &Path, line: &str) -> ProgramOutput {
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let mut command = flexor_command(folder, &arguments);
    command.stdin(Stdio::null());
    let mut process = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while process.try_wait().unwrap().is_none() {
        if begun.elapsed() > PATIENCE {
            process.kill().unwrap();
            process.wait().unwrap();
            panic!("{line}: it hangs");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    command_result(process.wait_with_output().unwrap())
}

/// Kinds of irregular files, as the messages name them.
const KINDS: [&str; 4] = ["a pipe", "a socket", "a device", "a folder"];

/// Puts an irregular file at `path`, in place of the existing file.
fn replace_with(kind: &str, path: &Path) {
    remove(path);
    match kind {
        "a pipe" => {
            let made = Command::new("mkfifo").arg(path).status().unwrap();
            assert!(made.success());
        }
        "a socket" => drop(UnixListener::bind(path).unwrap()),
        "a device" => symlink("/dev/zero", path).unwrap(),
        _ => fs::create_dir(path).unwrap(),
    }
}

fn remove(path: &Path) {
    let _ = fs::remove_file(path);
    let _ = fs::remove_dir(path);
}

/// Checks that each command is refused with its number and the kind of file.
fn assert_refused(folder: &Path, file: &str, lines: &[(&str, &str)]) {
    let path = folder.join(file);
    let before = fs::read(&path).ok();
    for kind in KINDS {
        replace_with(kind, &path);
        for (line, number) in lines {
            let (exit, _, error) = run_or_kill(folder, line);
            assert_eq!(exit, Some(1), "{file} is {kind}: {line}: {error}");
            let message = error.split_whitespace().collect::<Vec<_>>().join(" ");
            let reason = format!("{kind}, not a regular file");
            // A terminal may wrap a long path.
            let plain = message.replace("│ ", "");
            assert!(
                plain.contains(number) && plain.contains(&reason),
                "{file}: {line}: {error}"
            );
        }
    }
    remove(&path);
    if let Some(before) = before {
        fs::write(path, before).unwrap();
    }
}

#[test]
fn a_record_of_odd_files_is_refused() {
    let folder = test_folder("odd_record");
    let file = shortened_session(&folder, "hamana_exp4_two_point_wearer.toml", 0.1);
    run_json(&folder, &format!("run {file} --out one"));
    run_json(&folder, &format!("run {file} --seed 2 --out two"));
    let trial = fs::read_dir(folder.join("one")).unwrap().flatten();
    let trial = trial.map(|entry| entry.file_name().into_string().unwrap());
    let trial = trial
        .into_iter()
        .find(|trial| trial.starts_with("01-"))
        .unwrap();
    let lines = [
        ("report one", "E583"),
        ("rerun one --out again", "E583"),
        ("compare one two --out both", "E583"),
    ];
    let of_trial = [
        "trial.json",
        "samples.csv",
        "edges.csv",
        "session.toml",
        "wearer.toml",
    ];
    let of_trial = of_trial.map(|of_trial| format!("one/{trial}/{of_trial}"));
    let files = ["one/run.json".to_owned(), "one/summary.json".to_owned()];
    for file in files.iter().chain(&of_trial) {
        assert_refused(&folder, file, &lines);
    }
    assert_refused(&folder, "one/.lock", &[("report one", "E583")]);
    run_json(&folder, "report one");
    assert!(!folder.join("again").exists() && !folder.join("both").exists());
}

#[test]
fn an_experiment_or_a_sweep_of_odd_files_is_refused() {
    let folder = test_folder("odd_experiment");
    shortened_session(&folder, "hamana_exp4_two_point.toml", 0.1);
    let declaration = "name = \"own\"\ntitle = \"Own\"\nsource = \"nobody\"\n\
        session = \"hamana_exp4_two_point.toml\"\nseed = 3\ndraws = 2\n\
        measures = [\"charge_mc\"]\n[[factor]]\nname = \"law\"\n\
        [[factor.level]]\nname = \"one\"\n[[factor.level]]\nname = \"two\"\n\
        set = { \"joint.law\" = \"paper\" }\n[[draw]]\nfield = \"setpoints.frequency_hz\"\n\
        low = 0.1\nhigh = 0.3\nsource = \"assumed\"\n";
    write_file(&folder, "own.toml", declaration);
    run_json(&folder, "experiment own.toml --draws 0 --out one");
    assert_refused(&folder, "one/result.json", &[("report one", "E607")]);
    let rerun = [("rerun one --out again", "E613")];
    assert_refused(&folder, "one/declaration.toml", &rerun);
    assert_refused(
        &folder,
        "own.toml",
        &[("experiment own.toml --draws 0 --out x", "E600")],
    );
    let session = [("experiment own.toml --draws 0 --out x", "E600")];
    assert_refused(&folder, "hamana_exp4_two_point.toml", &session);
    run_json(&folder, "sweep own.toml --shard 1/2 --out a");
    run_json(&folder, "sweep own.toml --shard 2/2 --out b");
    let lines = [
        ("sweep own.toml --merge a b --out whole", "E607"),
        ("sweep own.toml --shard 1/2 --out a", "E607"),
    ];
    assert_refused(&folder, "a/sweep.json", &lines);
    assert_refused(&folder, "a/draws.csv", &lines);
    run_json(&folder, "sweep own.toml --merge a b --out whole");
}

#[test]
fn a_journal_that_is_no_file_is_refused() {
    let folder = test_folder("odd_journal");
    let faults = "faults --class declarations --device native --seed 1000";
    run_json(&folder, &format!("{faults} --draws 2 --out kept"));
    let line = format!("{faults} --draws 4 --out kept");
    assert_refused(&folder, "kept/units.jsonl", &[(&line, "E607")]);
    let calibrate = "calibrate --pseudonym somebody --channels 1 --auto --out w.toml";
    let resume = format!("{calibrate} --resume");
    let lines = [(calibrate, "E6"), (resume.as_str(), "E6")];
    assert_refused(&folder, "w.toml.journal", &lines);
}

#[test]
fn what_a_command_is_given_is_a_file() {
    let folder = test_folder("odd_arguments");
    let text = shortened_session(&folder, "hamana_exp4_two_point_wearer.toml", 0.1);
    let session = fs::read_to_string(folder.join(text)).unwrap();
    let muscle = "muscle --a-n-per-s 121.9 --k 0.3 --tau-c-ms 20.8 --tau1-ms 33.1 --tau2-ms 194.4 \
                  --seconds 1 --pulses-us odd --csv x.csv";
    let lines = [
        ("run odd", "E400"),
        ("check odd", "E400"),
        ("edges odd --seconds 0.1 --csv x.csv", "E400"),
        ("explain-model odd", "E400"),
        ("calibrate --electrodes odd --auto --out w.toml", "E400"),
        ("calibrate --check odd --auto", "E650"),
        ("new x.toml --wearer odd", "E650"),
        (muscle, "E583"),
        ("run session.toml --device chip --image odd --out x", "E530"),
    ];
    assert_refused(&folder, "odd", &lines);
    let declared = [
        ("experiment odd.toml --draws 0 --out x", "E600"),
        ("sweep odd.toml --out x", "E600"),
        ("chart control --quick --wearer odd.toml", "E650"),
        (
            "experiment harris-wall --wearer odd.toml --draws 0 --out x",
            "E650",
        ),
        (
            "experiment hamana-1 --wearer odd.toml --draws 1 --out x",
            "E650",
        ),
    ];
    assert_refused(&folder, "odd.toml", &declared);
    // The wearer file that a session refers to.
    let (before, after) = session.split_once("file = \"").unwrap();
    let (_, after) = after.split_once('"').unwrap();
    write_file(
        &folder,
        "worn.toml",
        format!("{before}file = \"odd.toml\"{after}"),
    );
    let worn = [
        ("check worn.toml", "E650"),
        ("run worn.toml --out x", "E650"),
    ];
    assert_refused(&folder, "odd.toml", &worn);
    assert!(!folder.join("x").exists());
}

/// A line of an unrelated file.
const SECRET: &str = "root:x:0:0:hunter2:/root:/bin/sh";

#[test]
fn nothing_of_an_unrelated_file_is_shown() {
    let folder = test_folder("unrelated");
    let session = include_str!("../sessions/hamana_exp4_two_point_wearer.toml");
    let session = with_wearer(&folder, session);
    let (before, after) = session.split_once("file = \"").unwrap();
    let (_, after) = after.split_once('"').unwrap();
    write_file(
        &folder,
        "worn.toml",
        format!("{before}file = \"other.toml\"{after}"),
    );
    let declaration = "name = \"own\"\ntitle = \"Own\"\nsource = \"nobody\"\n\
        session = \"other.toml\"\nseed = 3\ndraws = 2\nmeasures = [\"charge_mc\"]\n";
    write_file(&folder, "own.toml", declaration);
    let others = [
        format!("{SECRET}\n"),
        format!("# {SECRET}\nhunter2 = \"hunter2\"\n[hunter2]\ntitle = \"hunter2\"\n"),
        format!("title = \"hunter2\"\npassword = \"{SECRET}\"\n"),
    ];
    for other in others {
        write_file(&folder, "other.toml", &other);
        for (line, number) in [
            ("check worn.toml", "E665"),
            ("--json check worn.toml", "E665"),
            ("run worn.toml --out x", "E665"),
            ("edges worn.toml --seconds 0.1 --csv x.csv", "E665"),
            ("new x.toml --wearer other.toml", "E665"),
            ("calibrate --check other.toml --auto", "E665"),
            (
                "experiment harris-wall --wearer other.toml --draws 0 --out x",
                "E665",
            ),
            ("experiment own.toml --draws 0 --out x", "E600"),
            ("sweep own.toml --out x", "E600"),
        ] {
            let arguments: Vec<&str> = line.split(' ').collect();
            let (exit, out, error) = run_flexor(&folder, &arguments);
            assert_eq!(exit, Some(1), "{line}: {error}");
            let text = format!("{out}{error}");
            assert!(
                text.contains(number) && text.contains("other"),
                "{line}: {text}"
            );
            for secret in ["hunter2", "root:", "password"] {
                assert!(!text.contains(secret), "{line}: {text}");
            }
        }
    }
    // A file that is meant as a wearer file is shown with its mistakes.
    write_file(&folder, "other.toml", "schema = 1\nnmae = \"P\"\n");
    let (_, _, error) = run_flexor(&folder, &["check", "worn.toml"]);
    assert!(error.contains("E402") && error.contains("nmae"), "{error}");
}
