//! Tests that the device's own report decides whether a run was simulated, not its name.

use super::program::{Board, command_result, flexor_command, one_channel, test_folder, write_file};
use firmware::link::{Decoder, Kind, Response, encode};
use hal_sim::native::native;
use host_core::link::{Port, SimulatedPort};
use host_core::record::{self, DeviceKind, DeviceState, Recorder, Run, Sample};
use host_core::report::{self, Report};
use host_core::run::{SessionFile, begin_trial, run, simulated_port};
use host_core::wearer::builtin_wearer;
use std::io;
use std::path::{Path, PathBuf};

const WARNING: &str = "Simulated wearer: no evidence about people.";

/// Runs `session` on `device`, checks that the record has `kind`, and returns the record's folder.
fn is_recorded_as_simulated(
    folder: &Path,
    session: &str,
    device: &str,
    kind: DeviceKind,
) -> PathBuf {
    let name = kind.words().replace(' ', "-");
    let dir = folder.join(format!("{name}-{}", device.len()));
    let arguments = ["run", session, "--device", device, "--out"];
    let output = flexor_command(folder, &arguments)
        .arg(&dir)
        .output()
        .unwrap();
    let (exit, _, error) = command_result(output);
    assert_eq!(exit, Some(0), "{device}: {error}");
    let run = record::load(&dir).unwrap();
    assert!(run.is_simulated(), "{device}");
    let identity = run.trials[0].identity.as_ref().unwrap();
    assert!(identity.simulated, "{device}");
    assert_eq!(identity.kind, kind, "{device}");
    let begins = |id: &String| id.starts_with("464c45584f522053"); // "FLEXOR S"
    let is_chip = identity.unique_id.as_ref().is_some_and(begins);
    assert_eq!(is_chip, kind == DeviceKind::Chip, "{identity:?}");
    let page = std::fs::read_to_string(dir.join("report.html")).unwrap();
    assert!(page.contains(WARNING), "{device}");
    assert!(page.contains(kind.words()), "{device}");
    assert!(!page.contains("board at"), "{device}");
    let summary = std::fs::read_to_string(dir.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary["simulated"], true, "{device}");
    dir
}

#[test]
fn simulators_behind_sockets_terminals_and_pipes_are_recorded_as_simulated() {
    let folder = test_folder("identity");
    write_file(&folder, "short.toml", one_channel(0.3, 20));
    let native = Board::tcp(&folder);
    is_recorded_as_simulated(&folder, "short.toml", &native.at, DeviceKind::Native);
    drop(native);
    let terminal = Board::serve(&folder, &["--pty", "port"]);
    is_recorded_as_simulated(&folder, "short.toml", &terminal.at, DeviceKind::Native);
    drop(terminal);
    let wire = "--tcp 127.0.0.1:0 --device chip --body short.toml";
    let chip = Board::serve(&folder, &wire.split(' ').collect::<Vec<_>>());
    is_recorded_as_simulated(&folder, "short.toml", &chip.at, DeviceKind::Chip);
    drop(chip);
    is_recorded_as_simulated(&folder, "short.toml", "qemu", DeviceKind::Qemu);
}

/// A simulator that claims to be a board of this kind, with a board's number, and hides its
/// simulated world.
struct DisguisedPort {
    port: SimulatedPort,
    decoder: Decoder,
    kind: Kind,
    unique_id: [u32; 3],
}

impl Port for DisguisedPort {
    fn now_us(&mut self) -> u64 {
        self.port.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.port.send(frame)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        let mut frames = Vec::new();
        for byte in self.port.receive(until_us)? {
            let Some(Ok(message)) = self.decoder.push(byte) else {
                continue;
            };
            let mut response: Response<'_> = postcard::from_bytes(message).unwrap();
            if let Response::Hello(info) = &mut response {
                (info.kind, info.unique_id) = (self.kind, self.unique_id);
            }
            frames.extend_from_slice(&encode(&response).unwrap());
            self.decoder.clear();
        }
        Ok(frames)
    }
}

/// Returns the page and the record of a run on a device of this kind and number, called "chip simulator".
fn page_of(kind: Kind, unique_id: [u32; 3], file: &SessionFile) -> (String, Run) {
    let boot = firmware::units::Micros::new(0);
    let port = simulated_port(&file.session, 1, Box::new(native(boot)), boot).unwrap();
    let port = DisguisedPort {
        port,
        decoder: Decoder::default(),
        kind,
        unique_id,
    };
    let name = Path::new(&file.name).file_stem().unwrap().display();
    let dir = test_folder(&format!("identity-{kind:?}-{:08x}-{name}", unique_id[0]));
    let mut full_run = Run {
        title: "One".to_owned(),
        device: "/dev/simulated-qemu".to_owned(),
        ..Run::default()
    };
    record::write_run(&dir, &full_run).unwrap();
    let mut recorder = Recorder::create(&dir, 0, &begin_trial(file)).unwrap();
    let (outcome, _) = run(file, port, Some(&mut recorder), |_| ());
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    drop(recorder);
    let loaded = record::load(&dir).unwrap();
    assert_eq!(loaded.trials[0].identity, outcome.trial.identity);
    full_run.trials.push(outcome.trial);
    let page = report::page(&Report {
        run: &full_run,
        paper: &[],
        assumptions: &[],
        command: "flexor run",
    });
    (page, full_run)
}

/// X and Y on the wafer, wafer number and lot in ASCII: RM0090 39.1.
const A_BOARD_S: [u32; 3] = [0x0039_0024, 0x3431_510F, 0x3534_3832];

#[test]
fn a_board_is_not_called_simulated_whatever_its_name() {
    let file = SessionFile::parse("short.toml", &one_channel(0.3, 20)).unwrap();
    let (board, _) = page_of(Kind::Board, A_BOARD_S, &file);
    assert!(!board.contains(WARNING));
    assert!(board.contains("board at /dev/simulated-qemu"));
    let chip = [*b"FLEX", *b"OR S", *b"IM 2"].map(u32::from_le_bytes);
    let (chip, _) = page_of(Kind::Board, chip, &file);
    assert!(chip.contains(WARNING));
    assert!(chip.contains("chip simulator at /dev/simulated-qemu"));
    let (breadboard, run) = page_of(Kind::Breadboard, A_BOARD_S, &file);
    assert!(run.is_simulated() && breadboard.contains(WARNING));
    assert!(
        breadboard.contains(
            "breadboard: LEDs and analyser only, no output stage, at /dev/simulated-qemu"
        )
    );
}

/// Returns a session with a force at the hand that is reached after half a second and held, with a
/// long host timeout because a test's computer sometimes stalls.
fn a_force_at_the_hand(folder: &Path) -> SessionFile {
    let text = include_str!("../sessions/endpoint_force.toml");
    let points = text.find("points = [").unwrap();
    let text = format!(
        "{}points = [{{ at_s = 0, force_n = [0, 0, 0] }}, {{ at_s = 0.5, force_n = [-2, 3, 2.5] }}]",
        &text[..points]
    );
    let text = text.replace("duration_s = 6.0", "duration_s = 3.0");
    let text = text.replace("rate_hz = 200", "rate_hz = 20");
    let text = text.replace("../wearers/arm-1.toml", "arm.toml");
    let wearer = builtin_wearer("arm-1").unwrap();
    let wearer = wearer.replace("host_timeout_ms = 200", "host_timeout_ms = 1000");
    write_file(folder, "arm.toml", wearer);
    SessionFile::load(&write_file(folder, "hand.toml", text)).unwrap()
}

/// Requested force, realized part of it, and the amplitude of every channel.
type SampleForces = (Vec<Option<f64>>, Option<f64>, Vec<Option<f64>>);

fn given(sample: &Sample) -> SampleForces {
    let (wanted, got) = (sample.hand_n.clone(), sample.amplitudes.clone());
    (wanted, sample.hand_made, got)
}

/// Behind any port, a device outputs the same as the native one in this program, and is recorded as
/// what it reports to be. The resulting force is unknown there.
#[test]
fn a_force_at_the_hand_is_given_behind_every_port() {
    let folder = test_folder("hand_behind_a_port");
    let file = a_force_at_the_hand(&folder);
    let (page, run) = page_of(Kind::Board, A_BOARD_S, &file);
    assert!(!page.contains(WARNING) && page.contains("board at"));
    assert!(page.contains("the actual force was not measured"), "{page}");
    // Before the stop, during which the amplitudes fall.
    let held = |sample: &Sample| sample.state == DeviceState::Stimulating;
    let expected = given(&run.trials[0].samples.iter().filter(held).last().unwrap());
    let (wanted, made, amplitudes) = &expected;
    assert_eq!(*wanted, [Some(-2.0), Some(3.0), Some(2.5)]);
    assert_eq!(*made, Some(1.0));
    assert!(amplitudes.iter().flatten().count() >= 2, "{amplitudes:?}");
    for (wire, kind) in [
        ("--tcp 127.0.0.1:0", DeviceKind::Native),
        ("--pty port", DeviceKind::Native),
        (
            "--tcp 127.0.0.1:0 --device chip --body hand.toml",
            DeviceKind::Chip,
        ),
    ] {
        let board = Board::serve(&folder, &wire.split(' ').collect::<Vec<_>>());
        let dir = is_recorded_as_simulated(&folder, "hand.toml", &board.at, kind);
        let run = record::load(&dir).unwrap();
        // The number depends on the stalls of this computer.
        let samples = &run.trials[0].samples;
        let found = samples
            .iter()
            .filter(|sample| given(sample) == expected)
            .count();
        println!(
            "{wire}: {found} of {} samples are at the force",
            samples.len()
        );
        assert!(found >= 5, "{wire}: {:?}", samples.last());
        assert!(
            samples.iter().all(|sample| sample.hand_true_n.is_empty()),
            "{wire}"
        );
        assert!(
            run.trials[0].pulses.unwrap() > 50,
            "{wire}: {:?}",
            run.trials[0].pulses
        );
    }
}
