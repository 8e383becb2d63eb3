//! Lists of pulses at the pins: exact to the microsecond, in place of the train's own pulses.

use crate::device_desk::*;
use crate::device_widths::phases;
use firmware::link::{Code, Request};
use firmware::pulse::{Partner, TrainSpec, Trigger};
use firmware::safety::{ListedPulse, State, WearerSpec};
use firmware::units::{Amplitude, Micros};

/// Boot time; the clock wraps soon after the start.
const BOOT: Micros = Micros::new(u32::MAX - 150_000);

/// Train at 50 Hz and 200 µs, up to 400 µs, that takes lists.
const LISTING: TrainSpec = TrainSpec {
    max_width_us: 400,
    lists: true,
    ..PLAIN
};

fn list(channel: u8, pulses: &[(u32, u32, u16)]) -> Request {
    let pulses = pulses.iter().map(|&(after_us, ua, width_us)| ListedPulse {
        after_us,
        amplitude: Amplitude::new(ua),
        width_us,
    });
    Request::Pulses {
        channel,
        pulses: pulses.collect(),
    }
}

/// Returns a device whose first channel has completed its rise.
fn risen(wearer: WearerSpec, trains: &[TrainSpec]) -> TestHost {
    let mut desk = TestHost::open(BOOT);
    let specs: Vec<_> = trains.iter().map(|train| channel(*train)).collect();
    desk.run(wearer, &specs, 5_000);
    desk.wait(60_000);
    desk
}

fn code(ua: u32) -> u16 {
    (u64::from(ua) * 65_535 / 100_000) as u16
}

#[test]
fn a_list_takes_the_place_of_the_trains_pulses() {
    for first_us in [0, 1, 7_777] {
        let mut desk = risen(wearer(), &[LISTING]);
        let from = desk.since_boot_us();
        let wanted = [
            (first_us, 8_000, 100),
            (20_000, 12_000, 50),
            (31_234, 3_000, 400),
            (20_001, 20_000, 10),
        ];
        desk.expect_ok(list(0, &wanted));
        let asked = desk.since_boot_us();
        for _ in 0..4 {
            desk.expect_ok(Request::KeepAlive);
            desk.wait(45_000);
        }
        let seen = phases(&desk, 0, from);
        let pulses: Vec<_> = seen.iter().step_by(2).copied().collect();
        let begins = pulses
            .iter()
            .position(|pulse| pulse.2 == code(8_000))
            .expect("the list");
        // Before the list the train's own pulses play; the list begins at the next period, after
        // its delay.
        let slot = pulses[begins].0 - u64::from(first_us);
        assert!(
            slot >= asked - 1_000 && slot < asked + 20_500,
            "{slot} after {asked}"
        );
        if let Some(before) = begins.checked_sub(1) {
            assert_eq!(pulses[before].0 + 20_000, slot);
        }
        let mut at = slot;
        for (pulse, (after_us, ua, width_us)) in pulses[begins..].iter().zip(wanted) {
            at += u64::from(after_us);
            assert_eq!(*pulse, (at, width_us.into(), code(ua)));
        }
        // The train's own pulses follow, one period after the last.
        let own: Vec<_> = pulses[begins + wanted.len()..].to_vec();
        let expected = (1..=own.len() as u64).map(|n| (at + n * 20_000, 200, code(5_000)));
        assert!(
            own.len() >= 2 && own == expected.collect::<Vec<_>>(),
            "{own:?}"
        );
        // Both phases of each pulse are equal.
        assert!(
            seen.chunks(2).all(|chunk| chunk[0].1 == chunk[1].1),
            "{seen:?}"
        );
    }
}

#[test]
fn what_a_list_may_not_have_is_refused() {
    let wearer = WearerSpec {
        max_charge_nc: 4_000,
        ..wearer()
    };
    let mut desk = risen(wearer, &[LISTING, PLAIN]);
    let out = |field| Err(refusal(Code::OutOfRange, field));
    let single_pulse = |after_us, ua, width_us| list(0, &[(after_us, ua, width_us)]);
    let cases = [
        (list(0, &[]), out("pulses")),
        (single_pulse(2_000_001, 5_000, 200), out("after_us")),
        (single_pulse(0, 0, 200), out("amplitude")),
        (single_pulse(0, 5_000, 9), out("width_us")),
        (single_pulse(0, 5_000, 401), out("width_us")),
        (single_pulse(0, 5_000, 501), out("width_us")),
        (
            single_pulse(0, 20_001, 10),
            Err(refusal(Code::AboveWearerLimit, "values")),
        ),
        (
            single_pulse(0, 20_000, 201),
            Err(refusal(Code::ChargeAtWidth, "max_charge_nc")),
        ),
        (
            list(0, &[(0, 5_000, 200), (19_999, 5_000, 200)]),
            out("after_us"),
        ),
        (
            list(1, &[(0, 5_000, 200)]),
            Err(refusal(Code::NoLists, "lists")),
        ),
        (
            list(2, &[(0, 5_000, 200)]),
            Err(refusal(Code::NoTrain, "channel")),
        ),
        (list(10, &[(0, 5_000, 200)]), out("channel")),
        (list(0, &[(0, 20_000, 200); 16]), out("after_us")),
    ];
    for (request, expected) in cases {
        let shown = format!("{request:?}");
        assert_eq!(desk.answer(request), expected, "{shown}");
    }
    // Seventeen pulses exceed a list, which is refused by name as with any list.
    desk.expect_ok(list(0, &[(20_000, 20_000, 200); 16]));
    let plays = refusal(Code::ListPlays, "pulses");
    assert_eq!(desk.expect_refusal(single_pulse(0, 5_000, 200)), plays);
    assert_eq!(desk.state(), State::Stimulating);
}

#[test]
fn a_list_waits_for_the_rise_of_its_channel() {
    let slow = WearerSpec {
        rise_ms: 300,
        ..wearer()
    };
    let mut desk = TestHost::open(BOOT);
    desk.prepare(slow, &[channel(LISTING)]);
    let single_pulse = || list(0, &[(0, 5_000, 200)]);
    assert_eq!(
        desk.expect_refusal(single_pulse()),
        refusal(Code::NotArmed, "state")
    );
    desk.expect_ok(ARM);
    assert_eq!(
        desk.expect_refusal(single_pulse()),
        refusal(Code::WrongState, "state")
    );
    desk.expect_ok(Request::Start);
    let not_risen = refusal(Code::NotRisen, "pulses");
    assert_eq!(desk.expect_refusal(single_pulse()), not_risen);
    desk.expect_ok(equal_amplitudes(1, 5_000));
    desk.keep_alive(5, 50_000);
    assert_eq!(desk.expect_refusal(single_pulse()), not_risen);
    desk.keep_alive(3, 50_000);
    desk.expect_ok(single_pulse());
    // From zero the amplitude rises again.
    desk.expect_ok(equal_amplitudes(1, 0));
    desk.wait(60_000);
    desk.expect_ok(equal_amplitudes(1, 5_000));
    desk.wait(60_000);
    assert_eq!(desk.expect_refusal(single_pulse()), not_risen);
}

/// A setpoint of the channel ends its list; a stop lowers its pulses like any others.
#[test]
fn later_orders_hold() {
    let ten = [(20_000, 10_000, 100); 10];
    let mut desk = risen(wearer(), &[LISTING]);
    desk.expect_ok(list(0, &ten));
    // Repeating the train's present setpoint is no new order: the list goes on.
    desk.keep_alive(1, 30_000);
    desk.expect_ok(equal_amplitudes(1, 5_000));
    desk.wait(20_000);
    let listed = phases(&desk, 0, 0).last().map(|phase| (phase.1, phase.2));
    assert_eq!(listed, Some((100, code(10_000))));
    desk.expect_ok(equal_amplitudes(1, 0));
    let from = desk.since_boot_us() + 1_000;
    desk.keep_alive(4, 50_000);
    assert_eq!(phases(&desk, 0, from), []);
}

#[test]
fn a_stop_lets_a_list_fall() {
    let mut desk = risen(wearer(), &[LISTING]);
    desk.expect_ok(list(0, &[(20_000, 10_000, 100); 10]));
    desk.wait(50_000);
    let from = desk.since_boot_us();
    desk.expect_ok(Request::Stop);
    desk.wait(100_000);
    assert_eq!(desk.state(), State::Idle);
    let seen = phases(&desk, 0, from);
    let falls = seen.windows(2).all(|window| window[0].2 >= window[1].2);
    assert!(!seen.is_empty() && falls, "{seen:?}");
    assert!(
        seen.iter()
            .all(|edge| edge.1 == 100 && edge.2 < code(10_000)),
        "{seen:?}"
    );
    assert!(seen.iter().all(|edge| edge.0 < from + 51_000), "{seen:?}");
    // No part of the list plays when stimulation begins again.
    desk.start();
    desk.expect_ok(equal_amplitudes(1, 5_000));
    let from = desk.since_boot_us() + 60_000;
    desk.keep_alive(3, 50_000);
    let own = |pair: &(u64, u64, u16)| (pair.1, pair.2) == (200, code(5_000));
    assert!(phases(&desk, 0, from).iter().all(own));
}

#[test]
fn lists_go_with_endless_single_pulses_of_the_epoch_only() {
    let mut desk = TestHost::open(BOOT);
    let trains = [
        (
            "burst_count",
            TrainSpec {
                burst_count: 2,
                burst_interval_us: 2_000,
                ..LISTING
            },
        ),
        (
            "repeats",
            TrainSpec {
                repeats: 3,
                ..LISTING
            },
        ),
        (
            "trigger",
            TrainSpec {
                trigger: Some(Trigger::Start),
                ..LISTING
            },
        ),
    ];
    for (field, train) in trains {
        let spec = channel(train);
        let refused = desk.expect_refusal(Request::Channel { channel: 0, spec });
        assert_eq!(refused, refusal(Code::OutOfRange, field));
    }
    let later = TrainSpec {
        offset_us: 10_000,
        ..LISTING
    };
    desk.prepare(wearer(), &[channel(LISTING), channel(later)]);
    desk.expect_ok(group(0b11, Partner::Isolated));
    assert_eq!(
        desk.expect_refusal(ARM),
        refusal(Code::RateChanges, "groups")
    );
}

/// Two successive pulses of a list, or of list and train, may not differ by more than a step.
#[test]
fn a_list_keeps_the_wearers_steps() {
    let careful = WearerSpec {
        max_step_ua: 2_000,
        ..wearer()
    };
    let mut desk = risen(careful, &[LISTING]);
    let far = refusal(Code::TooLargeStep, "values");
    assert_eq!(desk.expect_refusal(list(0, &[(0, 7_001, 200)])), far);
    assert_eq!(
        desk.expect_refusal(list(0, &[(0, 4_000, 200), (20_000, 6_001, 200)])),
        far
    );
    assert_eq!(desk.expect_refusal(list(0, &[(0, 5_000, 281)])), far);
    desk.expect_ok(list(0, &[(0, 4_000, 200), (20_000, 6_000, 200)]));
}
