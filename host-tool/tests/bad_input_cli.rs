//! Tests of the `flexor` program with bad input: exit code, error number, a message with the
//! remedy, and a record of everything until then.

use crate::program::{
    Board, SESSION, command_result, flexor_command, run_flexor, test_folder, write_file,
};
use crate::record_again::with_wearer;
use hal_sim::wire::pty::PtyWire;
use host_core::link::{Connection, TcpPort};
use host_core::record;
use std::net::TcpListener;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Time after which a command counts as hanging.
const PATIENCE: Duration = Duration::from_secs(60);

/// Name of the case, arguments of `flexor`, exit code, and parts of the expected message.
type Row<'a> = (&'a str, &'a str, i32, &'a [&'a str]);
/// Checks the message on standard error, and the same message in one JSON object on standard
/// output.
fn check(folder: &Path, (name, line, code, says): Row) {
    let mut arguments: Vec<&str> = line.split_whitespace().collect();
    let (exit, _, error) = run_flexor(folder, &arguments);
    assert_eq!(exit, Some(code), "{name}: {error}");
    // A terminal may wrap the message.
    let is_word = |word: &&str| *word != "│";
    let words = |text: &str| {
        let words = text.split_whitespace().filter(is_word);
        words.collect::<Vec<_>>().join(" ")
    };
    let says_all = |message: &str| {
        for part in says {
            assert!(message.contains(part), "{name}: no `{part}` in {message}");
        }
    };
    says_all(&words(&error));
    assert!(!error.contains("panicked"), "{name}: {error}");
    arguments.push("--json");
    let (exit, json, _) = run_flexor(folder, &arguments);
    assert_eq!(exit, Some(code), "{name} --json");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    says_all(&words(json["error"].as_str().unwrap()));
}

#[test]
fn a_former_name_of_an_option_works_with_a_note() {
    let folder = test_folder("former_names");
    let line = "selftest --device chip --minutes 1";
    let (exit, _, error) = run_flexor(&folder, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(exit, Some(2), "{error}");
    let note = "note: `--minutes` is now `--seconds`; the old name still works";
    assert_eq!(error.lines().next(), Some(note));
    assert!(error.contains("E518 --seconds needs"), "{error}");
}

#[test]
#[rustfmt::skip]
fn wrong_arguments_exit_with_2() {
    let folder = test_folder("arguments");
    let seed = studies::tracking::search::TRAINING_SEED.to_string();
    let trained = format!("chart control --quick --seed {seed}");
    let rows: [Row; 26] = [
        ("no command", "", 2, &["Usage"]),
        ("unknown command", "runn session.toml", 2, &["run"]),
        ("unknown option", "run session.toml --devise native", 2, &["E518 unexpected", "--device"]),
        ("no session", "run", 2, &["SESSION"]),
        ("a word for a seed", "run session.toml --seed x", 2, &["--seed", "invalid digit"]),
        ("unknown law", "run session.toml --law pidd", 2, &["pid"]),
        ("serve on nothing", "serve", 2, &["--pty", "--tcp"]),
        ("seconds out of range", "edges session.toml --seconds 0 --csv x.csv", 2, &["E518 --seconds is 0; allowed: 0.001 to 3600"]),
        ("no number", "edges session.toml --seconds nan --csv x.csv", 2, &["E518", "NaN"]),
        ("tries of no search", "chart control --evaluations 20", 2, &["--search"]),
        ("a course of no search", "chart control --search --course smooth", 2, &["--course"]),
        ("a seed of a search", "chart control --search --seed 3", 2, &["--seed"]),
        ("a course of terms", "chart control --ablate --course smooth", 2, &["--course"]),
        ("an optimum of a quick look", "chart control --quick --optimum 9", 2, &["--optimum"]),
        ("a folder of no file", "chart control --quick --out x", 2, &["--out"]),
        ("a widened course", "chart control --wearers widened --course sine --out .", 2, &["E518 --course and --optimum need --wearers earlier"]),
        ("a hand's course", "chart control --wearers hands --course sine --out .", 2, &["E518 --course and --optimum need --wearers earlier"]),
        ("a wearer of others", "chart control --wearers widened --wearer P --out .", 2, &["--wearer"]),
        ("all wearers", "chart control --participant all --quick", 2, &["E518 --participant is all"]),
        ("a wearer's course", "chart control --wearer P --course sine --out .", 2, &["E518 --course and --optimum need --wearers earlier"]),
        ("trained on", &trained, 2, &["E518 --seed", &seed]),
        ("a place for no file", "chart ladder --no-files --workspace x", 2, &["--workspace"]),
        ("chance of a map without", "chart stability wall --seed 3 --out .", 2, &["E518 --seed", "pulse_rate"]),
        ("an image of none", "selftest --image x.elf", 2, &["E518 --image", "--device chip"]),
        ("a soak of none", "selftest --device chip --seconds 60", 2, &["E518 --seconds"]),
        ("a board's seed", "monitor --device tcp:127.0.0.1:1 --seed 3", 2, &["E518 --seed needs"]),
    ];
    rows.into_iter().for_each(|row| check(&folder, row));
    let (_, help, _) = run_flexor(&folder, &["chart", "control", "--help"]);
    assert!(help.contains(&seed), "{help}");
}

/// A wearer without a forearm, a missing file, a file with a mistake.
#[test]
fn a_chart_of_a_wearer_needs_a_forearm() {
    let folder = test_folder("chart-wearer");
    write_file(&folder, "none.toml", include_str!("../wearers/K01.toml"));
    let p = include_str!("../wearers/P.toml");
    write_file(&folder, "wrong.toml", p.replace("reach_m", "reach_cm"));
    for (name, line, says) in [
        (
            "no forearm",
            "chart control --quick --wearer none.toml",
            "E625 the wearer file none.toml cannot be used here: the file has no `[forearm]`",
        ),
        (
            "nobody",
            "chart control --quick --wearer harris-1",
            "E624 there is no wearer `harris-1`",
        ),
        (
            "no file",
            "chart control --quick --wearer absent.toml",
            "E650",
        ),
        (
            "a mistake",
            "chart control --quick --wearer wrong.toml",
            "E402",
        ),
    ] {
        check(&folder, (name, line, 1, &[says]));
    }
}

/// `--quick` writes nothing, so it needs no output folder.
#[test]
fn a_quick_look_needs_no_folder() {
    let line = ["chart", "control", "--quick", "--plants", "2"];
    let (exit, _, error) = run_flexor(&test_folder("quick"), &line);
    assert_eq!(exit, Some(0), "{error}");
}

/// `--law` refuses a wearer just as the file's own law would, before anything is recorded.
#[test]
fn a_law_that_was_never_tried_on_this_wearer_records_nothing() {
    let folder = test_folder("never_tried");
    let file = include_str!("../sessions/hamana_exp4_two_point_wearer.toml");
    let file = with_wearer(&folder, file);
    let weak = file.replace("law = \"recommended\"", "law = \"paper\"");
    let weak = weak.replace("stiffness_nm_per_rad = 0.12", "stiffness_nm_per_rad = 1.2");
    std::fs::write(folder.join("weak.toml"), weak).unwrap();
    for law in ["pid", "recommended"] {
        let line = format!("run weak.toml --law {law} --out out");
        let says = &["E466", "a stiffness of 0.030003 to", "law = \"paper\""];
        check(&folder, ("never tried", &line, 1, says));
        assert!(!folder.join("out").exists());
    }
}

#[test]
#[rustfmt::skip]
fn bad_files_and_absent_devices_exit_with_1() {
    let folder = test_folder("absent");
    let edits = [
        ("typo.toml", "rise_ms", "rise_sm"),
        ("range.toml", "width_us = 200", "width_us = 501"),
        ("syntax.toml", "limit = ", "limit = = "),
        ("charge.toml", "rise_ms = 10", "max_charge_uc = 1.0"),
    ];
    for (name, from, to) in edits {
        assert!(SESSION.contains(from));
        std::fs::write(folder.join(name), SESSION.replace(from, to)).unwrap();
    }
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let nobody = format!("run session.toml --device tcp:{free}");
    let rows: [Row; 12] = [
        ("typo", "run typo.toml", 1, &["E402", "typo.toml:6:1", "did you mean `rise_ms`?"]),
        ("out of range", "run range.toml", 1, &["E407", "range.toml:14:", "501", "10 to 500"]),
        ("no TOML", "run syntax.toml", 1, &["E401", "syntax.toml:13:"]),
        ("too much charge", "run charge.toml", 1, &["E451", "1 µC"]),
        ("no file", "run absent.toml", 1, &["E400", "absent.toml", "No such file"]),
        ("a folder", "run .", 1, &["E400"]),
        ("no serial port", "run session.toml --device /dev/nonexistent", 1, &["E504 cannot open /dev/nonexistent", "plug the board in"]),
        ("no terminal", "run session.toml --device session.toml", 1, &["E504 cannot open session.toml", "give the port of a board"]),
        ("nobody listens", &nobody, 1, &["E504 cannot open tcp:127.0.0.1", "flexor serve"]),
        ("no address", "run session.toml --device tcp:nowhere", 1, &["E504", "tcp:nowhere"]),
        ("no looking into a board", "edges session.toml --seconds 1 --csv x.csv --device /dev/nonexistent", 1, &["E504"]),
        ("no place to listen", "serve --tcp 256.0.0.1:1", 1, &["cannot listen at 256.0.0.1:1"]),
    ];
    rows.into_iter().for_each(|row| check(&folder, row));
    // Nothing was recorded, so nothing was overwritten.
    assert!(!folder.join("out").exists());
}

/// Common first mistakes: other names, units, decimal commas, encodings.
#[test]
#[rustfmt::skip]
fn first_mistakes_are_answered_with_what_was_meant() {
    let folder = test_folder("first_mistakes");
    let edits = [
        ("scale.toml", "width_us = 200", "width_us = 0.0002"),
        ("milli.toml", "width_us = 200", "width_us = 0.2"),
        ("comma.toml", "limit = 15.0", "limit = 8,5"),
        ("range.toml", "width_us = 200", "width_us = 501"),
        ("shape.toml", "\"biphasic-cathodic-first\"", "\"biphasic\""),
    ];
    for (name, from, to) in edits {
        assert!(SESSION.contains(from), "{from}");
        std::fs::write(folder.join(name), SESSION.replace(from, to)).unwrap();
    }
    let utf16 = SESSION.encode_utf16().flat_map(u16::to_le_bytes);
    std::fs::write(folder.join("utf16.toml"), [0xFF, 0xFE].into_iter().chain(utf16).collect::<Vec<_>>()).unwrap();
    let rows: [Row; 10] = [
        ("seconds", "run scale.toml", 1, &["E405", "did you mean 200 µs?"]),
        ("milliseconds", "run milli.toml", 1, &["E405", "did you mean 200 µs?"]),
        ("decimal comma", "run comma.toml", 1, &["E401", "decimal point, as in 8.5"]),
        ("unit", "run range.toml", 1, &["E407", "10 to 500 µs"]),
        ("both polarities", "run shape.toml", 1, &["E408", "`biphasic-cathodic-first` or", "`biphasic-anodic-first`?"]),
        ("UTF-16", "run utf16.toml", 1, &["E400", "save it as UTF-8"]),
        ("a device", "run session.toml --device nativ", 1, &["E504", "did you mean `native`"]),
        ("a command", "rnu session.toml", 2, &["E518", "Did you mean `flexor run`?"]),
        ("a shipped session", "run ten_chanels", 1, &["E400", "did you mean `ten_channels`?"]),
        ("one number", "new x.toml --limit 500", 2, &["E407 `channel.limit` is 500"]),
    ];
    rows.into_iter().for_each(|row| check(&folder, row));
}

#[test]
fn a_board_is_served_beyond_this_computer_on_purpose_only() {
    let folder = test_folder("open-to-network");
    let serve = "serve --tcp 0.0.0.0:0 --seconds 0.1";
    let says = &["E770 0.0.0.0:0", "127.0.0.1:0", "--open-to-network"];
    check(&folder, ("not on purpose", serve, 1, says));
    let on_purpose = format!("{serve} --open-to-network");
    let (exit, _, error) = run_flexor(&folder, &on_purpose.split(' ').collect::<Vec<_>>());
    assert_eq!(exit, Some(0), "{error}");
    let warning = "warning: anyone who can connect to 0.0.0.0:0 controls this board";
    assert!(error.contains(warning), "{error}");
}

#[test]
fn a_busy_serial_port_is_refused() {
    let folder = test_folder("busy");
    let _board = PtyWire::open(folder.join("port")).unwrap();
    let path = folder.join("port").display().to_string();
    let _monitor = serialport::new(path, 115_200).open().unwrap();
    let says = &["E504 cannot open port", "another program uses this port"];
    let run = "run session.toml --device port";
    check(&folder, ("busy", run, 1, says));
}

#[test]
fn a_port_where_nobody_answers_is_refused() {
    let folder = test_folder("silent");
    let _board = PtyWire::open(folder.join("port")).unwrap();
    let says = &["E501 the device did not answer Hello", "is this its port?"];
    let run = "run session.toml --device port";
    check(&folder, ("silent", run, 1, says));
    // The kind of device is unknown, so no message states one.
    let arguments = [
        "experiment",
        "open-trains",
        "--draws",
        "0",
        "--device",
        "port",
    ];
    let (exit, _, error) = run_flexor(&folder, &[&arguments[..], &["--out", "silent"]].concat());
    assert_eq!(exit, Some(1), "{error}");
    for file in ["run.json", "summary.json", "result.json"] {
        let text = std::fs::read(folder.join("silent").join(file)).unwrap();
        let report: serde_json::Value = serde_json::from_slice(&text).unwrap();
        assert!(report["simulated"].is_null(), "{file}");
    }
}

#[test]
fn a_second_client_is_refused_and_the_first_goes_on() {
    let folder = test_folder("second");
    let board = Board::tcp(&folder);
    let address = board.at.strip_prefix("tcp:").unwrap();
    let (mut first, _) = Connection::open(TcpPort::connect(address).unwrap()).unwrap();
    let line = format!("run session.toml --device {}", board.at);
    let says = [
        "E112",
        "another host has the session open",
        "close the other program",
    ];
    check(&folder, ("second", &line, 1, &says));
    first.keep_alive().unwrap();
}

/// Runs the session on a board, and ends the board once there is data.
fn unplug(folder: &Path, board: Board) {
    let run = [
        "--json",
        "run",
        "session.toml",
        "--out",
        "out",
        "--device",
        &board.at,
    ];
    let mut run = flexor_command(folder, &run);
    let run = run.stdout(Stdio::piped()).stderr(Stdio::piped());
    let run = run.spawn().unwrap();
    let samples = folder.join("out/01-one-channel/samples.csv");
    let start = Instant::now();
    while std::fs::metadata(&samples).map_or(0, |file| file.len()) < 1000 {
        assert!(start.elapsed() < PATIENCE, "no data");
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(board);
    let (exit, json, error) = command_result(run.wait_with_output().unwrap());
    assert!(start.elapsed() < PATIENCE);
    assert_eq!(exit, Some(1), "{error}");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    for message in [json["error"].as_str().unwrap(), &error] {
        assert!(message.contains("E502 lost the device"), "{message}");
        assert!(message.contains("reconnect and run again"), "{message}");
    }
    assert!(json["report"].as_str().is_some());
    is_kept(&folder.join("out"));
}

/// Checks that the record can be read, has every sample in order and without a gap, and states when
/// and why it ends.
fn is_kept(out: &Path) {
    let run = record::load(out).unwrap();
    let trial = &run.trials[0];
    assert!(trial.samples.len() > 20, "{} samples", trial.samples.len());
    for pair in trial.samples.to_vec().windows(2) {
        let step_s = pair[1].t_s - pair[0].t_s;
        assert!(
            (step_s - 0.01).abs() < 1e-9,
            "{step_s} s at {}",
            pair[0].t_s
        );
    }
    let last = trial.samples.last().unwrap();
    assert!((trial.duration_s - last.t_s).abs() < 1e-6);
    assert!(last.t_s < 30.0);
    assert!(last.amplitudes == [Some(5.0)], "{last:?}");
    let (_, why) = trial.events.last().unwrap();
    assert!(why.contains("lost the device"), "{why}");
}

#[test]
fn a_board_unplugged_from_a_socket_leaves_the_record() {
    let folder = test_folder("unplugged_tcp");
    let board = Board::tcp(&folder);
    unplug(&folder, board);
}

#[test]
fn a_board_unplugged_from_a_serial_port_leaves_the_record() {
    let folder = test_folder("unplugged_pty");
    let board = Board::serve(&folder, &["--pty", "port"]);
    unplug(&folder, board);
}

#[test]
fn a_protocol_that_asks_somebody_is_not_begun_on_a_board_where_nobody_answers() {
    let folder = test_folder("nobody");
    let board = Board::serve(&folder, &["--tcp", "127.0.0.1:0"]);
    let arguments = [
        "experiment",
        "harris-wall",
        "--device",
        &board.at,
        "--out",
        "x",
    ];
    let mut program = flexor_command(&folder, &arguments);
    let (exit, _, error) = command_result(program.stdin(Stdio::null()).output().unwrap());
    assert_eq!(exit, Some(1), "{error}");
    assert!(error.contains("E615 the protocol's prompts on"), "{error}");
    assert!(!folder.join("x").exists());
}
