//! The Thumb build against the host build: one command log, replayed on the device code in this
//! process and in QEMU, gives the same levels, DAC codes and bytes at the same microseconds,
//! including the answer to `Hello`.

mod lift;
pub mod session;

use firmware::device::Identity;
use firmware::link::message::ResetCause;
use firmware::link::{Code, Event, Kind, Response};
use firmware::lockstep::port::MAX_PIECE;
use firmware::lockstep::{Lockstep, Sensors, Sink};
use firmware::pulse::Levels;
use firmware::safety::StopCause;
use firmware::units::{DacCode, Micros, us};
use hal_sim::images::Image;
use hal_sim::lockstep::Device;
use hal_sim::qemu::Qemu;
use session::{BOOT, Step, thirty_seconds};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Instant;
use tests::desk;

/// Single output of a device.
#[derive(Debug, PartialEq)]
enum Put {
    Levels(Micros, u32),
    Dac(Micros, u8, DacCode),
    Trip(Micros, u8, DacCode),
    Bytes(Micros, Vec<u8>),
}

/// Outputs of a device, in order.
#[derive(Default)]
struct Record(Vec<Put>);

impl Sink for Record {
    fn write_levels(&mut self, at: Micros, levels: Levels) {
        self.0.push(Put::Levels(at, levels.0));
    }

    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        self.0.push(Put::Dac(at, channel, code));
    }

    fn write_trip(&mut self, at: Micros, bank: u8, code: DacCode) {
        self.0.push(Put::Trip(at, bank, code));
    }

    /// Joins bytes of one time, because the split into pieces does not count as output.
    fn write_bytes(&mut self, at: Micros, bytes: &[u8]) {
        match self.0.last_mut() {
            Some(Put::Bytes(before, all)) if *before == at => all.extend_from_slice(bytes),
            _ => self.0.push(Put::Bytes(at, bytes.to_vec())),
        }
    }
}

fn replay(device: &mut dyn Device, log: &[Step]) -> Record {
    let mut record = Record::default();
    for step in log {
        match step {
            Step::Receive(at, bytes, sensors) => device.receive(*at, bytes, sensors, &mut record),
            Step::Advance(to, sensors) => device.advance(*to, sensors, &mut record),
        }
        .unwrap_or_else(|e| panic!("{e}"));
    }
    record
}

fn in_qemu() -> Qemu {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let image = Image::Qemu.build(&workspace);
    let image = image.unwrap_or_else(|e| panic!("{e}"));
    Qemu::start(&image).unwrap_or_else(|e| panic!("{e}"))
}

fn in_process() -> Lockstep {
    let identity = Identity {
        reset: ResetCause::Watchdog,
        ..desk::identity(Kind::Qemu, 1)
    };
    Lockstep::new(identity, BOOT)
}

/// Replays `log` in QEMU and in this process, and checks that the outputs are identical.
fn same_to_the_bit(log: &[Step]) -> Record {
    let mut qemu = in_qemu();
    qemu.boot(BOOT, ResetCause::Watchdog, None).unwrap();
    let start = Instant::now();
    let thumb = replay(&mut qemu, log);
    let wall = start.elapsed().as_secs_f64();
    let host = replay(&mut in_process(), log);
    println!(
        "QEMU took {wall:.1} s: {} commands ({:.0} a second), {} outputs",
        qemu.commands(),
        qemu.commands() as f64 / wall,
        thumb.0.len(),
    );
    for (index, (host, thumb)) in host.0.iter().zip(&thumb.0).enumerate() {
        assert_eq!(host, thumb, "output {index}: host left, QEMU right");
    }
    assert_eq!(host.0.len(), thumb.0.len());
    host
}

#[test]
fn a_session_of_30_s_is_the_same_to_the_bit() {
    exercises_what_it_claims(&same_to_the_bit(&thirty_seconds(1)));
}

#[test]
fn a_lift_is_the_same_to_the_bit() {
    let file = desk::load_session("lift.toml");
    let record = same_to_the_bit(&lift::lift(1, &file.session));
    // Requires both lines of eight channels, and amplitudes of all of them.
    let (mut driven, mut output, mut channels) = (0u32, Vec::new(), BTreeSet::new());
    for put in &record.0 {
        match put {
            Put::Levels(_, bits) => driven |= bits,
            Put::Dac(_, channel, _) => drop(channels.insert(*channel)),
            Put::Trip(..) => {}
            Put::Bytes(_, bytes) => output.extend_from_slice(bytes),
        }
    }
    assert!(driven.count_ones() >= 16, "{driven:b}");
    assert!(channels.len() >= 8, "{channels:?}");
    for message in desk::messages(&output) {
        let response: Response<'_> = postcard::from_bytes(&message).unwrap();
        assert!(
            !matches!(response, Response::Refused { .. }),
            "{response:?}"
        );
    }
}

/// Checks that the record covers enough, because a comparison of two silent devices would prove
/// nothing.
fn exercises_what_it_claims(record: &Record) {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    let (mut driven, mut codes, mut wrapped, mut output) = (0, 0, false, Vec::new());
    let mut banks = BTreeSet::new();
    for put in &record.0 {
        match put {
            Put::Levels(at, bits) => {
                wrapped |= at.get() < BOOT.get();
                driven |= bits;
            }
            Put::Dac(..) => codes += 1,
            Put::Trip(_, bank, _) => {
                banks.insert(bank);
            }
            Put::Bytes(_, bytes) => output.extend_from_slice(bytes),
        }
    }
    for message in desk::messages(&output) {
        let response = postcard::from_bytes(&message).unwrap();
        *seen.entry(kind(&response)).or_default() += 1;
    }
    println!("{seen:?}, {codes} DAC writes");
    assert!(wrapped, "the clock did not wrap");
    assert_eq!(driven, (1 << 21) - 1, "a line never rose");
    seen.remove("else");
    assert!(codes > 1000 && seen.len() == 8);
    assert!(
        banks.into_iter().eq(&[0, 1, 2, 3, 4, 5]),
        "a bank had no level"
    );
}

fn kind(response: &Response) -> &'static str {
    match response {
        Response::Hello(_) => "hello",
        Response::Ack { .. } => "acknowledgements",
        Response::Refused { seq: None, .. } => "bad frames",
        Response::Refused { refusal, .. } => {
            assert_eq!(refusal.code, Code::AboveWearerLimit as u16, "{refusal:?}");
            "limits named"
        }
        Response::Telemetry(_) => "telemetry",
        Response::Event { event, .. } => match event {
            Event::Faulted(_) => "over-current",
            Event::Stopped(StopCause::HostSilent) => "host silence",
            Event::Recovered => "recovery",
            _ => "else",
        },
        Response::Status { .. } => "else",
    }
}

#[test]
fn bytes_beyond_a_frame_go_in_pieces_and_none_is_lost() {
    let mut qemu = in_qemu();
    let mut board = in_process();
    qemu.boot(BOOT, ResetCause::Watchdog, None).unwrap();
    let noise: Vec<u8> = (0..20_000u32).map(|i| (i * 7 + i / 256) as u8).collect();
    let (at, sensors) = (BOOT + us(5), Sensors::default());
    let (mut thumb, mut host) = (Record::default(), Record::default());
    qemu.receive(at, &noise, &sensors, &mut thumb).unwrap();
    for piece in noise.chunks(MAX_PIECE) {
        board.receive(at, piece, &sensors, &mut host);
    }
    assert!(!host.0.is_empty());
    assert_eq!(thumb.0, host.0);
}

#[test]
fn an_image_that_crashes_is_explained() {
    // Not an image: its first word is no stack address in RAM, its second no code address.
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    let error = Qemu::start(&here).err().unwrap().to_string();
    assert!(error.contains("Lockup"), "{error}");
}
