//! Arming, sessions and mailboxes: a refused request must not affect later requests.

use crate::device_desk::*;
use firmware::link::{Code, Event, Request, SCHEMA};
use firmware::pulse::Levels;
use firmware::safety::{ChannelSpec, Fault, FaultRecord, StageSpec, State, StopCause};
use firmware::units::{Amplitude, Micros};

const BOOT: Micros = Micros::new(u32::MAX - 100_000);

#[test]
fn refused_arming_leaves_nothing_behind() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN)]);
    for _ in 0..5 {
        (desk.sensors.arm, desk.sensors.hand_stop) = (false, false);
        assert_eq!(desk.refusal_code(ARM), Some(Code::ArmInputOpen));
        (desk.sensors.arm, desk.sensors.hand_stop) = (true, true);
        desk.sensors.load_ohm[0] = u32::MAX;
        assert_eq!(desk.refusal_code(ARM), Some(Code::ElectrodeOff));
        desk.sensors.load_ohm[0] = 2_000;
        desk.wait(1_000);
    }
    desk.expect_ok(ARM);
    desk.wait(1_000); // until the controller has taken its part, another `Arm` is refused with 113
    assert_eq!(desk.refusal_code(ARM), Some(Code::WrongState));
    desk.wait(1_000);
    assert_eq!(desk.refusal_code(ARM), Some(Code::WrongState));
    desk.expect_ok(Request::Start);
    desk.expect_ok(equal_amplitudes(1, 1_000));
    assert_eq!(desk.refusal_code(ARM), Some(Code::WrongState));
    assert_eq!(desk.state(), State::Stimulating);
}

/// A host that connects, configures, orders the largest amplitude and starts, but does not arm,
/// causes no edge, no comparator level and no state but Idle, whatever the state of arm key and
/// hand-held stop.
#[test]
fn nothing_is_put_out_before_an_arm_order() {
    let orders = || {
        let mask = 0b11;
        let widths = Default::default();
        let values = [Amplitude::new(20_000); 2].into_iter().collect();
        [
            Request::Start,
            Request::Wearer(wearer()),
            Request::Channel {
                channel: 0,
                spec: channel(PLAIN),
            },
            Request::Channel {
                channel: 1,
                spec: channel(MONO),
            },
            Request::Start,
            Request::Amplitudes {
                at: None,
                mask,
                values,
                widths,
            },
            angle(4_500),
            Request::KeepAlive,
            Request::Status,
            Request::SimulateTrigger,
            Request::Stop,
            Request::Acknowledge,
            Request::Start,
        ]
    };
    for closed in [false, true] {
        let mut desk = TestHost::open(BOOT);
        (desk.sensors.arm, desk.sensors.hand_stop) = (closed, closed);
        let mut taken = 0;
        for _ in 0..3 {
            desk.hello();
            for request in orders() {
                taken += usize::from(desk.answer(request).is_ok());
                desk.wait(5_000);
                assert_eq!(desk.state(), State::Idle);
            }
        }
        assert!(taken > 10, "{taken} orders taken");
        let driven = |levels: &Levels| *levels != Levels::ISOLATED;
        assert!(!desk.record.levels.iter().any(|(_, levels)| driven(levels)));
        assert_eq!((&*desk.record.dac, &*desk.record.trips), (&[][..], &[][..]));
    }
}

/// The comparators of the banks get 1.25 times the limit before anything is driven, and at no other
/// time. Code 65 535 is 125 mA.
#[test]
fn arming_sets_the_banks_comparators() {
    let current = |limit| ChannelSpec {
        limit: Amplitude::new(limit),
        ..channel(PLAIN)
    };
    let volts = ChannelSpec {
        stage: StageSpec::Voltage {
            full_scale_mv: 60_000,
            load_ohm: 2_000,
        },
        ..current(10_000)
    };
    let mut desk = TestHost::open(BOOT);
    // Banks of channels 0 and 1, 2 and 3, 4, 5 and 6, 7 and 8, 9.
    let specs = [current(8_000), current(12_000), current(400), volts];
    desk.prepare(wearer(), &specs);
    desk.wait(10_000);
    assert_eq!(desk.record.trips, [], "not before arming");
    desk.expect_ok(ARM);
    let codes = |desk: &TestHost| {
        let trips = desk.record.trips.iter().rev().take(6).rev();
        trips
            .map(|&(_, bank, code)| (bank, code))
            .collect::<Vec<_>>()
    };
    // Codes for 12 mA, for a voltage stage, whose limiter allows 20 mA, and for the smallest level,
    // 1 mA.
    let (of_12_ma, of_20_ma, least) = (7_865, 13_107, 525);
    let banks = [of_12_ma, of_20_ma, least, least, least, least];
    assert_eq!(codes(&desk), (0..).zip(banks).collect::<Vec<_>>());
    let driven = desk.record.levels.iter().find(|l| l.1 != Levels::ISOLATED);
    let written = desk.record.trips[0].0;
    assert!(written < driven.unwrap().0);
    desk.expect_all_ok([Request::Start, equal_amplitudes(4, 400)]);
    desk.wait(100_000);
    desk.expect_ok(Request::Stop);
    desk.wait(500_000);
    assert_eq!(desk.record.trips.len(), 6, "once");
    desk.expect_ok(Request::Clear);
    desk.prepare(wearer(), &[current(100)]);
    desk.expect_ok(ARM);
    assert_eq!(desk.record.trips.len(), 12);
    assert_eq!(
        codes(&desk),
        (0..6).map(|bank| (bank, least)).collect::<Vec<_>>()
    );
}

/// An arm order that meets a full mailbox must not be carried out in part.
#[test]
fn arming_through_a_flood_works_afterwards() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN)]);
    let mut requests = vec![Request::KeepAlive; 60];
    requests[45] = ARM;
    desk.write(requests);
    desk.wait(60_000);
    let heard = desk.take_messages();
    let answers = heard
        .iter()
        .filter(|h| matches!(h, OwnedResponse::Ack(..) | OwnedResponse::Refused(..)))
        .count();
    assert!(answers >= 60, "every request is answered: {answers}");
    if desk.state() == State::Armed {
        desk.expect_ok(Request::Stop);
        desk.wait(2_000);
    }
    desk.expect_ok(ARM);
}

#[test]
fn a_second_arm_order_during_the_check_is_refused_and_harms_nothing() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN)]);
    let first = desk.send(ARM);
    desk.wait(5_000);
    desk.expect_ok(Request::Channel {
        channel: 1,
        spec: channel(PLAIN),
    });
    let second = desk.send(ARM);
    desk.wait(40_000);
    let heard = desk.take_messages();
    let mut answers = heard.iter();
    assert!(answers.any(|h| matches!(h, OwnedResponse::Refused(Some(s), ..) if *s == second)));
    assert!(answers.any(|h| matches!(h, OwnedResponse::Ack(s, _) if *s == first)));
    // The armed setup is the first one, which has no second channel.
    assert_eq!(
        desk.refusal_code(equal_amplitudes(2, 1_000)),
        Some(Code::NoTrain)
    );
    desk.expect_ok(Request::Stop);
    desk.wait(2_000);
    desk.expect_ok(ARM);
    desk.expect_ok(equal_amplitudes(2, 1_000));
}

#[test]
fn a_stop_during_the_check_finishes_its_pulse_and_allows_arming_again() {
    for delay in (0..24_000u32).step_by(70) {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &[channel(PLAIN), channel(PLAIN), channel(PLAIN)]);
        desk.send(ARM);
        desk.wait(delay);
        if delay % 140 == 0 {
            desk.send(Request::Stop);
        } else {
            desk.sensors.hand_stop = false;
        }
        desk.wait(30_000);
        assert_eq!(desk.state(), State::Idle, "{delay}");
        for c in 0..3 {
            assert_balanced(&desk.record.levels, c, delay);
        }
        desk.sensors.hand_stop = true;
        desk.expect_ok(ARM);
    }
}

/// Checks that anodic and cathodic time of a channel are equal, so that no pulse was truncated.
pub fn assert_balanced(levels: &[(u64, firmware::pulse::Levels)], channel: usize, case: u32) {
    use firmware::pulse::State::{Anodic, Cathodic};
    let sum = |state| -> u64 {
        line_intervals(levels, channel, 0)
            .iter()
            .filter(|s| s.1 == state)
            .map(|s| s.2 - s.0)
            .sum()
    };
    assert_eq!(sum(Anodic), sum(Cathodic), "case {case}, channel {channel}");
}

#[test]
fn a_reading_from_before_arming_does_not_judge_its_electrodes() {
    // The hand-held stop opens at any phase of a 20 mA train, and the host arms again at once.
    for delay in (0..1_500u32).step_by(50) {
        let mut desk = TestHost::open(BOOT);
        let train = firmware::pulse::TrainSpec {
            period_us: 5_000,
            ..PLAIN
        };
        desk.run(wearer(), &[channel(train)], 20_000);
        desk.wait(20_000);
        let t0 = *driven_starts(&desk.record.levels, 0).last().unwrap();
        let next = t0 + 5_000 - 600 + u64::from(delay);
        let until = next - desk.since_boot_us();
        desk.wait(until as u32);
        desk.sensors.hand_stop = false;
        while desk.state() != State::Idle {
            desk.wait(10);
        }
        desk.sensors.hand_stop = true;
        desk.sensors.load_ohm[0] = u32::MAX;
        assert_eq!(
            desk.refusal_code(ARM),
            Some(Code::ElectrodeOff),
            "delay {delay}"
        );
        desk.sensors.load_ohm[0] = 2_000;
        desk.wait(1_000);
        desk.expect_ok(ARM);
    }
}

#[test]
fn arming_expires_after_ten_seconds_also_after_an_hour_of_idleness() {
    for idle_s in [0, 2_150, 4_300] {
        let mut desk = TestHost::open(BOOT);
        for _ in 0..idle_s {
            desk.wait(1_000_000);
        }
        desk.prepare(wearer(), &[channel(PLAIN)]);
        desk.expect_ok(ARM);
        desk.wait(9_990_000);
        assert_eq!(desk.state(), State::Armed, "{idle_s}");
        desk.take_messages();
        desk.wait(20_000);
        assert_eq!(desk.state(), State::Idle, "{idle_s}");
        assert!(has_event(
            &desk.take_messages(),
            Event::Stopped(StopCause::ArmExpired)
        ));
        desk.run(wearer(), &[channel(PLAIN)], 1_000);
        let before = desk.record.levels.len();
        desk.keep_alive(20, 50_000);
        assert_eq!(desk.state(), State::Stimulating, "{idle_s}");
        assert!(desk.record.levels.len() > before + 150, "{idle_s}");
    }
}

#[test]
fn a_fault_found_at_boot_is_latched_shown_and_cleared() {
    let record = FaultRecord {
        residual: [7; 10],
        ..FaultRecord::new(Fault::Watchdog, Micros::new(5))
    };
    let mut desk = TestHost::boot(BOOT, Some(record));
    let info = desk.hello();
    assert_eq!((info.state, info.last_fault), (State::Fault, Some(record)));
    desk.prepare(wearer(), &[channel(PLAIN)]);
    for request in [ARM, Request::Start, equal_amplitudes(1, 1)] {
        assert_eq!(desk.refusal_code(request), Some(Code::FaultLatched));
    }
    desk.expect_ok(Request::Acknowledge);
    desk.wait(110_000);
    let (first, last) = (desk.record.levels[0], desk.record.levels[1]);
    assert_eq!(desk.record.levels.len(), 2);
    assert_eq!(first.1, firmware::pulse::Levels::GROUNDED);
    assert_eq!(last.0 - first.0, 100_000);
    assert_eq!(desk.status().state, State::Idle);
    assert_eq!(desk.status().fault, Some(record));
    desk.expect_ok(ARM);
}

#[test]
fn hello_tells_the_state_of_this_moment() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN)]);
    desk.expect_ok(ARM);
    assert_eq!(desk.hello().state, State::Armed);
    desk.expect_ok(Request::Start);
    assert_eq!(desk.hello().state, State::Stimulating);
}

#[test]
fn a_new_session_gets_no_telemetry_that_it_did_not_ask_for() {
    let mut desk = TestHost::open(BOOT);
    desk.expect_ok(Request::Subscribe { period_ms: 5 });
    desk.wait(20_000);
    desk.hello();
    desk.take_messages();
    desk.wait(20_000);
    assert_eq!(desk.take_messages(), []);
}

#[test]
fn a_second_client_is_refused_from_the_arm_order_on() {
    for gap in [0, 100, 1_000, 10_000, 21_000, 30_000] {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &[channel(PLAIN)]);
        desk.send(ARM);
        desk.wait(gap);
        let owner = std::mem::replace(&mut desk.session, 77);
        for request in [Request::Hello { schema: SCHEMA }, Request::KeepAlive] {
            assert_eq!(
                desk.refusal_code(request),
                Some(Code::SessionTaken),
                "{gap}"
            );
        }
        desk.session = owner;
        desk.wait(30_000);
        desk.expect_ok(Request::Start);
    }
}

#[test]
fn a_number_out_of_order_is_not_counted_as_lost_twice() {
    let mut desk = TestHost::open(BOOT);
    let before = desk.status().counters.lost_frames;
    let base = desk.seq;
    for step in [0, 2, 1, 3, 3, 4] {
        desk.seq = base.wrapping_add(step);
        desk.expect_ok(Request::KeepAlive);
    }
    assert_eq!(desk.status().counters.lost_frames - before, 1);
}

/// An amplitude below one DAC step counts as zero, so raising it is a rise from zero.
#[test]
fn the_rise_cannot_be_dodged_by_an_amplitude_of_nothing() {
    let mut desk = TestHost::open(BOOT);
    let slow = firmware::safety::WearerSpec {
        rise_ms: 500,
        ..firmware::safety::WearerSpec::default()
    };
    desk.run(slow, &[channel(PLAIN)], 1);
    desk.keep_alive(20, 50_000);
    assert!(desk.record.dac.iter().all(|d| d.0 < 30_000 || d.2 == 0));
    desk.expect_ok(equal_amplitudes(1, 20_000));
    desk.wait(45_000);
    let first = desk.record.dac.last().unwrap().2;
    // 20 mA of 100 mA over 500 ms: two periods of 20 ms are 8 %.
    assert!(u32::from(first) <= 65_535 / 5 * 8 / 100, "{first}");
}

/// Two voltage stages with 1 kΩ and one disconnected electrode: arming reports the currents of both
/// before it refuses the second. Once armed, only the first has a current.
#[test]
fn arming_tells_what_each_electrode_read() {
    let mut desk = TestHost::open(BOOT);
    let volts = firmware::safety::ChannelSpec {
        stage: StageSpec::Voltage {
            full_scale_mv: 60_000,
            load_ohm: 2_000,
        },
        ..channel(PLAIN)
    };
    desk.prepare(wearer(), &[volts, volts]);
    desk.sensors.load_ohm = [1_000; 10];
    desk.sensors.load_ohm[1] = u32::MAX;
    let mut heard = desk.exchange(ARM);
    desk.wait(30_000);
    heard.extend(desk.take_messages());
    let [(0, applied, current_ua), (1, same, 0)] = readings(&heard)[..] else {
        panic!("{heard:?}");
    };
    let flows = f64::from(applied.get()); // mV on 1 kΩ are µA
    assert!(
        (f64::from(current_ua) - flows).abs() <= 30.0,
        "{applied:?}: {current_ua} µA"
    );
    assert_eq!(applied, same);
    let last = heard.last();
    assert!(
        matches!(last, Some(OwnedResponse::Refused(_, Code::ElectrodeOff, _))),
        "{last:?}"
    );
    desk.sensors.load_ohm[1] = 2_000;
    let mut heard = desk.exchange(ARM);
    desk.wait(430_000); // includes the pause after the previous check
    heard.extend(desk.take_messages());
    let read = readings(&heard);
    assert!(matches!(read[..], [(0, ..), (1, ..)]), "{read:?}");
    assert!(read[1].2.abs_diff(current_ua / 2) <= 30, "{read:?}");
    assert!(
        matches!(heard.last(), Some(OwnedResponse::Ack(..))),
        "{heard:?}"
    );
}

fn readings(heard: &[OwnedResponse]) -> Vec<(u8, Amplitude, u32)> {
    let reading = |heard: &OwnedResponse| match *heard {
        OwnedResponse::Event(
            _,
            Event::Electrode {
                channel,
                applied,
                current_ua,
            },
        ) => Some((channel, applied, current_ua)),
        _ => None,
    };
    heard.iter().filter_map(reading).collect()
}
