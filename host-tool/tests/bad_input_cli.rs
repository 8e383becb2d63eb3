//! What bad input gets from the `flexor` program: an exit code, a number, a
//! sentence that says what to do, and the record up to that moment.

use hal_sim::wire::pty::PtyWire;
use host_core::link::{Client, TcpPort};
use host_core::record;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const FLEXOR: &str = env!("CARGO_BIN_EXE_flexor");

/// Nothing here takes so long unless it hangs.
const PATIENCE: Duration = Duration::from_secs(60);

const SESSION: &str = r#"
title = "One channel"
duration_s = 30.0

[wearer]
rise_ms = 10
host_timeout_ms = 1000

[[channel]]
number = 1
name = "one"
stage = { kind = "current", full_scale_ma = 100.0 }
limit = 15.0
train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 50.0 }

[setpoints]
kind = "amplitudes"
values = [{ channel = 1, value = 5.0 }]
rate_hz = 50
"#;

/// An empty folder of this test's own, with the session in it.
pub(crate) fn folder(test: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("bad_input")
        .join(test);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("session.toml"), SESSION).unwrap();
    folder
}

pub(crate) fn flexor(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(FLEXOR);
    command
        .current_dir(folder)
        .args(arguments)
        .env("NO_COLOR", "1");
    command
}

/// Exit code, standard output, standard error.
pub(crate) fn said(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (
        output.status.code(),
        text(&output.stdout),
        text(&output.stderr),
    )
}

/// A simulated board in a process of its own, killed when dropped.
pub(crate) struct Board {
    process: Child,
    /// As `--device` names it.
    pub(crate) at: String,
}

impl Board {
    pub(crate) fn serve(folder: &Path, wire: &[&str]) -> Self {
        let mut command = flexor(folder, &["--json", "serve", "--seconds", "60"]);
        let mut process = command.args(wire).stdout(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        let stdout = process.stdout.take().unwrap();
        BufReader::new(stdout).read_line(&mut line).unwrap();
        let hello: serde_json::Value = serde_json::from_str(&line).unwrap();
        let at = hello["at"].as_str().unwrap().to_owned();
        Self { process, at }
    }

    pub(crate) fn tcp(folder: &Path) -> Self {
        Self::serve(folder, &["--tcp", "127.0.0.1:0"])
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

struct Row {
    name: &'static str,
    arguments: Vec<String>,
    exit: i32,
    /// All in the message.
    says: &'static [&'static str],
}

fn row(name: &'static str, line: &str, exit: i32, says: &'static [&'static str]) -> Row {
    let arguments = line.split_whitespace().map(str::to_owned).collect();
    Row {
        name,
        arguments,
        exit,
        says,
    }
}

/// People read it on standard error; machines get one JSON object with the
/// same message on standard output, if the command got as far as running.
fn check(folder: &Path, row: &Row) {
    let arguments: Vec<&str> = row.arguments.iter().map(String::as_str).collect();
    let (exit, _, error) = said(&flexor(folder, &arguments).output().unwrap());
    assert_eq!(exit, Some(row.exit), "{}: {error}", row.name);
    // The words may be broken over lines of a terminal.
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in row.says {
        assert!(
            words(&error).contains(part),
            "{}: no `{part}` in {error}",
            row.name
        );
    }
    assert!(!error.contains("panicked"), "{}: {error}", row.name);
    let (exit, json, _) = said(&flexor(folder, &arguments).arg("--json").output().unwrap());
    assert_eq!(exit, Some(row.exit), "{} --json", row.name);
    if error.contains("Usage:") || error.contains("--help") {
        return; // clap never heard of --json
    }
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let message = json["error"].as_str().unwrap();
    for part in row.says {
        assert!(
            message.contains(part),
            "{}: no `{part}` in {message}",
            row.name
        );
    }
}

#[test]
fn wrong_arguments_exit_with_2() {
    let folder = folder("arguments");
    let rows = [
        row("no command", "", 2, &["Usage"]),
        row("unknown command", "runn session.toml", 2, &["run"]),
        row(
            "unknown option",
            "run session.toml --devise native",
            2,
            &["--device"],
        ),
        row("no session", "run", 2, &["SESSION"]),
        row(
            "a word for a seed",
            "run session.toml --seed x",
            2,
            &["--seed", "invalid digit"],
        ),
        row("unknown law", "run session.toml --law pidd", 2, &["pid"]),
        row("serve on nothing", "serve", 2, &["--pty", "--tcp"]),
        row(
            "seconds out of range",
            "edges session.toml --seconds 0 --csv x.csv",
            2,
            &["E518 --seconds is 0: allowed is 0.001 to 3600"],
        ),
        row(
            "no number",
            "edges session.toml --seconds nan --csv x.csv",
            2,
            &["E518", "NaN"],
        ),
    ];
    for row in &rows {
        check(&folder, row);
    }
}

#[test]
fn bad_files_and_absent_devices_exit_with_1() {
    let folder = folder("absent");
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
    let free = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let nobody = format!("run session.toml --device tcp:{free}");
    let rows = [
        row(
            "typo",
            "run typo.toml",
            1,
            &["E402", "typo.toml:6:1", "did you mean `rise_ms`?"],
        ),
        row(
            "out of range",
            "run range.toml",
            1,
            &["E407", "range.toml:14:", "501", "10 to 500"],
        ),
        row(
            "no TOML",
            "run syntax.toml",
            1,
            &["E401", "syntax.toml:13:"],
        ),
        row("too much charge", "run charge.toml", 1, &["E451", "1 µC"]),
        row(
            "no file",
            "run absent.toml",
            1,
            &["E400", "absent.toml", "No such file"],
        ),
        row("a folder", "run .", 1, &["E400"]),
        row(
            "no serial port",
            "run session.toml --device /dev/nonexistent",
            1,
            &["E504 cannot open /dev/nonexistent", "plug the board in"],
        ),
        row(
            "no terminal",
            "run session.toml --device session.toml",
            1,
            &["E504 cannot open session.toml", "give the port of a board"],
        ),
        row(
            "nobody listens",
            &nobody,
            1,
            &["E504 cannot open tcp:127.0.0.1", "flexor serve"],
        ),
        row(
            "no address",
            "run session.toml --device tcp:nowhere",
            1,
            &["E504", "tcp:nowhere"],
        ),
        row(
            "no looking into a board",
            "edges session.toml --seconds 1 --csv x.csv --device /dev/nonexistent",
            1,
            &["E504"],
        ),
        row(
            "no place to listen",
            "serve --tcp 256.0.0.1:1",
            1,
            &["cannot listen at 256.0.0.1:1"],
        ),
    ];
    for row in &rows {
        check(&folder, row);
    }
    // Nothing was recorded, so nothing was overwritten.
    assert!(!folder.join("out").exists());
}

#[test]
fn a_busy_serial_port_is_refused() {
    let folder = folder("busy");
    let _board = PtyWire::open(folder.join("port")).unwrap();
    let path = folder.join("port").display().to_string();
    let _monitor = serialport::new(path, 115_200).open().unwrap();
    let says = &["E504 cannot open port", "another program uses it"];
    check(
        &folder,
        &row("busy", "run session.toml --device port", 1, says),
    );
}

#[test]
fn a_port_where_nobody_answers_is_refused() {
    let folder = folder("silent");
    let _board = PtyWire::open(folder.join("port")).unwrap();
    let says = &["E501 no answer to Hello", "is this its port?"];
    check(
        &folder,
        &row("silent", "run session.toml --device port", 1, says),
    );
}

#[test]
fn a_second_client_is_refused_and_the_first_goes_on() {
    let folder = folder("second");
    let board = Board::tcp(&folder);
    let address = board.at.strip_prefix("tcp:").unwrap();
    let (mut first, _) = Client::open(TcpPort::connect(address).unwrap()).unwrap();
    let line = format!("run session.toml --device {}", board.at);
    let says = &[
        "E112",
        "another host holds the session",
        "close the other program",
    ];
    check(&folder, &row("second", &line, 1, says));
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
    let folder = folder("unplugged_tcp");
    let board = Board::tcp(&folder);
    unplug(&folder, board);
}

#[test]
fn a_board_unplugged_from_a_serial_port_leaves_the_record() {
    let folder = folder("unplugged_pty");
    let board = Board::serve(&folder, &["--pty", "port"]);
    unplug(&folder, board);
}
