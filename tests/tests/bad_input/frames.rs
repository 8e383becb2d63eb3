//! Bytes that form no request, and requests from another host or too many at once. The owner's
//! session continues undisturbed.

use crate::bad_input::bench::{Bench, OwnedResponse, exchange, world};
use firmware::link::{Code, Decoder, FrameError, MAX_FRAME, Request, SCHEMA, encode};
use firmware::pulse::{GroupSpec, Partner};
use firmware::safety::State;
use firmware::units::Amplitude;
use host_core::link::SimulatedPort;
use tests::desk;

/// Bytes from a host, given the session's number, and the device's answers.
pub struct FrameRow {
    name: &'static str,
    bytes: fn(u16) -> Vec<u8>,
    refusals: Vec<(Option<u16>, Code)>,
    acks: usize,
    scenes: &'static [fn() -> Bench],
}

impl FrameRow {
    pub fn codes(&self) -> impl Iterator<Item = Code> + '_ {
        self.refusals.iter().map(|&(_, code)| code)
    }
}

const BOTH: &[fn() -> Bench] = &[Bench::draft, Bench::stimulating];
const BUSY: &[fn() -> Bench] = &[Bench::armed, Bench::stimulating];
const IDLE: &[fn() -> Bench] = &[Bench::draft];

/// First request number of the rows, far from the owner's own.
const SEQ: u16 = 1000;

fn alive(session: u16) -> Vec<u8> {
    desk::frame(session, SEQ, Request::KeepAlive)
}

fn flipped(session: u16) -> Vec<u8> {
    let frame = alive(session);
    let flips = (0..8 * (frame.len() - 1)).map(|bit| {
        let mut bad = frame.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        bad
    });
    let mut only_the_crc = flips.filter(|bad| {
        let mut decoder = Decoder::default();
        let results = bad
            .iter()
            .filter_map(|&byte| Some(decoder.push(byte)?.err()));
        results.eq([Some(FrameError::Crc)])
    });
    let found = only_the_crc.next();
    found.expect("a flip that COBS does not notice")
}

/// Returns a frame with a correct CRC whose contents are no message.
fn odd(message: impl serde::Serialize) -> Vec<u8> {
    encode(&message).unwrap().to_vec()
}

fn groups(session: u16, count: usize) -> Vec<u8> {
    let group = |n: usize| GroupSpec {
        members: 0b11 << (2 * n),
        partner: Partner::Conducted,
    };
    let groups: Vec<GroupSpec> = (0..count).map(group).collect();
    odd((session, SEQ, 6u32, &groups[..]))
}

fn values(session: u16, count: usize) -> Vec<u8> {
    let mask = (1u16 << count.min(3)) - 1;
    let values = vec![Amplitude::new(5_000); count];
    odd((
        session,
        SEQ,
        14u32,
        None::<u32>,
        mask,
        &values[..],
        &[0u16; 0][..],
    ))
}

fn repeated(session: u16, requests: &[Request]) -> Vec<u8> {
    let numbered = (SEQ..).zip(requests);
    let frame = |(seq, request): (u16, &Request)| desk::frame(session, seq, request.clone());
    numbered.flat_map(frame).collect()
}

/// Returns the refusals of nine of forty orders, which do not fit between two windows.
fn nine_too_many() -> Vec<(Option<u16>, Code)> {
    let busy = |n| (Some(SEQ + n), Code::DeviceBusy);
    (31..40).map(busy).collect()
}

#[rustfmt::skip]
pub fn rows() -> Vec<FrameRow> {
    use Code::{BadCrc, Cancelled, FrameTooLong, MalformedFrame, NoSession, OutOfRange, SessionTaken, Stopped, UnknownMessage};
    let frame = |name, bytes, refusals, acks, scenes| FrameRow { name, bytes, refusals, acks, scenes };
    let bad = |name, bytes, code| frame(name, bytes, vec![(None, code)], 0, BOTH);
    let silent = |name, bytes| frame(name, bytes, vec![], 0, BOTH);
    let answered = |name, bytes, code, scenes| frame(name, bytes, vec![(Some(SEQ), code)], 0, scenes);
    vec![
        bad("wrong CRC", flipped, BadCrc),
        bad("a CRC alone", |_| vec![5, 1, 2, 3, 4, 0], BadCrc),
        bad("too short for a CRC", |_| vec![3, 1, 2, 0], MalformedFrame),
        bad("no COBS", |_| vec![200, 1, 2, 0], MalformedFrame),
        bad("longer than any frame", |_| [vec![1; MAX_FRAME + 1], vec![0]].concat(), FrameTooLong),
        bad("a megabyte", |_| [vec![7; 1 << 20], vec![0]].concat(), FrameTooLong),
        bad("an empty message", |_| odd(()), UnknownMessage),
        bad("half a message", |s| odd((s, SEQ)), UnknownMessage),
        bad("an unknown request", |s| odd((s, SEQ, 23u32)), UnknownMessage),
        bad("a request from far off", |s| odd((s, SEQ, u32::MAX)), UnknownMessage),
        bad("an unknown pulse shape", |s| odd((s, SEQ, 5u32, 0u8, 4u32, [0u8; 20])), UnknownMessage),
        bad("trailing bytes", |s| odd((s, SEQ, 1u32, 0u8)), UnknownMessage),
        answered("six groups", |s| groups(s, 6), OutOfRange, BOTH),
        answered("eleven amplitudes", |s| values(s, 11), OutOfRange, BOTH),
        silent("nothing", |_| Vec::new()),
        silent("one empty frame", |_| vec![0]),
        silent("a flood of zeros", |_| vec![0; 100_000]),
        answered("someone else's session", |s| alive(s + 1), SessionTaken, BOTH),
        answered("no session's number", |_| alive(0), SessionTaken, BOTH),
        answered("a second host", |_| desk::frame(0, SEQ, Request::Hello { schema: SCHEMA }), SessionTaken, BUSY),
        frame("half a frame, then a whole one", |s| [&alive(s)[..4], &[0], &alive(s)].concat(), vec![(None, MalformedFrame)], 1, BOTH),
        frame("forty requests at once", |s| repeated(s, &vec![Request::KeepAlive; 40]), nine_too_many(), 31, BOTH),
        frame("a stop while electrodes are checked", |s| repeated(s, &[Bench::arm_draft(), Request::Stop]), vec![(Some(SEQ), Cancelled)], 1, IDLE),
        frame("forty requests and a stop at once", |s| repeated(s, &[vec![Request::KeepAlive; 40], vec![Request::Stop]].concat()), nine_too_many(), 32, IDLE),
        frame("a start ahead of a stop", |s| repeated(s, &[Request::Start, Request::Stop]), vec![(Some(SEQ), Stopped)], 1, IDLE),
        // The same builders just inside the range produce the intended requests.
        frame("five groups", |s| groups(s, 5), vec![], 1, BOTH),
        frame("three amplitudes", |s| values(s, 3), vec![], 1, BUSY),
        answered("no session at all", alive, NoSession, &[]),
    ]
}

pub fn check_all(rows: &[FrameRow]) {
    for row in rows {
        if row.scenes.is_empty() {
            let mut port = SimulatedPort::new(world());
            hear(row, &mut port, 0);
            assert_eq!(port.world.recorder.trace.last_levels().0, 0);
        }
        for scene in row.scenes {
            check(row, scene());
        }
    }
}

fn check(row: &FrameRow, mut bench: Bench) {
    let (before, codes) = (bench.client.status().unwrap(), bench.codes());
    let session = bench.session;
    hear(row, bench.client.port(), session);
    // The owner is still answered, and its setup has not changed.
    let after = bench.client.status().unwrap();
    let name = row.name;
    assert_eq!(after.state, before.state, "{name}");
    let bad = row.refusals.iter().filter(|(seq, _)| seq.is_none()).count() as u32;
    let expected = before.counters.bad_frames + bad;
    assert_eq!(after.counters.bad_frames, expected, "{name}");
    if after.state == State::Stimulating {
        bench.wait(50_000);
        let later = bench.client.status().unwrap();
        assert!(later.counters.pulses > after.counters.pulses, "{name}");
        assert_eq!(bench.codes(), codes, "{name}");
    } else {
        assert!(bench.is_isolated(), "{name}");
    }
}

/// Compares the device's answers with those of the row, in any order.
fn hear(row: &FrameRow, port: &mut SimulatedPort, session: u16) {
    let heard = exchange(port, &(row.bytes)(session));
    let mut refusals = Vec::new();
    let mut acks = 0;
    for frame in heard {
        match frame {
            OwnedResponse::Refused(seq, code, field) => {
                assert!(!field.is_empty(), "{}", row.name);
                refusals.push((seq, Code::from_number(code).expect("a known code")));
            }
            OwnedResponse::Ack(_) => acks += 1,
            OwnedResponse::Other => {}
        }
    }
    refusals.sort();
    let mut expected = row.refusals.clone();
    expected.sort();
    assert_eq!(refusals, expected, "{}", row.name);
    assert_eq!(acks, row.acks, "{}", row.name);
}
