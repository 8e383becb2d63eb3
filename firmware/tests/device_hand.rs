//! The hand-held stop and the arm key.

use crate::device_desk::*;
use firmware::link::{Code, Event};
use firmware::safety::{State, StopCause, WearerSpec};
use firmware::units::Micros;

const BOOT: Micros = Micros::new(u32::MAX - 100_000);

/// Stimulation stops without the host from the window after next, whatever the state of the
/// hand-held stop.
#[test]
fn an_arm_key_taken_out_stops_as_the_hand_held_stop_does() {
    for (hand_stop, delay) in [(false, 0), (true, 0), (false, 130), (true, 777)] {
        let mut desk = TestHost::open(BOOT);
        desk.sensors.hand_stop = hand_stop;
        desk.run(wearer(), &[channel(PLAIN)], 10_000);
        desk.wait(50_000 + delay);
        assert_eq!(desk.state(), State::Stimulating);
        desk.take_messages();
        desk.sensors.arm = false;
        let opened = desk.since_boot_us();
        desk.wait(30_000);
        assert_eq!(desk.state(), State::Idle, "{hand_stop} {delay}");
        assert!(has_event(
            &desk.take_messages(),
            Event::Stopped(StopCause::ArmKey)
        ));
        let isolated = desk.isolated_since().unwrap();
        assert!(isolated <= opened + 500 + 1_200, "{}", isolated - opened);
    }
}

#[test]
fn an_arm_key_opened_while_armed_disarms_and_one_that_did_not_arm_does_nothing() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN)]);
    desk.sensors.hand_stop = false;
    desk.expect_ok(ARM);
    desk.sensors.arm = false;
    desk.wait(2_000);
    assert_eq!(desk.state(), State::Idle);
    assert!(has_event(
        &desk.take_messages(),
        Event::Stopped(StopCause::ArmKey)
    ));
    // Armed by the hand-held stop alone: the arm key is then turned on and off again.
    desk.sensors.hand_stop = true;
    desk.start();
    desk.sensors.arm = true;
    desk.wait(2_000);
    desk.sensors.arm = false;
    desk.wait(2_000);
    assert_eq!(desk.state(), State::Stimulating);
}

#[test]
fn a_wearer_who_wants_the_hand_held_stop_is_not_armed_by_the_key() {
    let careful = WearerSpec {
        hand_stop_required: true,
        ..wearer()
    };
    let mut desk = TestHost::open(BOOT);
    desk.prepare(careful, &[channel(PLAIN)]);
    for arm in [true, false] {
        (desk.sensors.arm, desk.sensors.hand_stop) = (arm, false);
        let refused = desk.expect_refusal(ARM);
        assert_eq!(refused, refusal(Code::HandStopOpen, "hand_stop_required"));
        assert_eq!(desk.state(), State::Idle);
    }
    assert_eq!(desk.record.levels, [], "not even an electrode was tested");
    for arm in [true, false] {
        (desk.sensors.arm, desk.sensors.hand_stop) = (arm, true);
        desk.start();
        desk.expect_ok(equal_amplitudes(1, 5_000));
        desk.wait(20_000);
        desk.sensors.hand_stop = false;
        desk.take_messages();
        desk.wait(20_000);
        assert_eq!(desk.state(), State::Idle);
        assert!(has_event(
            &desk.take_messages(),
            Event::Stopped(StopCause::HandStop)
        ));
    }
}
