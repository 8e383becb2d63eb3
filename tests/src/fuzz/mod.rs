//! Fuzz targets: one function for each parser of bytes.
//!
//! Each takes any bytes and panics if the tested code breaks a promise. The libFuzzer targets in
//! tests/fuzz, the test `fuzz_short` and the program `fuzz` run the same functions. In: bytes. Out:
//! nothing, or a panic that names the broken promise.

mod campaign;
mod chip;
mod device;
mod files;
mod judged;
mod mutate;
mod session;
mod usb;
mod watch;

use crate::desk;
pub use campaign::{Campaign, Find, broken_promise, corpus};
pub use chip::{elf, gdb};
pub use device::device;
pub use files::{journal, lines, record, report, stage_words, wearer};
use firmware::link::Request;
use hal_sim::trace::{read_csv, write_csv};
use host_core::session::Session as SessionFile;
pub use mutate::mutation;
pub use session::{BOOTED, Session, payload, request_frame};
pub use usb::usb;

/// Fuzz target: a function for any bytes, with its name and example inputs.
pub struct Target {
    /// Name in commands and folders.
    pub name: &'static str,
    /// Description of the input.
    pub about: &'static str,
    /// Function that panics if its input breaks a promise.
    pub function: fn(&[u8]),
    /// Folders of the repository with example inputs.
    pub corpus: &'static [&'static str],
    /// Number of mutations that `cargo verify` runs.
    pub short: u64,
}

macro_rules! targets {
    ($($name:ident $corpus:literal $short:literal $about:literal)*) => {
        /// All fuzz targets.
        pub const TARGETS: &[Target] = &[$(Target {
            name: stringify!($name),
            about: $about,
            function: $name,
            corpus: &[$corpus],
            short: $short,
        }),*];
    };
}

#[rustfmt::skip]
targets! {
    frame "tests/fuzz/corpus/frame" 50_000 "bytes on the line of a session, read by device and host"
    lockstep "tests/fuzz/corpus/lockstep" 50_000 "random requests, time steps and inputs"
    skipping "tests/fuzz/corpus/lockstep" 5_000 "the same, compared with a device that skips no refill"
    device "tests/fuzz/corpus/lockstep" 3_000 "the same for one second, judged at the electrodes"
    edge_file "tests/fuzz/corpus/edge_file" 20_000 "a file of edges"
    session_toml "host-tool/sessions" 20_000 "a session file"
    wearer "host-tool/wearers" 10_000 "a wearer file"
    journal "tests/fuzz/corpus/journal" 10_000 "a calibration's journal"
    record "tests/fuzz/corpus/record" 2_000 "a record with one damaged file"
    report "tests/fuzz/corpus/record" 100 "the same; if it loads, it is shown and compared"
    lines "tests/fuzz/corpus/lines" 20_000 "lines of orders to flexor calibrate"
    stage_words "tests/fuzz/corpus/stage_words" 50_000 "the table of output stages that a board stores"
    elf "tests/fuzz/corpus/elf" 5_000 "an image file, and the chip simulator that runs it"
    gdb "tests/fuzz/corpus/gdb" 200 "packets at the debug port for gdb"
    usb "tests/fuzz/corpus/usb" 6 "USB control requests of other programs to the image"
}

/// Fuzzes the bytes on a session's line: the device never panics, drives no output before an arm
/// request, and sends only well-formed answers. A host that reads the same bytes does not panic
/// either.
pub fn frame(data: &[u8]) {
    session::decode_as_host(data);
    let mut session = Session::open();
    for bytes in data.split_inclusive(|byte| *byte == 0).take(MAX_STEPS) {
        session.receive(bytes);
        session.advance(1_000);
    }
    session.advance(5_000);
}

/// Fuzzes well-framed requests with random payloads, between steps of time and changes of the
/// board's inputs.
pub fn lockstep(data: &[u8]) {
    run_steps(Session::open(), data);
}

/// Fuzzes like the target `lockstep`, on a board that may skip refills and on a second board that
/// skips none; both must emit the same.
pub fn skipping(data: &[u8]) {
    run_steps(Session::with_unskipping_twin(), data);
}

fn run_steps(mut session: Session, data: &[u8]) {
    for step in read_steps(data, Budget::SHORT) {
        step.run(&mut session);
    }
    session.advance(5_000);
}

/// Limits on the part of an input that is played, so that long inputs end.
#[derive(Clone, Copy)]
struct Budget {
    steps: usize,
    /// Device time, µs.
    time_us: u32,
}

impl Budget {
    const SHORT: Self = Self {
        steps: MAX_STEPS,
        time_us: 150_000,
    };
    const LONG: Self = Self {
        steps: 4 * MAX_STEPS,
        time_us: 1_000_000,
    };
}

/// Step of an input, such as a request or a time that passes.
enum Step<'a> {
    Request(&'a [u8]),
    Time(u32),
    Inputs(u8),
    /// Trigger edge, and whether the input stays active from then on.
    Trigger(bool),
    Joint(&'a [u8]),
}

/// Parses steps: a byte for the kind, a byte `n`, and for a request `n` bytes of payload, for a
/// joint reading two bytes.
fn read_steps(data: &[u8], mut budget: Budget) -> Vec<Step<'_>> {
    let (mut rest, mut steps) = (data, Vec::new());
    for _ in 0..budget.steps {
        let [kind, n, tail @ ..] = rest else { break };
        let payload = match kind % 8 {
            0..=3 => usize::from(*n),
            7 => 2,
            _ => 0,
        };
        let (payload, tail) = tail.split_at(payload.min(tail.len()));
        rest = tail;
        steps.push(match kind % 8 {
            0..=3 => Step::Request(payload),
            4 => {
                let time_us = (u32::from(*n) * 100 + 1).min(budget.time_us);
                budget.time_us -= time_us;
                Step::Time(time_us)
            }
            5 => Step::Inputs(*n),
            6 => Step::Trigger(n % 2 == 1),
            _ => Step::Joint(payload),
        });
    }
    steps
}

impl Step<'_> {
    /// Returns the request, if a device can parse it.
    fn request(&self) -> Option<Request> {
        match self {
            Self::Request(payload) => postcard::from_bytes(payload).ok(),
            _ => None,
        }
    }

    fn run(&self, session: &mut Session) {
        match self {
            Self::Request(payload) => session.request(payload),
            Self::Time(time_us) => session.advance(*time_us),
            Self::Inputs(bits) => session.set_inputs(*bits),
            Self::Trigger(held) => {
                session.set_held(*held);
                session.trigger();
            }
            Self::Joint(code) => session.set_joint_code(code),
        }
    }
}

/// Fuzzes an edge file: it is refused, or reads back to the same edges from its own output.
pub fn edge_file(data: &[u8]) {
    let Ok(edges) = read_csv(data) else { return };
    let mut written = Vec::new();
    write_csv(&mut written, edges.iter().copied()).expect("a Vec takes all bytes");
    let again = read_csv(written.as_slice()).expect("own output is readable");
    assert_eq!(edges, again, "an edge file changes when it is written back");
}

/// Fuzzes a session file: it is refused with a report that can be shown, or a device accepts every
/// request that follows from it.
pub fn session_toml(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else {
        return;
    };
    let file = match SessionFile::parse("session.toml", text) {
        Ok(file) => file,
        Err(error) => {
            let shown = format!("{:?}", miette::Report::new(error));
            assert!(!shown.is_empty(), "an error without a report");
            return;
        }
    };
    let mut session = Session::open();
    for request in file.setup_requests().into_iter().chain([desk::ARM]) {
        session.request(&payload(&request));
        session.advance(250); // one window: the electrode check is still in progress
        let (_, refused) = session.answers();
        assert_eq!(refused, 0, "a device refuses {request:?}");
    }
    for t_us in [0, file.duration_us / 2, file.duration_us] {
        let setpoint = file.setpoints.at(t_us);
        for setpoint in std::iter::once(setpoint).chain(file.setpoints.accompanying_at(t_us)) {
            assert!(!payload(&setpoint.to_request(None)).is_empty());
        }
    }
}

/// Largest number of steps of one input, so that long inputs end.
const MAX_STEPS: usize = 64;
