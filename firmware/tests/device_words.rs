//! Behaviour on which a client written from docs/protocol.md alone relies.

use crate::device_desk::*;
use crate::device_force::{BOOT, FORCE, SLOW, control, force, muscle};
use firmware::control::SensorSource;
use firmware::haptics::{Side, WallSpec};
use firmware::link::{Code, Event, Request};
use firmware::safety::{Fault, State, StopCause, WearerSpec};
use firmware::units::{Amplitude, us};

/// Starts stimulation with channel 0 under force control.
fn following() -> TestHost {
    let mut desk = TestHost::open(BOOT);
    let wearer = WearerSpec {
        host_timeout_ms: 1_000,
        ..wearer()
    };
    desk.prepare(wearer, &[channel(SLOW)]);
    desk.expect_ok(muscle(0));
    desk.expect_ok(control(0, FORCE));
    desk.expect_ok(Request::Subscribe { period_ms: 1 });
    desk.start();
    desk
}

#[test]
fn telemetry_gives_back_the_force_that_was_asked() {
    let mut desk = following();
    for wanted in 1..=2_000 {
        desk.send(force(0, wanted));
        desk.wait(2_000);
        let last = desk.samples().pop().expect("a sample each ms");
        assert_eq!(last.force_control[0].reference_mn, Some(wanted));
    }
}

#[test]
fn a_mask_of_nothing_does_not_keep_the_host_from_being_silent() {
    let nothing = || Request::Amplitudes {
        at: None,
        mask: 0,
        values: heapless::Vec::new(),
        widths: heapless::Vec::new(),
    };
    let mut desk = TestHost::open(BOOT);
    assert_eq!(
        desk.expect_refusal(nothing()),
        refusal(Code::OutOfRange, "mask")
    );
    desk.run(wearer(), &[channel(PLAIN)], 10_000);
    let setpoints = desk.status().counters.setpoints;
    desk.take_messages();
    let mut heard = Vec::new();
    for _ in 0..110 {
        desk.send(nothing());
        desk.wait(10_000);
        heard.extend(desk.take_messages());
    }
    assert!(has_event(&heard, Event::Stopping(StopCause::HostSilent)));
    assert_eq!(desk.status().counters.setpoints, setpoints);
}

/// The ninth stop in a window finds no place to wait for the window's time.
#[test]
fn twelve_stops_are_acknowledged_eight_with_the_windows_time() {
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer(), &[channel(PLAIN)], 10_000);
    desk.wait(100);
    desk.take_messages();
    let arrived = desk.now();
    let numbers = desk.write(vec![Request::Stop; 12]);
    desk.wait(1_000);
    let heard = desk.take_messages();
    let at = |seq| {
        heard.iter().find_map(|h| match h {
            OwnedResponse::Ack(s, at) if *s == seq => Some(*at),
            _ => None,
        })
    };
    let began = heard.iter().find_map(|h| match h {
        OwnedResponse::Event(at, Event::Stopping(StopCause::Request)) => Some(*at),
        _ => None,
    });
    assert!(began.is_some_and(|began| arrived.is_before(began)));
    for &seq in &numbers[..8] {
        assert_eq!(at(seq), began);
    }
    for &seq in &numbers[8..] {
        assert_eq!(at(seq), Some(arrived));
    }
}

#[test]
fn a_force_while_stopping_is_acknowledged_and_changes_nothing() {
    let mut desk = following();
    desk.expect_ok(force(0, 2_000));
    desk.wait(20_000);
    desk.expect_ok(Request::Stop);
    assert_eq!(desk.state(), State::Stopping);
    assert_eq!(desk.answer(force(0, 2_500)), Ok(()));
    desk.wait(200_000);
    assert_eq!(desk.state(), State::Idle);
    assert_eq!(desk.refusal_code(force(0, 100)), Some(Code::NotArmed));
}

#[test]
fn an_untimed_force_while_a_timed_one_waits_is_out_of_order() {
    let mut desk = following();
    let at = Some(desk.now() + us(50_000));
    desk.expect_ok(Request::Force {
        channel: 0,
        at,
        millinewton: 1_000,
        millinewton_per_s: None,
    });
    assert_eq!(desk.refusal_code(force(0, 900)), Some(Code::SetpointTime));
    desk.wait(60_000);
    assert_eq!(desk.refusal_code(force(0, 900)), None);
}

fn wall() -> Request {
    Request::Wall(WallSpec {
        at_mdeg: 10_000,
        side: Side::Flexion,
        channel: 0,
        max: Amplitude::new(10_000),
        stiffness: 1_000,
        damping: 0,
        cutoff_mhz: 10_000,
        pre_wall: None,
        co_contraction: None,
        angle_min_mdeg: 0,
        angle_max_mdeg: 90_000,
        sensor: SensorSource::Host,
        stale_after_ms: 40,
    })
}

/// Before the host's first measurement nothing plays, however long it takes; after it, the
/// measurement's age counts.
#[test]
fn without_a_first_measurement_nothing_is_played() {
    for request in [wall(), joint(0, 1, 5_000, 10_000)] {
        let is_joint = matches!(request, Request::Joint(_));
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &[channel(PLAIN); 2]);
        desk.expect_ok(request);
        desk.start();
        let checked = desk.status().counters.pulses;
        for _ in 0..100 {
            desk.expect_ok(Request::KeepAlive);
            if is_joint {
                desk.expect_ok(angle(6_000));
            }
            desk.wait(8_000);
        }
        assert_eq!(desk.state(), State::Stimulating);
        assert_eq!(desk.status().counters.pulses, checked);
        desk.measure(3_000);
        desk.keep_alive(6, 8_000);
        let status = desk.status();
        assert!(status.counters.pulses > checked);
        assert_eq!(status.fault.map(|f| f.fault), Some(Fault::SensorStale));
    }
}
