//! A wearer's allowance of time and charge since power-on, and rises that count bursts.

use crate::device_desk::*;
use firmware::link::{Code, Event, Request};
use firmware::pulse::TrainSpec;
use firmware::safety::{State, StopCause, WearerSpec};
use firmware::units::Micros;

const BOOT: Micros = Micros::new(u32::MAX - 700_000);

#[test]
fn time_of_stimulation_ends_and_is_not_given_back() {
    let wearer = WearerSpec {
        max_session_s: 3,
        ..wearer()
    };
    let mut desk = TestHost::open(BOOT);
    // Stimulates for one second, and for the rest after arming again.
    desk.run(wearer, &[channel(PLAIN)], 5_000);
    desk.keep_alive(50, 20_000);
    desk.expect_ok(Request::Stop);
    desk.wait(60_000);
    assert_eq!(desk.state(), State::Idle);
    desk.start();
    desk.expect_ok(equal_amplitudes(1, 5_000));
    let (took, heard) = wait_until_stopped(&mut desk, 10);
    println!(
        "3 s allowed: 1 s, and {} ms after arming anew",
        took / 1_000
    );
    // The first run lasts a second, plus its answers and its fall. The last run is only the fall,
    // which ends when the allowance does.
    assert!((1_800_000..1_950_000).contains(&took), "{took} µs");
    for event in [Event::Stopping, Event::Stopped] {
        assert!(has_event(&heard, event(StopCause::TimeOver)), "{heard:?}");
    }
    assert_eq!(desk.state(), State::Idle);
    let spent = refusal(Code::TimeOver, "max_session_s");
    assert_eq!(desk.expect_refusal(ARM), spent);
    desk.expect_ok(Request::Clear);
    desk.prepare(wearer, &[channel(PLAIN)]);
    assert_eq!(desk.expect_refusal(ARM), spent);
}

#[test]
fn a_channels_charge_ends_and_is_not_given_back() {
    // 20 mA · 200 µs = 4 µC per pulse, 50 per second: 1 mC at the 250th pulse.
    let wearer = WearerSpec {
        max_dose_mc: 1,
        ..wearer()
    };
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer, &[channel(PLAIN), channel(PLAIN)], 0);
    desk.expect_ok(equal_amplitudes(1, 20_000));
    let (took, heard) = wait_until_stopped(&mut desk, 10);
    println!("1 mC of 4 µC every 20 ms: {} ms", took / 1_000);
    assert!((4_960_000..5_100_000).contains(&took), "{took} µs");
    assert!(has_event(&heard, Event::Stopping(StopCause::DoseReached)));
    assert!(has_event(&heard, Event::Stopped(StopCause::DoseReached)));
    let spent = refusal(Code::DoseReached, "max_dose_mc");
    assert_eq!(desk.expect_refusal(ARM), spent);
    // The other channel has emitted nothing.
    desk.expect_ok(Request::Clear);
    desk.expect_ok(Request::Wearer(wearer));
    let spec = channel(PLAIN);
    desk.expect_ok(Request::Channel { channel: 1, spec });
    desk.expect_ok(ARM);
}

/// At one burst per second, time alone would allow the full amplitude at the second burst.
#[test]
fn slow_trains_rise_by_bursts() {
    let wearer = WearerSpec {
        rise_ms: 500,
        rise_bursts: 4,
        ..WearerSpec::default()
    };
    let mut desk = TestHost::open(BOOT);
    let slow = TrainSpec {
        period_us: 1_000_000,
        ..PLAIN
    };
    desk.run(wearer, &[channel(slow)], 20_000);
    desk.keep_alive(300, 20_000);
    let codes: Vec<u16> = desk.record.dac.iter().map(|&(_, _, code)| code).collect();
    // The electrode check writes four codes; 20 mA are a fifth of full scale.
    assert_eq!(
        codes[4..][..6],
        [2_621, 5_242, 7_864, 10_485, 13_107, 13_107]
    );
}

#[test]
fn steps_are_limited_per_burst_and_per_second() {
    let wearer = WearerSpec {
        max_step_ua: 1_000,
        max_step_ua_per_s: 3_000,
        ..wearer()
    };
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer, &[channel(PLAIN)], 5_000);
    desk.keep_alive(5, 20_000);
    let refused = refusal(Code::TooLargeStep, "values");
    // At 20 ms per burst, two orders within one period count together.
    assert_eq!(desk.expect_refusal(equal_amplitudes(1, 6_001)), refused);
    desk.expect_ok(equal_amplitudes(1, 5_500));
    assert_eq!(desk.expect_refusal(equal_amplitudes(1, 6_001)), refused);
    desk.expect_ok(equal_amplitudes(1, 6_000));
    for amplitude in [7_000, 8_000] {
        desk.keep_alive(2, 20_000);
        desk.expect_ok(equal_amplitudes(1, amplitude));
    }
    // 3 mA within this second.
    desk.keep_alive(2, 20_000);
    assert_eq!(desk.expect_refusal(equal_amplitudes(1, 8_001)), refused);
    // A lower amplitude is always accepted, and raising it again is a step.
    desk.expect_ok(equal_amplitudes(1, 2_000));
    desk.keep_alive(2, 20_000);
    assert_eq!(desk.expect_refusal(equal_amplitudes(1, 3_001)), refused);
    desk.expect_ok(equal_amplitudes(1, 3_000));
    // After two seconds none of the earlier steps counts.
    desk.keep_alive(101, 20_000);
    desk.expect_ok(equal_amplitudes(1, 4_000));
    // From zero the rise limit applies, and not the step limit.
    desk.expect_ok(equal_amplitudes(1, 0));
    desk.keep_alive(2, 20_000);
    desk.expect_ok(equal_amplitudes(1, 20_000));
}

/// In any second of accepted random orders, the rise stays within the limit.
#[test]
fn no_second_rises_by_more_than_is_allowed() {
    let wearer = WearerSpec {
        max_step_ua: 700,
        max_step_ua_per_s: 2_000,
        ..wearer()
    };
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer, &[channel(PLAIN)], 4_000);
    desk.keep_alive(5, 20_000);
    let (mut taken, mut refusals) = (vec![(desk.since_boot_us(), 4_000u32)], 0);
    let mut random = 12_345u32;
    for _ in 0..1_500 {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let now = taken.last().unwrap().1;
        let wanted = (now + (random >> 16) % 1_000)
            .saturating_sub(300)
            .clamp(100, 20_000);
        match desk.answer(equal_amplitudes(1, wanted)) {
            Ok(()) => taken.push((desk.since_boot_us(), wanted)),
            Err(_) => refusals += 1,
        }
        desk.expect_ok(Request::KeepAlive); // a refused order does not count as a keep-alive
        desk.wait(random >> 8 & 0x7FFF);
    }
    assert_eq!(desk.state(), State::Stimulating);
    let mut most = 0;
    for (n, &(t, high)) in taken.iter().enumerate() {
        // Includes the amplitudes ordered within the second before, and the one in force before
        // that.
        let earlier = taken[..n].iter().rev();
        let within = earlier.take_while(|(before, _)| t - before < 1_000_000);
        most = most.max(
            within
                .map(|(_, low)| high.saturating_sub(*low))
                .max()
                .unwrap_or(0),
        );
    }
    println!(
        "{} orders taken, {refusals} refused; {most} µA the most in a second",
        taken.len()
    );
    assert!(most <= 2_000 && most > 1_500, "{most}");
    assert!(refusals > 100 && taken.len() > 500);
}
