//! Refusals of oversized requests by name and number, checks of groups on arrival, and the
//! numbering of sessions.

use crate::device_desk::*;
use firmware::link::{Code, MAX_MESSAGE, Request};
use firmware::lockstep::Lockstep;
use firmware::pulse::{GroupSpec, MAX_GROUPS, Partner};
use firmware::units::Micros;
use serde::Serialize;

const BOOT: Micros = Micros::new(0);
const SEQ: u16 = 300;

/// Returns a frame, COBS and CRC, around any message of any length.
fn framed(message: &[u8]) -> Vec<u8> {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(message);
    let body = [message, &crc.to_le_bytes()].concat();
    let mut frame = vec![0; body.len() + body.len() / 254 + 2];
    let used = cobs::try_encode(&body, &mut frame).unwrap();
    frame.truncate(used);
    frame.push(0);
    frame
}

fn responses_to(desk: &mut TestHost, bytes: &[u8]) -> Vec<OwnedResponse> {
    desk.take_messages();
    desk.receive(bytes);
    desk.wait(2_000);
    desk.take_messages()
}

fn refusal_response(seq: Option<u16>, code: Code, field: &str) -> Vec<OwnedResponse> {
    vec![OwnedResponse::Refused(seq, code, field.to_owned())]
}

fn bytes(message: impl Serialize) -> Vec<u8> {
    let mut buffer = [0; 300];
    postcard::to_slice(&message, &mut buffer).unwrap().to_vec()
}

#[test]
fn a_list_that_is_too_long_is_named() {
    let mut desk = TestHost::open(BOOT);
    let session = desk.session;
    // Request numbers of docs/protocol.md: Groups, Joint, Amplitudes.
    let groups = bytes((session, SEQ, 6u8, [(3u16, 0u8); MAX_GROUPS + 1].as_slice()));
    let values = bytes((
        session,
        SEQ,
        14u8,
        None::<u32>,
        1_023u16,
        [0u32; 11].as_slice(),
    ));
    let timed = bytes((
        session,
        SEQ,
        14u8,
        Some(7u32),
        1_023u16,
        [0u32; 11].as_slice(),
    ));
    let law = (2u8, 1u32, 1u32, 1u32); // PID
    let points = [(0u8, 0u32, 0u32); 3];
    let flexors = bytes((session, SEQ, 9u8, law, 2u8, 6_000u32, points.as_slice()));
    for (message, field) in [
        (groups, "groups"),
        (values, "values"),
        (timed, "values"),
        (flexors, "flexors"),
    ] {
        let heard = responses_to(&mut desk, &framed(&message));
        assert_eq!(heard, refusal_response(Some(SEQ), Code::OutOfRange, field));
    }
    // The session of another host is checked first. The message is a request, and not a bad frame.
    let foreign = bytes((session + 1, SEQ, 14u8, 0u8, 1_023u16, [0u32; 11].as_slice()));
    let heard = responses_to(&mut desk, &framed(&foreign));
    assert_eq!(
        heard,
        refusal_response(Some(SEQ), Code::SessionTaken, "session")
    );
    assert_eq!(desk.status().counters.bad_frames, 0);
}

#[test]
fn the_longest_message_is_read_and_one_byte_more_is_too_long() {
    let mut desk = TestHost::open(BOOT);
    for (length, code) in [
        (MAX_MESSAGE, Code::UnknownMessage),
        (MAX_MESSAGE + 1, Code::FrameTooLong),
        (MAX_MESSAGE + 2, Code::FrameTooLong),
        (MAX_MESSAGE + 3, Code::FrameTooLong),
        (1_000, Code::FrameTooLong),
    ] {
        for fill in [1, 0xEE] {
            let mut message = bytes((desk.session, SEQ, 1u8)); // KeepAlive
            message.resize(length, fill);
            let heard = responses_to(&mut desk, &framed(&message));
            let [OwnedResponse::Refused(None, number, _)] = &heard[..] else {
                panic!("{heard:?}")
            };
            assert_eq!(*number, code, "{length}");
        }
    }
}

/// A simulator's server handles this request before it reaches the device.
#[test]
fn a_simulated_trigger_is_no_device_s() {
    let mut desk = TestHost::open(BOOT);
    let only = refusal(Code::SimulatorOnly, "trigger");
    assert_eq!(desk.expect_refusal(Request::SimulateTrigger), only);
}

#[test]
fn groups_are_checked_as_they_come() {
    let mut desk = TestHost::open(BOOT);
    let group = |members| GroupSpec {
        members,
        partner: Partner::Conducted,
    };
    let mut ask = |masks: &[u16]| {
        let groups = masks.iter().copied().map(group).collect();
        desk.refusal_code(Request::Groups(groups))
    };
    assert_eq!(ask(&[0b11, 0b110]), Some(Code::TwoGroups));
    assert_eq!(ask(&[0b11, 0b11]), Some(Code::TwoGroups));
    assert_eq!(ask(&[0b1]), Some(Code::OutOfRange));
    assert_eq!(ask(&[0]), Some(Code::OutOfRange));
    assert_eq!(ask(&[1 << 10 | 1]), Some(Code::OutOfRange));
    assert_eq!(ask(&[0b11, 0b1100]), None);
}

#[test]
fn sessions_are_numbered_from_where_they_are_told() {
    let mut desk = TestHost::boot(BOOT, None);
    for (first, numbers) in [
        (0, [1, 2]),
        (1, [1, 2]),
        (40_000, [40_000, 40_001]),
        (u16::MAX, [u16::MAX, 1]),
    ] {
        desk = TestHost::boot(BOOT, None);
        desk.board = Lockstep::new(identity(first, None), desk.now());
        assert_eq!([desk.hello().session, desk.hello().session], numbers);
    }
    // A host that guesses session numbers is counted.
    desk.session = 1_234;
    let taken = refusal(Code::SessionTaken, "session");
    assert_eq!(desk.expect_refusal(Request::KeepAlive), taken);
    desk.session = 1;
    assert_eq!(desk.status().counters.unknown_sessions, 1);
}
