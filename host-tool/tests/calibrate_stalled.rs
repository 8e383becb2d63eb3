//! Tests of `flexor calibrate` on a computer that stalls.

use crate::calibrate_cli::{PLAN, ScriptedProgram, read};
use crate::program::{Board, test_folder, write_file};
use crate::steady::retry_after_stalls;
use host_core::calibration::{
    Course, Entry, HOST_TIMEOUT_MS, Head, Journal, OnDisk, Operator, OperatorLoss, OperatorNotice,
    OperatorStation, Order, Phase, Plan, View, calibrate,
};
use host_core::link::{TcpPort, UNATTENDED};
use std::time::Duration;

fn signal(id: u32, name: &str) {
    let sent = std::process::Command::new("kill")
        .args([&format!("-{name}"), &id.to_string()])
        .status();
    assert!(sent.unwrap().success());
}

/// The computer suspends the program for half a second during a presentation, while the board's
/// time continues. The board falls silent by itself, the stall is reported as a stall, and the same
/// level is presented again at the same step.
#[test]
fn a_computer_that_stalls_is_told_as_that_and_the_calibration_goes_on_where_it_was() {
    let name = "a_computer_that_stalls_is_told_as_that_and_the_calibration_goes_on_where_it_was";
    retry_after_stalls(name, goes_on_after_a_stall);
}

fn goes_on_after_a_stall() {
    let folder = test_folder("calibrate_stalled");
    write_file(
        &folder,
        "plan.toml",
        PLAN.replace("[limits]", "on_s = 3.0\n[limits]"),
    );
    let board = Board::in_real_time(&folder);
    let at = board.at.clone();
    let mut driven = ScriptedProgram::start_on(&folder, &["--device", &at]);
    driven.wait_until_ready();
    driven.send_order("{\"order\":\"raise\"}");
    driven.next_line(|value| value["phase"] == "on" && value["given"] == 2.0);
    signal(driven.process.id(), "STOP");
    std::thread::sleep(Duration::from_millis(500));
    signal(driven.process.id(), "CONT");
    let record = driven.next_line(|value| value["entry"].get("stalled").is_some());
    let stalled = &record["entry"]["stalled"];
    let pause_ms = stalled["pause_ms"].as_u64().unwrap();
    assert!(pause_ms >= 400 && stalled["channel"] == 3, "{record}");
    // An interrupted presentation leads to no question, and a raise presents the same level.
    let view = driven.next_line(|value| value["phase"] == "ready");
    assert!(
        view["question"].is_null() && view["step"] == "placement",
        "{view}"
    );
    assert_eq!(view["raise"], 2.0, "{view}");
    driven.send_order("{\"order\":\"raise\"}");
    driven.next_line(|value| value["phase"] == "on" && value["given"] == 2.0);
    let asked = driven.next_line(|value| value["question"].is_string());
    assert_eq!(asked["level"], 2.0, "{asked}");
    driven.send_order("{\"order\":\"abort\"}");
    let (exit, rest, error) = driven.wait_for_end();
    assert!(exit == Some(1) && error.contains("E683"), "{rest}{error}");
    let journal = read(&folder, "w.toml.journal");
    assert_eq!(journal.matches("\"stalled\"").count(), 1, "{journal}");
    assert_eq!(journal.matches("\"armed\"").count(), 2, "{journal}");
}

/// Operator that delays the program, as a slow terminal would, during one presentation.
#[derive(Default)]
struct Slow {
    looks: u32,
    stalls: u32,
}

/// Longer than the device's host timeout, shorter than a hang.
const SLOW: Duration = Duration::from_millis(150);

impl Operator for Slow {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        if view.phase == Phase::On {
            self.looks += 1;
            std::thread::sleep(SLOW);
        }
        Ok(match (view.phase, view.question) {
            (_, Some(_)) => vec![Order::Abort],
            (Phase::Ready, None) => vec![Order::Raise],
            _ => Vec::new(),
        })
    }

    fn notify(&mut self, told: OperatorNotice<'_>, _: &View) {
        let is_stall = matches!(told, OperatorNotice::Recorded(Entry::Stalled { .. }));
        self.stalls += u32::from(is_stall);
    }
}

#[test]
fn a_slow_display_or_input_does_not_make_the_host_silent() {
    assert!(SLOW < UNATTENDED && SLOW > Duration::from_millis(HOST_TIMEOUT_MS.into()));
    retry_after_stalls(
        "a_slow_display_or_input_does_not_make_the_host_silent",
        || {
            let folder = test_folder("calibrate_slow");
            let board = Board::in_real_time(&folder);
            let port = TcpPort::connect(board.at.strip_prefix("tcp:").unwrap()).unwrap();
            let plan = Plan::parse("plan", PLAN).unwrap();
            let out = folder.join("w.toml");
            let head = Head {
                operator: "slow".to_owned(),
                at: "simulated".to_owned(),
                device: "native".to_owned(),
                firmware: "0.1.0".to_owned(),
                ..Head::new("W01", PLAN)
            };
            let course = Course {
                plan: &plan,
                out: &out,
                files: &OnDisk,
                before: &[],
                head: &head,
            };
            let mut slow = Slow::default();
            let mut desk = OperatorStation {
                operator: &mut slow,
                interruption: None,
                acknowledges: false,
            };
            let (result, _, _) = calibrate(port, &course, &mut Journal::discarding(), &mut desk);
            let error = result.unwrap_err().to_string();
            assert!(error.starts_with("E683 "), "{error}");
            assert_eq!(slow.stalls, 0);
            assert!(slow.looks > 3, "{}", slow.looks);
        },
    );
}
