//! What bad input gets from the `flexor` program: an exit code, a number, a
//! sentence that says what to do, and the record up to that moment.

use crate::flexor::{Board, ONE_CHANNEL, flexor, run, said, with_session};
use hal_sim::wire::pty::PtyWire;
use host_core::link::{Client, TcpPort};
use host_core::record;
use std::net::TcpListener;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Nothing here takes so long unless it hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// A command line, its exit code, and what all is in the message.
type Row<'a> = (&'a str, i32, &'a [&'a str]);

/// People read it on standard error; machines get one JSON object with the
/// same message on standard output, if the command got as far as running.
fn check(folder: &Path, (line, code, says): Row) {
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let (exit, _, error) = run(folder, &arguments);
    assert_eq!(exit, Some(code), "{line}: {error}");
    // The words may be broken over lines of a terminal.
    let words = error.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in says {
        assert!(words.contains(part), "{line}: no `{part}` in {error}");
    }
    assert!(!error.contains("panicked"), "{line}: {error}");
    let (exit, json, _) = run(folder, &[&arguments[..], &["--json"]].concat());
    assert_eq!(exit, Some(code), "{line} --json");
    if error.contains("Usage:") || error.contains("--help") {
        return; // clap never heard of --json
    }
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let message = json["error"].as_str().unwrap();
    for part in says {
        assert!(message.contains(part), "{line}: no `{part}` in {message}");
    }
}

#[rustfmt::skip]
const WRONG_ARGUMENTS: [Row; 9] = [
    ("", 2, &["Usage"]),
    ("runn session.toml", 2, &["run"]),
    ("run session.toml --devise native", 2, &["--device"]),
    ("run", 2, &["SESSION"]),
    ("run session.toml --seed x", 2, &["--seed", "invalid digit"]),
    ("run session.toml --law pidd", 2, &["pid"]),
    ("serve", 2, &["--pty", "--tcp"]),
    ("edges session.toml --seconds 0 --csv x.csv", 2, &["E518 --seconds is 0: allowed is 0.001 to 3600"]),
    ("edges session.toml --seconds nan --csv x.csv", 2, &["E518", "NaN"]),
];

#[test]
fn wrong_arguments_exit_with_2() {
    let folder = with_session("arguments");
    for row in WRONG_ARGUMENTS {
        check(&folder, row);
    }
}

#[rustfmt::skip]
const BAD_FILES_AND_ABSENT_DEVICES: [Row; 11] = [
    ("run typo.toml", 1, &["E402", "typo.toml:6:1", "did you mean `rise_ms`?"]),
    ("run range.toml", 1, &["E407", "range.toml:14:", "501", "10 to 500"]),
    ("run syntax.toml", 1, &["E401", "syntax.toml:13:"]),
    ("run charge.toml", 1, &["E451", "1 µC"]),
    ("run absent.toml", 1, &["E400", "absent.toml", "No such file"]),
    ("run .", 1, &["E400"]),
    ("run session.toml --device /dev/nonexistent", 1, &["E504 cannot open /dev/nonexistent", "plug the board in"]),
    ("run session.toml --device session.toml", 1, &["E504 cannot open session.toml", "give the port of a board"]),
    ("run session.toml --device tcp:nowhere", 1, &["E504", "tcp:nowhere"]),
    ("edges session.toml --seconds 1 --csv x.csv --device /dev/nonexistent", 1, &["E504"]),
    ("serve --tcp 256.0.0.1:1", 1, &["cannot listen at 256.0.0.1:1"]),
];

#[test]
fn bad_files_and_absent_devices_exit_with_1() {
    let folder = with_session("absent");
    for (name, from, to) in [
        ("typo.toml", "rise_ms", "rise_sm"),
        ("range.toml", "width_us = 200", "width_us = 501"),
        ("syntax.toml", "limit = ", "limit = = "),
        ("charge.toml", "rise_ms = 10", "max_charge_uc = 1.0"),
    ] {
        assert!(ONE_CHANNEL.contains(from));
        std::fs::write(folder.join(name), ONE_CHANNEL.replace(from, to)).unwrap();
    }
    for row in BAD_FILES_AND_ABSENT_DEVICES {
        check(&folder, row);
    }
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let nobody = format!("run session.toml --device tcp:{free}");
    check(
        &folder,
        (
            &nobody,
            1,
            &["E504 cannot open tcp:127.0.0.1", "flexor serve"],
        ),
    );
    // Nothing was recorded, so nothing was overwritten.
    assert!(!folder.join("out").exists());
}

#[test]
fn a_busy_serial_port_is_refused() {
    let folder = with_session("busy");
    let _board = PtyWire::open(folder.join("port")).unwrap();
    let path = folder.join("port").display().to_string();
    let _monitor = serialport::new(path, 115_200).open().unwrap();
    let says = &["E504 cannot open port", "another program uses it"];
    check(&folder, ("run session.toml --device port", 1, says));
}

#[test]
fn a_port_where_nobody_answers_is_refused() {
    let folder = with_session("silent");
    let _board = PtyWire::open(folder.join("port")).unwrap();
    let says = &["E501 no answer to Hello", "is this its port?"];
    check(&folder, ("run session.toml --device port", 1, says));
}

#[test]
fn a_second_client_is_refused_and_the_first_goes_on() {
    let folder = with_session("second");
    let board = Board::tcp(&folder);
    let address = board.at.strip_prefix("tcp:").unwrap();
    let (mut first, _) = Client::open(TcpPort::connect(address).unwrap()).unwrap();
    let line = format!("run session.toml --device {}", board.at);
    let says = &[
        "E112",
        "another host holds the session",
        "close the other program",
    ];
    check(&folder, (&line, 1, says));
    first.keep_alive().unwrap();
}

/// Runs the session on a board, and takes the board away once there is data.
fn unplug(folder: &Path, board: Board) {
    let run = flexor(
        folder,
        &["--json", "run", "session.toml", "--out", "out", "--device"],
    )
    .arg(&board.at)
    .stdout(Stdio::piped())
    .stderr(Stdio::piped())
    .spawn()
    .unwrap();
    let samples = folder.join("out/01-one-channel/samples.csv");
    let start = Instant::now();
    while std::fs::metadata(&samples).map_or(0, |file| file.len()) < 1000 {
        assert!(start.elapsed() < PATIENCE, "no data");
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(board);
    let (exit, json, error) = said(&run.wait_with_output().unwrap());
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

/// The record can be read, has every sample in order and without a gap, and
/// says where and why it ends.
fn is_kept(out: &Path) {
    let run = record::load(out).unwrap();
    let trial = &run.trials[0];
    assert!(trial.samples.len() > 20, "{} samples", trial.samples.len());
    for pair in trial.samples.windows(2) {
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
    let folder = with_session("unplugged_tcp");
    let board = Board::tcp(&folder);
    unplug(&folder, board);
}

#[test]
fn a_board_unplugged_from_a_serial_port_leaves_the_record() {
    let folder = with_session("unplugged_pty");
    let board = Board::serve(&folder, &["--pty", "port"]);
    unplug(&folder, board);
}
