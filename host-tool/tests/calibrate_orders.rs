//! Tests of orders to `flexor calibrate` that come all at once, too early, or from a program that
//! reads no output.

use crate::calibrate_lines;
use crate::program::{ProgramOutput, command_result, run_flexor, test_folder, write_file};
use nix::fcntl::{FcntlArg, fcntl};
use serde_json::Value;
use std::io::{BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command};

/// Levels are presented long enough for a slow computer to give an order meanwhile.
pub const PLAN: &str = "wearer = \"W01\"
on_s = 10.0
[limits]
max_current_ma = 30.0
[[electrode]]
channel = 3
place = \"wrist extensors\"
ceiling = 24.0
";

/// The program in a folder, driven by JSON lines.
struct ScriptedProgram {
    folder: PathBuf,
    process: Child,
    orders: ChildStdin,
    lines: Option<BufReader<ChildStdout>>,
}

/// Returns the entries of this kind in the journal.
pub fn entries(folder: &Path, kind: &str) -> Vec<Value> {
    let journal = std::fs::read_to_string(folder.join("w.toml.journal")).unwrap_or_default();
    let lines = journal
        .lines()
        .filter_map(|line| serde_json::from_str(line).ok());
    lines
        .filter(|line: &Value| line["entry"].get(kind).is_some())
        .collect()
}

impl ScriptedProgram {
    fn start(test: &str, plan: &str) -> Self {
        let folder = test_folder(test);
        write_file(&folder, "plan.toml", plan);
        let mut process = calibrate_lines::start_calibration(&folder, &[]);
        let orders = process.stdin.take().unwrap();
        let lines = process.stdout.take().map(BufReader::new);
        Self {
            folder,
            process,
            orders,
            lines,
        }
    }

    fn send(&mut self, text: &str) {
        self.orders.write_all(text.as_bytes()).unwrap();
    }

    fn next_line(&mut self, is: impl Fn(&Value) -> bool) -> Value {
        calibrate_lines::next_line(self.lines.as_mut().unwrap(), is)
    }

    fn wait_for_phase(&mut self, phase: &str) -> Value {
        self.next_line(|value| value["phase"] == phase)
    }

    fn wait_until_ready(&mut self) -> Value {
        self.next_line(|value| value["phase"] == "ready" && value["question"].is_null())
    }

    fn given_count(&self) -> usize {
        entries(&self.folder, "given").len()
    }

    /// Waits until the program ends by itself while its input is open.
    fn wait_for_end(mut self) -> ProgramOutput {
        let mut rest = String::new();
        if let Some(lines) = &mut self.lines {
            lines.read_to_string(&mut rest).unwrap();
        }
        self.process.stdout = None;
        let mut error = String::new();
        let mut stderr = self.process.stderr.take().unwrap();
        stderr.read_to_string(&mut error).unwrap();
        (self.process.wait().unwrap().code(), rest, error)
    }

    /// Shrinks the pipe that nobody reads to one page.
    fn shrink_pipe(&self) {
        let pipe = self.lines.as_ref().unwrap().get_ref();
        fcntl(pipe, FcntlArg::F_SETPIPE_SZ(4096)).unwrap();
    }
}

const RAISE: &str = "{\"order\":\"raise\"}\n";
const NO: &str = "{\"order\":\"no\"}\n";
const ABORT: &str = "{\"order\":\"abort\"}\n";

#[test]
fn a_block_of_orders_is_one_order() {
    let mut driven = ScriptedProgram::start("calibrate_block", &PLAN.replace("10.0", "1.0"));
    driven.wait_until_ready();
    driven.send(&format!("{RAISE}{NO}").repeat(2000));
    driven.wait_for_phase("on");
    driven.next_line(|value| value["question"].is_string());
    // In a block of orders, too, no order refers to a later question.
    driven.send(&format!("{NO}{RAISE}{RAISE}"));
    driven.wait_until_ready();
    assert_eq!(driven.given_count(), 1);
    driven.send(RAISE);
    let view = driven.wait_for_phase("on");
    assert_eq!(view["given"], 4.0);
    driven.send(ABORT);
    let folder = driven.folder.clone();
    let (exit, _, error) = driven.wait_for_end();
    assert!(exit == Some(1) && error.contains("E683"), "{error}");
    let levels: Vec<Value> = entries(&folder, "given");
    let levels: Vec<&Value> = levels
        .iter()
        .map(|value| &value["entry"]["given"]["level"])
        .collect();
    assert_eq!(levels.len(), 2, "{levels:?}");
}

#[test]
fn what_was_refused_is_told_by_number() {
    let mut driven = ScriptedProgram::start("calibrate_refused", PLAN);
    driven.wait_until_ready();
    driven.send(&RAISE.repeat(40));
    let refusal = driven.next_line(|value| value["event"] == "refused");
    let message = refusal["error"].as_str().unwrap().to_owned();
    assert!(
        message.starts_with("E671 not now: this order came before"),
        "{message}"
    );
    driven.send(ABORT);
    let (exit, _, _) = driven.wait_for_end();
    assert_eq!(exit, Some(1));
}

/// 3000 orders carried out one by one in turns of 5 ms would last longer than the presentation.
#[test]
fn too_much_and_the_end_overtake_what_is_pending() {
    let mut driven = ScriptedProgram::start("calibrate_overtakes", PLAN);
    driven.wait_until_ready();
    driven.send(RAISE);
    driven.wait_for_phase("on");
    driven.send(&format!(
        "{}{{\"order\":\"too-much\"}}\n",
        RAISE.repeat(3000)
    ));
    let record = driven.next_line(|value| value["entry"].get("too-much").is_some());
    let given = entries(&driven.folder, "given");
    let on_s = record["t_s"].as_f64().unwrap() - given[0]["t_s"].as_f64().unwrap();
    assert!(on_s < 10.0, "{on_s}");
    driven.wait_until_ready();
    driven.send(&format!("{}{ABORT}", RAISE.repeat(3000)));
    let folder = driven.folder.clone();
    let (exit, _, error) = driven.wait_for_end();
    assert!(exit == Some(1) && error.contains("E683"), "{error}");
    assert!(entries(&folder, "given").len() <= 2);
}

#[test]
fn an_endless_stream_ends_it() {
    for endless in ["x", "x\n", RAISE] {
        let mut driven = ScriptedProgram::start("calibrate_endless", PLAN);
        driven.wait_until_ready();
        let block = endless.repeat(4096);
        while driven.orders.write_all(block.as_bytes()).is_ok() {}
        let folder = driven.folder.clone();
        let (exit, _, error) = driven.wait_for_end();
        assert!(exit == Some(1) && error.contains("E684"), "{error}");
        assert!(error.contains("flooded"), "{error}");
        assert!(entries(&folder, "given").len() <= 1);
    }
}

#[test]
fn without_a_reader_nothing_is_given() {
    let mut driven = ScriptedProgram::start("calibrate_no_reader", PLAN);
    driven.wait_until_ready();
    driven.lines = None;
    // The program may have ended already.
    let _ = driven.orders.write_all(RAISE.as_bytes());
    let folder = driven.folder.clone();
    let (exit, _, error) = driven.wait_for_end();
    assert!(exit == Some(1) && error.contains("E684"), "{error}");
    assert!(error.contains("output is not read"), "{error}");
    assert!(entries(&folder, "given").is_empty());
    assert_eq!(entries(&folder, "ended").len(), 1);
    let again = [
        "--json",
        "calibrate",
        "--electrodes",
        "plan.toml",
        "--auto",
        "--resume",
    ];
    let (exit, output, error) = run_flexor(&folder, &[&again[..], &["--out", "w.toml"]].concat());
    assert_eq!(exit, Some(0), "{output}{error}");
}

/// A program that waits for its reader ends with the order, or with the first signal.
#[test]
fn an_output_that_nobody_reads_does_not_keep_it() {
    for signal in [false, true] {
        let mut driven = ScriptedProgram::start("calibrate_unread", PLAN);
        driven.shrink_pipe();
        driven.wait_until_ready();
        // Each line is answered, and the answers fill a page.
        for _ in 0..8 {
            driven.send(&"nonsense\n".repeat(16));
        }
        while entries(&driven.folder, "armed").is_empty() {
            std::thread::yield_now();
        }
        match signal {
            true => {
                let id = driven.process.id().to_string();
                let sent = Command::new("kill").args(["-INT", &id]).status();
                assert!(sent.unwrap().success());
            }
            false => driven.send(ABORT),
        }
        let status = driven.process.wait().unwrap();
        assert_eq!(status.code(), Some(if signal { 130 } else { 1 }));
        assert_eq!(entries(&driven.folder, "ended").len(), 1);
        // The pipe was full; otherwise its last line would have arrived.
        let mut rest = String::new();
        driven
            .lines
            .take()
            .unwrap()
            .read_to_string(&mut rest)
            .unwrap();
        assert!(
            !rest.is_empty() && !rest.contains("continue with --resume"),
            "{rest}"
        );
        let (_, _, error) = command_result(driven.process.wait_with_output().unwrap());
        let number = if signal { "E580" } else { "E683" };
        assert!(error.contains(number), "{error}");
    }
}
