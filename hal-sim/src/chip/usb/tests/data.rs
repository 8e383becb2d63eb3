//! Tests frames and the serial port's data in them.

use super::board::{Board, MS, US};
use crate::chip::usb::Failure;

/// Bytes of one frame reach the device early in the next frame, and the interrupt follows within
/// the packet's own time.
#[test]
fn delivers_with_the_next_frame() {
    let mut board = Board::open();
    for phase in [1, 250, 500, 750, 990] {
        board.received.clear();
        board.run((board.now / MS + 2) * MS + phase * US);
        let asked = board.now;
        let frame = board.host.frame(asked).unwrap();
        board.send(&[0x55; 20]);
        board.run(asked + 2 * MS);
        let (taken, bytes) = board.received.first().unwrap();
        assert_eq!(bytes, &[0x55; 20]);
        assert_eq!(board.host.frame(*taken).unwrap(), frame + 1);
        // SOF, gap, token, gap, 20 bytes of data: 35 + 8 + 35 + 2 + 195 bits are 22.9 µs, then the
        // handler's entry and 13 register accesses.
        let in_frame = {
            let start = board.host.frame_start(*taken);
            (*taken - start) as f64 / US as f64
        };
        assert!((22.9..24.0).contains(&in_frame), "{in_frame} µs");
    }
}

#[test]
fn order_and_content_survive_in_both_directions() {
    let mut board = Board::open();
    let out: Vec<u8> = (0..5_000_u32).map(|n| (n * 7 % 251) as u8).collect();
    for chunk in out.chunks(173) {
        board.send(chunk);
    }
    let packets: Vec<Vec<u8>> = (0..80_u8).map(|n| vec![n; usize::from(n % 65)]).collect();
    board.to_send.extend(packets.iter().cloned());
    board.wake();
    board.run(board.now + 60 * MS);
    let taken: Vec<u8> = board.received.iter().flat_map(|r| r.1.clone()).collect();
    assert_eq!(taken, out);
    let mut last = 0;
    for packet in packets.iter().filter(|p| !p.is_empty()) {
        let (at, got) = board.host.received().unwrap();
        assert_eq!(got.bytes(), packet.as_slice());
        assert!(at > last);
        last = at;
    }
    assert_eq!(board.host.received(), None);
    assert_eq!(board.host.failure, None);
}

/// The driver is ready again 12 µs after its handler took a packet, which is after a try; the next
/// try is the retry 75 µs after the packet's start. 13 such slots fit a frame.
#[test]
fn throughput_is_bounded_by_the_device() {
    let mut board = Board::open();
    board.send(&[0xA5; 64 * 200]);
    let start = board.host.frame_start(board.now) + MS;
    board.run(start + 10 * MS);
    let taken = board.received.iter().filter(|r| r.0 >= start).count();
    assert_eq!(taken, 130);
}

/// An endpoint armed for many packets takes 19 packets of 64 bytes per frame, the maximum of USB
/// 2.0 table 5-9.
#[test]
fn throughput_is_bounded_by_the_bus() {
    let mut board = Board::open();
    board.greedy = true;
    board.write(0xB30, (500 << 19) | (500 * 64));
    board.send(&[0xA5; 64 * 300]);
    let start = board.host.frame_start(board.now) + MS;
    board.run(start + 10 * MS);
    let taken = board.received.iter().filter(|r| r.0 >= start).count();
    assert_eq!(taken, 190);
}

/// Both directions share the bus in turn.
#[test]
fn directions_take_turns() {
    let mut board = Board::open();
    board.greedy = true;
    board.write(0xB30, (500 << 19) | (500 * 64));
    board.send(&[0xA5; 64 * 300]);
    board.to_send.extend((0..300).map(|_| vec![0x5A; 64]));
    board.wake();
    let start = board.host.frame_start(board.now) + MS;
    board.run(start + 10 * MS);
    let out = board.received.iter().filter(|r| r.0 >= start).count();
    let back = std::iter::from_fn(|| board.host.received()).count();
    // IN continues after each OUT, or after the next: the driver needs 12 µs, and a transaction of
    // the other direction takes 51 µs.
    assert!(out + back <= 191, "{out} + {back}");
    assert!(out >= 90 && back >= 85, "{out} OUT, {back} IN");
}

/// Wherever in the frame the driver arms an IN endpoint, the answer begins at the next of the tries
/// that the host makes every 25 µs.
#[test]
fn polling_left_out_changes_no_time() {
    for us in [10, 24, 25, 26, 333, 700, 940, 990] {
        let mut board = Board::open();
        let frame = board.host.frame_start(board.now) + 2 * MS;
        board.run(frame + us * US);
        board.write(0x950, 1 << 29 | 1 << 19 | 4);
        let control = board.read(0x940);
        board.write(0x940, control | 1 << 26 | 1 << 31);
        board.write(0x3000, 0x0102_0304);
        let armed = board.now;
        board.run(armed + MS);
        let (at, packet) = board.host.received().unwrap();
        assert_eq!(packet.bytes(), [4, 3, 2, 1]);
        // Token 35 bits, answer after 6.5, data 8 + 8 + 32 + 16 + 3, ACK 19.
        let bits = 35.0 + 6.5 + 67.0 + 6.5 + 19.0;
        let begin = at - (bits * 14.0) as u64;
        let slot = (0..)
            .flat_map(|f| {
                let first = frame + f * MS + 43 * 14;
                let last = frame + (f + 1) * MS - 59 * US;
                (0..40)
                    .map(move |k| first + k * 25 * US)
                    .filter(move |t| *t <= last)
            })
            .find(|slot| *slot >= armed)
            .unwrap();
        assert_eq!(begin, slot, "armed {us} µs into the frame");
    }
}

#[test]
fn a_packet_larger_than_the_descriptor_says_is_babble() {
    let mut board = Board::plugged();
    board.configuration[67] = 32;
    board.run(board.now + 400 * MS);
    board.to_send.push_back(vec![1; 33]);
    board.wake();
    board.run(board.now + 2 * MS);
    assert_eq!(board.host.failure, Some(Failure::Babble("bulk IN")));
}

#[test]
fn a_packet_with_the_wrong_toggle_is_a_repetition() {
    let mut board = Board::open();
    let control = board.read(0x940);
    board.write(0x940, control | 1 << 29);
    board.to_send.extend([vec![1; 5], vec![2; 5]]);
    board.wake();
    board.run(board.now + 2 * MS);
    assert_eq!(board.host.received().unwrap().1.bytes(), [2; 5]);
    assert_eq!(board.host.received(), None);
}

#[test]
fn a_deaf_device_is_naked_without_an_event() {
    let mut board = Board::open();
    board.deaf = true;
    board.send(&[1; 64]);
    board.send(&[2; 64]);
    board.run(board.now + 3 * MS);
    assert_eq!(board.received.len(), 1, "the second packet is NAKed");
    assert_eq!(board.host.unsent_bytes(), 64);
    let (wakes, interrupts) = (board.wakes, board.interrupts);
    board.run(board.now + 1_000 * MS);
    assert_eq!(board.wakes, wakes, "NAKs wake nobody");
    assert_eq!(board.interrupts, interrupts);
    board.deaf = false;
    board.wake();
    let ready = board.now + 2_000;
    board.run(board.now + MS);
    let (taken, bytes) = &board.received[1];
    assert_eq!(bytes, &[2; 64]);
    // The next retry is at most 25 µs away, and the packets take 49 µs on the wire.
    let late = (taken - ready) / US;
    assert!((49..=80).contains(&late), "{late} µs");
}

#[test]
fn an_idle_bus_costs_nothing() {
    let mut board = Board::open();
    board.run(board.now + 10 * MS);
    let (wakes, frame) = (board.wakes, board.host.frame(board.now).unwrap());
    board.run(board.now + 1_000 * MS);
    assert_eq!(board.wakes, wakes);
    let expected = (frame + 1_000) % 2_048;
    assert_eq!(board.host.frame(board.now).unwrap(), expected);
    assert_eq!(board.read(0x808) >> 8, (u32::from(frame) + 1_000) % 2_048);
}

#[test]
fn start_of_frame_wakes_who_asks() {
    let mut board = Board::open();
    board.write(0x018, 1 << 3);
    board.write(0x014, 1 << 3);
    let before = board.host.next_event(&board.otg);
    let start = board.host.frame_start(board.now) + MS;
    // The SOF packet takes 35 bits of 14 cycles.
    assert_eq!(before, start + 35 * 14);
}

#[test]
fn closing_drops_dtr_and_stops_reading() {
    let mut board = Board::open();
    board.host.close(board.now);
    board.run(board.now + 5 * MS);
    assert!(!board.host.open);
    assert_eq!(
        board.setups.last().unwrap(),
        &[0x21, 0x22, 0, 0, 0, 0, 0, 0]
    );
    board.to_send.push_back(vec![9; 10]);
    board.wake();
    board.run(board.now + 5 * MS);
    assert_eq!(board.host.received(), None);
    board.host.open(board.now);
    board.run(board.now + 5 * MS);
    assert_eq!(board.host.received().unwrap().1.bytes(), [9; 10]);
}

/// The descriptor asks for an interval of 255 frames: hosts poll every 128.
#[test]
fn notifications_are_polled_at_their_interval() {
    let mut board = Board::open();
    let control = board.read(0x920);
    board.write(0x930, (1 << 29) | (1 << 19));
    board.write(0x920, control | 1 << 26 | 1 << 31);
    let done = loop {
        board.run(board.now + 10 * US);
        if board.read(0x920) & 1 << 31 == 0 {
            break board.now;
        }
    };
    let frame = board.host.frame(done).unwrap();
    assert_eq!(frame % 128, 0, "frame {frame}");
    assert!(done - board.host.frame_start(done) < 30 * US);
}
