//! Whether a run was simulated is what the device says, not what it is called.

use super::program::{Board, flexor, folder, one_channel, said, written};
use firmware::link::{Decoder, Kind, Response, encode};
use hal_sim::native::native;
use host_core::link::{Port, SimulatedPort};
use host_core::record::{self, DeviceKind, Recorder, Run};
use host_core::report::{self, Report};
use host_core::run::{SessionFile, begin_trial, run, simulated};
use std::io;
use std::path::Path;

const WARNING: &str = "Simulated wearer: no evidence about people.";

/// Runs the short session on `device` and holds the record to `kind`.
fn is_recorded_as_simulated(folder: &Path, device: &str, kind: DeviceKind) {
    let name = kind.words().replace(' ', "-");
    let dir = folder.join(format!("{name}-{}", device.len()));
    let arguments = ["run", "short.toml", "--device", device, "--out"];
    let output = flexor(folder, &arguments).arg(&dir).output().unwrap();
    let (exit, _, error) = said(output);
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
}

#[test]
fn simulators_behind_sockets_terminals_and_pipes_are_recorded_as_simulated() {
    let folder = folder("identity");
    written(&folder, "short.toml", one_channel(0.3, 20));
    let native = Board::tcp(&folder);
    is_recorded_as_simulated(&folder, &native.at, DeviceKind::Native);
    drop(native);
    let terminal = Board::serve(&folder, &["--pty", "port"]);
    is_recorded_as_simulated(&folder, &terminal.at, DeviceKind::Native);
    drop(terminal);
    let wire = "--tcp 127.0.0.1:0 --device chip --body short.toml";
    let chip = Board::serve(&folder, &wire.split(' ').collect::<Vec<_>>());
    is_recorded_as_simulated(&folder, &chip.at, DeviceKind::Chip);
    drop(chip);
    is_recorded_as_simulated(&folder, "qemu", DeviceKind::Qemu);
}

/// A simulator that says it is a board, with a board's number, and shows
/// nothing of its world.
struct Disguised {
    port: SimulatedPort,
    decoder: Decoder,
    unique_id: [u32; 3],
}

impl Port for Disguised {
    fn now_us(&mut self) -> u64 {
        self.port.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.port.send(frame)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        let mut told = Vec::new();
        for byte in self.port.receive(until_us)? {
            let Some(Ok(message)) = self.decoder.push(byte) else {
                continue;
            };
            let mut response: Response<'_> = postcard::from_bytes(message).unwrap();
            if let Response::Hello(info) = &mut response {
                (info.kind, info.unique_id) = (Kind::Board, self.unique_id);
            }
            told.extend_from_slice(&encode(&response).unwrap());
            self.decoder.clear();
        }
        Ok(told)
    }
}

/// The page of a run on a device with this number, called "chip simulator".
fn page_of(unique_id: [u32; 3]) -> String {
    let file = SessionFile::parse("short.toml", &one_channel(0.3, 20)).unwrap();
    let boot = firmware::units::Micros::new(0);
    let port = simulated(&file.session, 1, Box::new(native(boot)), boot).unwrap();
    let port = Disguised {
        port,
        decoder: Decoder::default(),
        unique_id,
    };
    let dir = folder(&format!("identity-{:08x}", unique_id[0]));
    let mut whole = Run {
        title: "One".to_owned(),
        device: "/dev/simulated-qemu".to_owned(),
        ..Run::default()
    };
    record::write_run(&dir, &whole).unwrap();
    let mut recorder = Recorder::create(&dir, 0, &begin_trial(&file)).unwrap();
    let (outcome, _) = run(&file, port, Some(&mut recorder), |_| ());
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    drop(recorder);
    let loaded = record::load(&dir).unwrap();
    assert_eq!(loaded.trials[0].identity, outcome.trial.identity);
    whole.trials.push(outcome.trial);
    report::page(&Report {
        run: &whole,
        paper: &[],
        assumptions: &[],
        command: "flexor run",
    })
}

#[test]
fn a_board_is_not_called_simulated_whatever_its_name() {
    // X and Y on the wafer, wafer number and lot in ASCII: RM0090 39.1.
    let board = page_of([0x0039_0024, 0x3431_510F, 0x3534_3832]);
    assert!(!board.contains(WARNING));
    assert!(board.contains("board at /dev/simulated-qemu"));
    let chip = page_of([*b"FLEX", *b"OR S", *b"IM 2"].map(u32::from_le_bytes));
    assert!(chip.contains(WARNING));
    assert!(chip.contains("chip simulator at /dev/simulated-qemu"));
}
