//! The host against a driver like the image's.

mod board;

use super::Failure;
use board::{Board, MS, US};

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

/// Times of the specification, from the pull-up to the first SETUP and around
/// SET_ADDRESS.
#[test]
fn waits_as_long_as_the_specification_says() {
    let mut board = Board::plugged();
    let attached = {
        board.run(board.now + MS);
        board.otg.attached().unwrap()
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

/// A frame's bytes are at the device early in the next frame, and the
/// interrupt follows within the packet's own time.
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
        // SOF, gap, token, gap, 20 bytes of data: 35 + 8 + 35 + 2 + 195 bits are
        // 22.9 µs, then the handler's entry and 13 register accesses.
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
    assert_eq!(board.host.failure(), None);
}

/// The driver is ready again 12 µs after its handler took a packet, which is
/// after a try: the next is at the retry 75 µs after the packet's start. 13
/// such slots fit a frame.
#[test]
fn throughput_is_bounded_by_the_device() {
    let mut board = Board::open();
    board.send(&[0xA5; 64 * 200]);
    let start = board.host.frame_start(board.now) + MS;
    board.run(start + 10 * MS);
    let taken = board.received.iter().filter(|r| r.0 >= start).count();
    assert_eq!(taken, 130);
}

/// An endpoint armed for many packets takes 19 of 64 bytes in a frame, what
/// USB 2.0 table 5-9 gives as the most.
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

/// Both directions at once share the bus, in turn.
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
    // IN goes on after each OUT, or the one after: the driver needs 12 µs and a
    // transaction of the other direction takes 51.
    assert!(out + back <= 191, "{out} + {back}");
    assert!(out >= 90 && back >= 85, "{out} OUT, {back} IN");
}

/// Whenever in the frame the driver arms an IN endpoint, the answer begins at
/// the next of the tries that the host would have made every 25 µs.
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
    assert_eq!(board.host.failure(), Some(Failure::Babble("bulk IN")));
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
    assert_eq!(board.host.unsent(), 64);
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
    // Next retry, at most 25 µs off, and 49 µs on the wire.
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
    assert_eq!(
        board.host.frame(board.now).unwrap(),
        (frame + 1_000) % 2_048
    );
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
fn unplugging_in_the_middle_and_plugging_in_again() {
    let mut board = Board::open();
    board.send(&[3; 64 * 50]);
    board.run(board.now + 2 * MS + 300 * US);
    assert!(board.host.unsent() > 0);
    board.events.clear();
    let (now, host, otg) = (board.now, &mut board.host, &mut board.otg);
    host.unplug(now, otg);
    board.run(board.now + 20 * MS);
    assert_eq!(board.events, ["no power"]);
    assert!(!board.host.is_open());
    assert_eq!(board.host.unsent(), 0);
    assert_eq!(board.host.device(), None);
    let (now, host, otg) = (board.now, &mut board.host, &mut board.otg);
    host.plug(now, otg);
    board.received.clear();
    board.run(board.now + 400 * MS);
    assert!(board.host.is_open(), "{:?}", board.host.failure());
    board.send(b"again");
    board.run(board.now + 2 * MS);
    assert_eq!(board.received[0].1, b"again");
}

#[test]
fn soft_disconnect_is_an_unplug_for_the_host() {
    let mut board = Board::open();
    board.write(0x804, 0b10);
    board.run(board.now + MS);
    assert!(!board.host.is_open());
    board.write(0x804, 0);
    board.run(board.now + 400 * MS);
    assert!(board.host.is_open());
}

#[test]
fn a_refused_string_is_no_string() {
    let mut board = Board::plugged();
    board.refused = Some((6, 2));
    // Only the string's request has 2 in wValue's lower byte.
    board.run(board.now + 400 * MS);
    assert!(board.host.is_open());
    let device = board.host.device().unwrap();
    assert_eq!(device.name, None);
    assert_eq!(device.serial.as_deref(), Some("00112233445566778899AABB"));
}

#[test]
fn a_refused_configuration_is_named() {
    let mut board = Board::plugged();
    board.refused = Some((9, 1));
    board.run(board.now + 400 * MS);
    let failure = board.host.failure();
    assert_eq!(failure, Some(Failure::Stalled("SET_CONFIGURATION")));
    assert!(!board.host.is_open());
}

#[test]
fn a_bad_descriptor_is_named() {
    let mut board = Board::plugged();
    board.configuration[2] = 71;
    board.run(board.now + 400 * MS);
    let failure = board.host.failure().unwrap();
    assert_eq!(failure.to_string(), "bad descriptor: wTotalLength");
}

#[test]
fn a_device_that_never_answers_a_request_is_too_slow() {
    let mut board = Board::plugged();
    board.mute = true;
    board.run(board.now + 6_000 * MS);
    let failure = board.host.failure();
    assert_eq!(
        failure,
        Some(Failure::Slow("GET_DESCRIPTOR device, 8 bytes"))
    );
}

#[test]
fn closing_drops_dtr_and_stops_reading() {
    let mut board = Board::open();
    board.host.close(board.now);
    board.run(board.now + 5 * MS);
    assert!(!board.host.is_open());
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

/// What pulls D+ up without asking for VBUS is seen from the plug on.
#[test]
fn debounce_begins_with_the_plug() {
    let mut board = Board::plugged();
    let (now, host, otg) = (board.now, &mut board.host, &mut board.otg);
    host.unplug(now, otg);
    board.write(0x038, 1 << 16 | 1 << 21);
    assert!(board.otg.attached().is_some());
    board.run(board.now + 1_000 * MS);
    assert_eq!(board.events, Vec::<&str>::new());
    let (now, host, otg) = (board.now, &mut board.host, &mut board.otg);
    host.plug(now, otg);
    board.run(now + 100 * MS - US);
    assert_eq!(board.events, ["suspend"]);
    board.run(now + 101 * MS);
    assert_eq!(board.events, ["suspend", "reset"]);
}

/// However long the driver's thread takes, up to 1 ms each time.
#[test]
fn enumerates_with_slow_and_fast_drivers() {
    for delay in [0, 1, 40, 333, 2_000, 7_777, 50_000, MS] {
        let mut board = Board::plugged();
        board.thread_delay = delay;
        board.run(board.now + 400 * MS);
        assert_eq!(board.host.failure(), None, "{delay} cycles");
        assert!(board.host.is_open(), "{delay} cycles");
        board.send(&[7; 100]);
        board.to_send.push_back(vec![8; 64]);
        board.wake();
        board.run(board.now + 10 * MS);
        let taken: usize = board.received.iter().map(|r| r.1.len()).sum();
        assert_eq!(taken, 100, "{delay} cycles");
        assert_eq!(board.host.received().unwrap().1.bytes(), [8; 64]);
    }
}

/// 255 frames asked for: hosts poll every 128.
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

/// The start-up clock is 16 MHz, the cable was plugged in before.
#[test]
fn clock_changes_during_debounce() {
    let mut board = Board::plugged_at(16_000_000);
    board.run(50 * 16_000);
    assert_eq!(board.events, ["power", "suspend"]);
    let at = board.now;
    board.host.set_hz(board::HZ, at);
    board.otg.set_hz(board::HZ, at);
    board.run(at + 50 * MS - US);
    assert_eq!(board.events, ["power", "suspend"]);
    board.run(at + 51 * MS);
    assert_eq!(board.events, ["power", "suspend", "reset"]);
    board.run(at + 400 * MS);
    assert!(board.host.is_open());
}

/// Prints what the host costs the simulator. Run with
/// `cargo test --release -p hal-sim --lib chip::usb::tests::cost -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn cost() {
    let mut board = Board::open();
    let timed = |what: &str, count: u64, run: &mut dyn FnMut()| {
        let start = std::time::Instant::now();
        run();
        let ns = start.elapsed().as_nanos() as f64 / count as f64;
        println!("{what}: {ns:.1} ns");
    };
    let count = 10_000_000;
    timed("advance, idle, every 100 cycles", count, &mut || {
        for _ in 0..count {
            board.now += 100;
            board.host.advance(board.now, &mut board.otg);
        }
    });
    let mut sum = 0_u64;
    timed("next_event, idle", count, &mut || {
        for _ in 0..count {
            sum = sum.wrapping_add(std::hint::black_box(&board.host).next_event(&board.otg));
        }
    });
    timed("irq", count, &mut || {
        for _ in 0..count {
            sum += u64::from(std::hint::black_box(&board.otg).irq());
        }
    });
    std::hint::black_box(sum);
    let wakes = board.wakes;
    timed(
        "one second, a 64-byte packet each way every ms",
        1,
        &mut || {
            for _ in 0..1_000 {
                board.send(&[0xA5; 64]);
                board.to_send.push_back(vec![0x5A; 64]);
                board.wake();
                board.run(board.now + MS);
                while board.host.received().is_some() {}
            }
        },
    );
    println!("wakes in that second: {}", board.wakes - wakes);
}
