//! `flexor serve` accepts a client only when it can answer.

use crate::program::{Board, command_result, flexor_command, test_folder, write_file};
use crate::steady::retry_after_stalls;
use firmware::units::Micros;
use hal_sim::native::native;
use host_core::link::{Connection, TcpPort};
use host_core::record::{DeviceState, Sample};
use host_core::run::{SessionFile, run, simulated_port};
use host_core::wearer::builtin_wearer;
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Longest time for building and booting the image.
const PATIENCE: Duration = Duration::from_secs(600);

struct ServeProcess(Child);

impl Drop for ServeProcess {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A client that tries to connect from the start is answered as soon as it is accepted, because the
/// chip has booted by then.
#[test]
fn the_first_connection_is_answered() {
    for device in ["native", "chip"] {
        retry_after_stalls("the_first_connection_is_answered", || {
            assert_answered(device)
        });
    }
}

fn assert_answered(device: &str) {
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = free.local_addr().unwrap().to_string();
    drop(free);
    let mut command = flexor_command(Path::new("."), &["serve", "--device", device, "--tcp", &at]);
    command.stdout(Stdio::null());
    let mut served = ServeProcess(command.spawn().unwrap());
    let begin = Instant::now();
    let mut refused = 0;
    let port = loop {
        match TcpPort::connect(&at) {
            Ok(port) => break port,
            Err(_) => refused += 1,
        }
        assert!(begin.elapsed() < PATIENCE, "{device} was never served");
        assert!(served.0.try_wait().unwrap().is_none(), "{device} ended");
        std::thread::sleep(Duration::from_millis(1));
    };
    let waited = begin.elapsed();
    // The client waits half a second for `Hello`.
    let opened = Connection::open(port);
    assert!(opened.is_ok(), "{device}: {:?}", opened.err());
    println!("{device}: refused {refused} times in {waited:?}, then answered");
}

/// The shipped session of a force at the hand, with the posture that docs/examples/hand.py assumes.
const HELD: &str = include_str!("../sessions/endpoint_force.toml");

/// Runs the example client for a force with this wearer's arm, and returns its output.
fn run_client(board: &Board, wearer: &Path, force_n: [&str; 3]) -> String {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/examples/hand.py");
    let mut python = Command::new("python3");
    python.args([example, &board.at]).arg(wearer).args(force_n);
    let output = python.output().expect("python3, which the example is in");
    let (exit, text, error) = command_result(output);
    assert_eq!(exit, Some(0), "{text}{error}");
    text
}

/// Returns the final amplitude of every channel for this force, played from a session file, in the
/// format of the example.
fn played_amplitudes(force_n: &str) -> String {
    let points = HELD.find("points = [").unwrap();
    let text = format!(
        "{}points = [{{ at_s = 0, force_n = {force_n} }}]",
        &HELD[..points]
    );
    let text = text.replace("duration_s = 6.0", "duration_s = 1.0");
    let file = SessionFile::parse("endpoint_force.toml", &text).unwrap();
    let boot = Micros::new(0);
    let port = simulated_port(&file.session, 1, Box::new(native(boot)), boot).unwrap();
    let (outcome, _) = run(&file, port, None, |_| ());
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    // Before the stop, during which the amplitudes fall.
    let held = |sample: &Sample| sample.state == DeviceState::Stimulating;
    let last = outcome.trial.samples.iter().filter(held).last().unwrap();
    let worn = file.session.worn.as_ref().unwrap();
    let given = (1..)
        .zip(&last.amplitudes)
        .filter_map(|(channel, amplitude)| {
            let electrode = worn
                .wearer
                .electrodes
                .iter()
                .find(|electrode| electrode.channel == channel)?;
            let ma = (amplitude.as_ref()? * 1e3).round() / 1e3;
            Some(format!("{} {ma} mA", electrode.place))
        });
    given.collect::<Vec<_>>().join(", ")
}

/// A client requests forces over TCP and gets the same amplitudes as a session file. An impossible
/// force is refused by number with the nearest possible one, which the client then gets.
#[test]
#[cfg(unix)]
fn a_client_asks_for_forces_at_the_hand_live() {
    let folder = test_folder("hand_live");
    let patient = builtin_wearer("arm-1")
        .unwrap()
        .replace("host_timeout_ms = 200", "host_timeout_ms = 1000");
    let arm = write_file(&folder, "arm.toml", &patient);
    let board = Board::tcp(&folder);
    let made = |text: &str, force: &str| {
        let given = format!("100.0 % of {force} N: {}\n", played_amplitudes(force));
        assert!(text.contains(&given), "expected {given}{text}");
    };
    let output = run_client(&board, &arm, ["-2", "3", "2.5"]);
    made(&output, "[-2.0, 3.0, 2.5]");
    assert!(!output.contains("E3"), "{output}"); // no refusal

    let output = run_client(&board, &arm, ["-20", "30", "25"]);
    let refused = "E317 [-20.0, 30.0, 25.0] N: superior deltoid is too weak: 20.2 % is possible; \
                   the nearest force is [-4.04, 6.06, 5.05] N\n";
    assert!(output.contains(refused), "{output}");
    made(&output, "[-4.04, 6.06, 5.05]");

    // The biceps alone cannot push the hand down.
    let (others, _) = patient.match_indices("[[limb.line]]").nth(1).unwrap();
    let biceps = write_file(&folder, "biceps.toml", &patient[..others]);
    let output = run_client(&board, &biceps, ["0", "0", "-5"]);
    let refused = "E318 [0.0, 0.0, -5.0] N: no muscle can contribute; \
                   the nearest force is [0.0, 0.0, 0.0] N\n";
    assert!(output.contains(refused), "{output}");
    assert!(
        output.contains("100.0 % of [0.0, 0.0, 0.0] N: no stimulation\n"),
        "{output}"
    );
}
