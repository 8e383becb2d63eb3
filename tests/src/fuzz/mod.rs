//! What is fuzzed: one function for each thing that parses bytes.
//!
//! Each takes any bytes and panics if the code behind it breaks a promise.
//! The libFuzzer targets in tests/fuzz and the test `fuzz_short` run the same
//! functions.
//! In: bytes. Out: nothing, or a panic that says which promise was broken.

mod session;
mod watch;

use crate::desk;
use hal_sim::trace::{read_csv, write_csv};
use host_core::session::Session as SessionFile;
pub use session::{Session, payload, sealed};

/// Whatever bytes arrive on a session's line: the device never panics, drives
/// no output before it was asked to arm, and says only well-formed answers.
/// A host reading the same bytes does not panic either.
pub fn frame(data: &[u8]) {
    session::hear(data);
    let mut session = Session::open();
    for bytes in data.split_inclusive(|byte| *byte == 0).take(MAX_STEPS) {
        session.receive(bytes);
        session.advance(1_000);
    }
    session.advance(5_000);
}

/// Requests with their payloads at random, but well framed, between steps of
/// time and changes of the board's inputs.
///
/// A step is a byte for its kind, a byte `n`, and for a request `n` bytes of
/// payload, for a joint reading two bytes.
pub fn lockstep(data: &[u8]) {
    steps(Session::open(), data);
}

/// The same, beside a board that leaves no refill out: both put out the same.
pub fn skipping(data: &[u8]) {
    steps(Session::beside_unskipping(), data);
}

fn steps(mut session: Session, data: &[u8]) {
    let mut rest = data;
    let mut budget_us = MAX_US;
    for _ in 0..MAX_STEPS {
        let [kind, n, tail @ ..] = rest else { break };
        let payload = match kind % 8 {
            0..=3 => usize::from(*n),
            7 => 2,
            _ => 0,
        };
        let (payload, tail) = tail.split_at(payload.min(tail.len()));
        rest = tail;
        match kind % 8 {
            0..=3 => session.request(payload),
            4 => {
                let step = (u32::from(*n) * 100 + 1).min(budget_us);
                budget_us -= step;
                session.advance(step);
            }
            5 => session.inputs(*n),
            6 => session.trigger(),
            _ => session.joint(payload),
        }
    }
    session.advance(5_000);
}

/// An edge file: refused, or read and written back to the same edges.
pub fn edge_file(data: &[u8]) {
    let Ok(edges) = read_csv(data) else { return };
    let mut written = Vec::new();
    write_csv(&mut written, edges.iter().copied()).expect("a Vec takes all bytes");
    let again = read_csv(written.as_slice()).expect("own output is readable");
    assert_eq!(edges, again, "an edge file changes when it is written back");
}

/// A session file: refused with a report that can be shown, or taken, and then
/// a device takes every request that it leads to.
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
    for request in file.requests().into_iter().chain([desk::ARM]) {
        session.request(&payload(&request));
        session.advance(250); // one window: an electrode check is still under way
        let (_, refused) = session.answers();
        assert_eq!(refused, 0, "a device refuses {request:?}");
    }
    for t_us in [0, file.duration_us / 2, file.duration_us] {
        let setpoint = file.setpoints.at(t_us);
        for setpoint in std::iter::once(setpoint).chain(file.setpoints.with(t_us)) {
            assert!(!payload(&setpoint.request(None)).is_empty());
        }
    }
}

/// Steps of one input, so that long inputs end.
const MAX_STEPS: usize = 64;

/// Device time of one input, µs.
const MAX_US: u32 = 150_000;
