//! What the wearer allows of time and charge since power came up, and rises that count
//! bursts.

use crate::device_desk::*;
use firmware::link::{Code, Event, Request};
use firmware::pulse::TrainSpec;
use firmware::safety::{State, StopCause, WearerSpec};
use firmware::units::Micros;

const BOOT: Micros = Micros::new(u32::MAX - 700_000);

/// Keeps the host alive until the device stops by itself; how long that took, µs, and
/// what was heard.
fn until_stopped(desk: &mut Desk, most_s: u32) -> (u64, Vec<Heard>) {
    let (from, mut heard) = (desk.time(), Vec::new());
    for _ in 0..most_s * 50 {
        if desk.state() != State::Stimulating {
            break;
        }
        heard.extend(desk.ask(Request::KeepAlive));
        desk.wait(20_000);
    }
    desk.wait(60_000);
    heard.extend(desk.heard());
    (desk.time() - 60_000 - from, heard)
}

#[test]
fn time_of_stimulation_ends_and_is_not_given_back() {
    let wearer = WearerSpec {
        max_session_s: 3,
        ..wearer()
    };
    let mut desk = Desk::open(BOOT);
    // A second, and the rest after arming anew.
    desk.run(wearer, &[channel(PLAIN)], 5_000);
    desk.keep_alive(50, 20_000);
    desk.must(Request::Stop);
    desk.wait(60_000);
    assert_eq!(desk.state(), State::Idle);
    desk.start();
    desk.must(all(1, 5_000));
    let (took, heard) = until_stopped(&mut desk, 10);
    println!(
        "3 s allowed: 1 s, and {} ms after arming anew",
        took / 1_000
    );
    assert!((1_900_000..2_100_000).contains(&took), "{took} µs");
    for told in [Event::Stopping, Event::Stopped] {
        assert!(is_told(&heard, told(StopCause::TimeOver)), "{heard:?}");
    }
    assert_eq!(desk.state(), State::Idle);
    let spent = refusal(Code::TimeOver, "max_session_s");
    assert_eq!(desk.refused(Request::Arm), spent);
    desk.must(Request::Clear);
    desk.prepare(wearer, &[channel(PLAIN)]);
    assert_eq!(desk.refused(Request::Arm), spent);
}

#[test]
fn a_channels_charge_ends_and_is_not_given_back() {
    // 20 mA · 200 µs = 4 µC a pulse, 50 a second: 1 mC with the 250th.
    let wearer = WearerSpec {
        max_dose_mc: 1,
        ..wearer()
    };
    let mut desk = Desk::open(BOOT);
    desk.run(wearer, &[channel(PLAIN), channel(PLAIN)], 0);
    desk.must(all(1, 20_000));
    let (took, heard) = until_stopped(&mut desk, 10);
    println!("1 mC of 4 µC every 20 ms: {} ms", took / 1_000);
    assert!((4_960_000..5_100_000).contains(&took), "{took} µs");
    assert!(is_told(&heard, Event::Stopping(StopCause::DoseReached)));
    assert!(is_told(&heard, Event::Stopped(StopCause::DoseReached)));
    let spent = refusal(Code::DoseReached, "max_dose_mc");
    assert_eq!(desk.refused(Request::Arm), spent);
    // The other channel has put out nothing.
    desk.must(Request::Clear);
    desk.must(Request::Wearer(wearer));
    let spec = channel(PLAIN);
    desk.must(Request::Channel { channel: 1, spec });
    desk.must(Request::Arm);
}

/// One burst a second: with its second it would be at its full amplitude by time alone.
#[test]
fn slow_trains_rise_by_bursts() {
    let wearer = WearerSpec {
        rise_ms: 500,
        rise_bursts: 4,
        ..WearerSpec::default()
    };
    let mut desk = Desk::open(BOOT);
    let slow = TrainSpec {
        period_us: 1_000_000,
        ..PLAIN
    };
    desk.run(wearer, &[channel(slow)], 20_000);
    desk.keep_alive(300, 20_000);
    let codes: Vec<u16> = desk.record.dac.iter().map(|&(_, _, code)| code).collect();
    // The electrode check writes first; 20 mA are a fifth of full scale.
    let rise: Vec<u16> = codes.into_iter().skip_while(|c| *c != 0).collect();
    assert!(
        rise.starts_with(&[0, 3_276, 6_553, 9_830, 13_107, 13_107]),
        "{rise:?}"
    );
}
