//! Tests plugging, enumeration, refusals and unplugging.

use super::board::{Board, HZ, MS, US};
use crate::chip::usb::Failure;

#[test]
fn enumerates_a_serial_port() {
    let board = Board::open();
    let device = board.host.device().unwrap();
    assert_eq!((device.vendor, device.product), (0x1209, 0x0001));
    assert_eq!(device.manufacturer.as_deref(), Some("Flexor"));
    assert_eq!(device.name.as_deref(), Some("Flexor stimulator"));
    assert_eq!(device.serial.as_deref(), Some("00112233445566778899AABB"));
    assert_eq!(device.max_power_ma, 100);
    assert_eq!(board.events, ["power", "suspend", "reset", "speed"]);
    // SET_LINE_CODING's data, then DTR and RTS.
    assert_eq!(board.control_data, [[0x00, 0xC2, 0x01, 0x00, 0, 0, 8]]);
    let last = board.setups.last().unwrap();
    assert_eq!(last, &[0x21, 0x22, 3, 0, 0, 0, 0, 0]);
}

/// Checks the times of the specification from the pull-up to the first SETUP and around
/// SET_ADDRESS.
#[test]
fn waits_as_long_as_the_specification_says() {
    let mut board = Board::plugged();
    let attached = {
        board.run(board.now + MS);
        board.otg.attached_since().unwrap()
    };
    board.run(attached + 103 * MS);
    assert_eq!(board.events, ["power", "suspend", "reset"]);
    board.run(attached + (100 + 50 + 10) * MS - 1);
    assert_eq!(board.setups.len(), 0);
    assert_eq!(board.host.frame(board.now), Some(9));
    board.run(attached + (100 + 50 + 12) * MS);
    assert_eq!(board.setups.len(), 1);
    let mut address = None;
    while board.setups.len() < 3 {
        board.run(board.now + 10 * US);
        if board.setups.len() == 2 && address.is_none() {
            address = Some(board.now);
        }
    }
    let rest = board.now - address.unwrap();
    assert!((2 * MS..4 * MS).contains(&rest), "{rest} cycles of rest");
}

#[test]
fn unplugging_in_the_middle_and_plugging_in_again() {
    let mut board = Board::open();
    board.send(&[3; 64 * 50]);
    board.run(board.now + 2 * MS + 300 * US);
    assert!(board.host.unsent_bytes() > 0);
    board.events.clear();
    let (now, host, otg) = (board.now, &mut board.host, &mut board.otg);
    host.unplug(now, otg);
    board.run(board.now + 20 * MS);
    assert_eq!(board.events, ["no power"]);
    assert!(!board.host.open);
    assert_eq!(board.host.unsent_bytes(), 0);
    assert_eq!(board.host.device(), None);
    let (now, host, otg) = (board.now, &mut board.host, &mut board.otg);
    host.plug(now, otg);
    board.received.clear();
    board.run(board.now + 400 * MS);
    assert!(board.host.open, "{:?}", board.host.failure);
    board.send(b"again");
    board.run(board.now + 2 * MS);
    assert_eq!(board.received[0].1, b"again");
}

#[test]
fn soft_disconnect_is_an_unplug_for_the_host() {
    let mut board = Board::open();
    board.write(0x804, 0b10);
    board.run(board.now + MS);
    assert!(!board.host.open);
    board.write(0x804, 0);
    board.run(board.now + 400 * MS);
    assert!(board.host.open);
}

#[test]
fn a_refused_string_is_no_string() {
    let mut board = Board::plugged();
    board.refused = Some((6, 2));
    // Only the request of this string has 2 in wValue's lower byte.
    board.run(board.now + 400 * MS);
    assert!(board.host.open);
    let device = board.host.device().unwrap();
    assert_eq!(device.name, None);
    assert_eq!(device.serial.as_deref(), Some("00112233445566778899AABB"));
}

#[test]
fn a_refused_configuration_is_named() {
    let mut board = Board::plugged();
    board.refused = Some((9, 1));
    board.run(board.now + 400 * MS);
    let failure = board.host.failure;
    assert_eq!(failure, Some(Failure::Stalled("SET_CONFIGURATION")));
    assert!(!board.host.open);
}

#[test]
fn a_bad_descriptor_is_named() {
    let mut board = Board::plugged();
    board.configuration[2] = 71;
    board.run(board.now + 400 * MS);
    let failure = board.host.failure.unwrap();
    assert_eq!(failure.to_string(), "invalid USB descriptor: wTotalLength");
}

#[test]
fn a_device_that_never_answers_a_request_is_too_slow() {
    let mut board = Board::plugged();
    board.mute = true;
    board.run(board.now + 6_000 * MS);
    let failure = board.host.failure;
    let expected = Some(Failure::Slow("GET_DESCRIPTOR device, 8 bytes"));
    assert_eq!(failure, expected);
}

/// A device that pulls D+ up without waiting for VBUS is detected from the plug on.
#[test]
fn debounce_begins_with_the_plug() {
    let mut board = Board::plugged();
    let (now, host, otg) = (board.now, &mut board.host, &mut board.otg);
    host.unplug(now, otg);
    board.write(0x038, 1 << 16 | 1 << 21);
    assert!(board.otg.attached_since().is_some());
    board.run(board.now + 1_000 * MS);
    assert_eq!(board.events, Vec::<&str>::new());
    let (now, host, otg) = (board.now, &mut board.host, &mut board.otg);
    host.plug(now, otg);
    board.run(now + 100 * MS - US);
    assert_eq!(board.events, ["suspend"]);
    board.run(now + 101 * MS);
    assert_eq!(board.events, ["suspend", "reset"]);
}

/// Enumeration works for any delay of the driver's thread up to 1 ms per request.
#[test]
fn enumerates_with_slow_and_fast_drivers() {
    for delay in [0, 1, 40, 333, 2_000, 7_777, 50_000, MS] {
        let mut board = Board::plugged();
        board.thread_delay = delay;
        board.run(board.now + 400 * MS);
        assert_eq!(board.host.failure, None, "{delay} cycles");
        assert!(board.host.open, "{delay} cycles");
        board.send(&[7; 100]);
        board.to_send.push_back(vec![8; 64]);
        board.wake();
        board.run(board.now + 10 * MS);
        let taken: usize = board.received.iter().map(|r| r.1.len()).sum();
        assert_eq!(taken, 100, "{delay} cycles");
        assert_eq!(board.host.received().unwrap().1.bytes(), [8; 64]);
    }
}

/// The start-up clock is 16 MHz, and the cable was plugged in before.
#[test]
fn clock_changes_during_debounce() {
    let mut board = Board::plugged_at(16_000_000);
    board.run(50 * 16_000);
    assert_eq!(board.events, ["power", "suspend"]);
    let at = board.now;
    board.host.set_hz(HZ, at);
    board.otg.set_hz(HZ, at);
    board.run(at + 50 * MS - US);
    assert_eq!(board.events, ["power", "suspend"]);
    board.run(at + 51 * MS);
    assert_eq!(board.events, ["power", "suspend", "reset"]);
    board.run(at + 400 * MS);
    assert!(board.host.open);
}
