//! Joints whose stimulation follows their angles, on the whole device: two arms, held and released,
//! ends of stimulation, and refusals.

use crate::device_desk::*;
use firmware::haptics::{
    Form, Hold, ModulatedSpec, ModulationSpec, MotionPhase, QuarticSpec, WallSpec,
};
use firmware::link::{Code, Event, JointSample, LiftSample, Request, Telemetry};
use firmware::pulse::TrainSpec;
use firmware::safety::{Fault, State, StopCause, WearerSpec};
use firmware::units::{Amplitude, Micros};

const BOOT: Micros = Micros::new(u32::MAX - 300_000);

/// Train of the paper, 60 Hz and 350 µs, half of which is one phase.
const TRAIN: TrainSpec = TrainSpec::biphasic(175, 100, 16_667);

/// Line from 0.2 at 0° to 0.8 at 100°.
const LINE: QuarticSpec = QuarticSpec([200_000, 350_000, 500_000, 650_000, 800_000]);

/// Returns joint 0 to 3: 0 and 2 are elbows, and each shoulder follows the elbow before it. It uses
/// channels 2·joint and 2·joint + 1.
fn joint(joint: u8) -> ModulationSpec {
    let muscle = |channel, lift, drop| ModulatedSpec {
        channel,
        base: Amplitude::new(10_000),
        form: Form::Scaled,
        lift,
        drop,
    };
    ModulationSpec {
        joint,
        phase_joint: joint & !1,
        dead_band_centideg_per_s: 500,
        cutoff_mhz: 5_000,
        angle_min_mdeg: 0,
        angle_max_mdeg: 100_000,
        stale_after_ms: 40,
        max_hold_ms: 600,
        flexor: muscle(joint * 2, Some(LINE), None),
        extensor: muscle(joint * 2 + 1, None, Some(LINE)),
    }
}

/// Configures eight channels with a limit of 20 mA and `joints`, without arming.
fn with_joints(joints: impl IntoIterator<Item = ModulationSpec>) -> TestHost {
    let mut desk = TestHost::open(BOOT);
    let wearer = WearerSpec {
        host_timeout_ms: 200,
        ..wearer()
    };
    desk.prepare(wearer, &[channel(TRAIN); 8]);
    desk.expect_all_ok(joints.into_iter().map(Request::Modulation));
    desk
}

const HELD: Request = Request::ObjectHeld { held: true };
const RELEASED: Request = Request::ObjectHeld { held: false };

/// Sends the same angle, measured now, for each joint.
fn measure(desk: &mut TestHost, joints: u8, centideg: i16) {
    let at = desk.now();
    let measurement = |joint| Request::Measurement {
        joint,
        centideg,
        at,
    };
    desk.write((0..joints).map(measurement));
}

/// Moves all joints from one angle to another at 1° per 10 ms with keep-alives. Returns the last
/// telemetry.
fn move_joints(desk: &mut TestHost, joints: u8, from: i16, to: i16) -> Telemetry {
    let step = (to - from).signum() * 100;
    let mut at = from;
    while at != to {
        at += step;
        desk.write([Request::KeepAlive]);
        measure(desk, joints, at);
        desk.wait(10_000);
    }
    desk.samples().pop().expect("telemetry was subscribed to")
}

/// Starts stimulation with both arms at 20° and nothing held.
fn running() -> TestHost {
    let mut desk = with_joints((0..4).map(joint));
    desk.expect_ok(Request::Subscribe { period_ms: 5 });
    desk.start();
    measure(&mut desk, 4, 2_000);
    desk
}

fn sample(hold: Hold, phase: MotionPhase, centideg: i16) -> Option<LiftSample> {
    let joint = JointSample {
        measured_centideg: Some(centideg),
        phase: Some(phase),
    };
    let joints = [joint; 4].into_iter().collect();
    Some(LiftSample { hold, joints })
}

/// Returns these amplitudes for every joint.
fn for_every_joint(flexor: Option<u32>, extensor: Option<u32>) -> Vec<Option<Amplitude>> {
    let pair = [flexor, extensor].map(|value| value.map(Amplitude::new));
    pair.repeat(4)
}

#[test]
fn four_joints_follow_their_quartics_while_an_object_is_held() {
    let mut desk = running();
    let seen = move_joints(&mut desk, 4, 2_000, 3_000);
    assert_eq!(seen.lift, sample(Hold::Released, MotionPhase::Lift, 3_000));
    assert_eq!(seen.amplitudes[..], for_every_joint(None, None));
    desk.expect_ok(HELD);
    let seen = move_joints(&mut desk, 4, 3_000, 5_000);
    assert_eq!(seen.lift, sample(Hold::Held, MotionPhase::Lift, 5_000));
    assert_eq!(seen.amplitudes[..], for_every_joint(Some(5_000), None));
    let seen = move_joints(&mut desk, 4, 5_000, 4_000);
    assert_eq!(seen.lift, sample(Hold::Held, MotionPhase::Drop, 4_000));
    assert_eq!(seen.amplitudes[..], for_every_joint(None, Some(4_400)));
    assert_eq!(desk.fault(), None);
}

#[test]
fn an_elbow_that_stops_keeps_its_phase_and_its_amplitude() {
    let mut desk = running();
    desk.expect_ok(HELD);
    move_joints(&mut desk, 4, 2_000, 4_000);
    for _ in 0..30 {
        desk.write([Request::KeepAlive]);
        measure(&mut desk, 4, 4_000);
        desk.wait(10_000);
    }
    let seen = desk.samples().pop().unwrap();
    assert_eq!(seen.lift, sample(Hold::Held, MotionPhase::Lift, 4_000));
    assert_eq!(seen.amplitudes[..], for_every_joint(Some(4_400), None));
}

#[test]
fn no_pulse_begins_once_an_object_is_dropped_and_the_outputs_are_isolated() {
    // Releases in every part of a period.
    let mut latest = 0;
    for after_us in (0..16_667).step_by(463) {
        let mut desk = running();
        desk.expect_ok(HELD);
        move_joints(&mut desk, 4, 2_000, 4_000);
        desk.wait(after_us);
        let dropped = desk.since_boot_us();
        desk.write([RELEASED]);
        move_joints(&mut desk, 4, 4_000, 5_000);
        let last = (0..8).filter_map(|n| driven_starts(&desk.record.levels, n).pop());
        // Both phases of a biphasic pulse are driven intervals.
        let since = last.max().unwrap().saturating_sub(dropped);
        latest = latest.max(since);
        let isolated = desk.isolated_since().expect("isolated");
        assert!(isolated < dropped + 3_000, "{isolated} {dropped}");
        assert_eq!(desk.state(), State::Stimulating);
        // Stimulation returns with the next hold.
        desk.expect_ok(HELD);
        let seen = move_joints(&mut desk, 4, 5_000, 6_000);
        assert!(seen.amplitudes[0].is_some(), "{seen:?}");
    }
    println!("the last phase begins at most {latest} µs after the release arrived");
    // The sum of a control tick, a window until its order, two windows ahead, and one pulse.
    assert!((1..=2_000).contains(&latest), "{latest}");
}

#[test]
fn what_is_held_too_long_is_let_go_until_it_is_released_and_held_anew() {
    let mut desk = running();
    desk.expect_ok(HELD);
    let held = desk.since_boot_us();
    for n in 0..100 {
        // A host that repeats the request does not extend the hold.
        desk.write([Request::KeepAlive, HELD]);
        measure(&mut desk, 4, 2_000 + 25 * n);
        desk.wait(10_000);
    }
    let last = (0..8).filter_map(|n| driven_starts(&desk.record.levels, n).pop());
    let last = last.max().unwrap() - held;
    assert!((580_000..=602_000).contains(&last), "{last}");
    let heard = desk.take_messages();
    assert!(has_event(&heard, Event::HoldExpired));
    let expiries = heard
        .iter()
        .filter(|h| matches!(h, OwnedResponse::Event(_, Event::HoldExpired)));
    assert_eq!(expiries.count(), 1);
    assert_eq!(
        desk.expect_refusal(HELD),
        refusal(Code::HoldExpired, "held")
    );
    assert_eq!(desk.state(), State::Stimulating);
    desk.expect_all_ok([RELEASED, HELD]);
    let seen = move_joints(&mut desk, 4, 4_500, 5_500);
    assert_eq!(seen.lift, sample(Hold::Held, MotionPhase::Lift, 5_500));
    assert!(seen.amplitudes[0].is_some());
}

#[test]
fn a_silent_host_ends_it_whatever_it_measures() {
    let mut desk = running();
    desk.expect_ok(HELD);
    let silent = desk.since_boot_us();
    for n in 0..40 {
        measure(&mut desk, 4, 2_000 + 100 * n);
        desk.wait(10_000);
    }
    assert!(has_event(
        &desk.take_messages(),
        Event::Stopped(StopCause::HostSilent)
    ));
    let isolated = desk.isolated_since().expect("isolated");
    assert!(isolated < silent + 310_000, "{isolated} {silent}");
    assert_eq!((desk.state(), desk.fault()), (State::Idle, None));
}

#[test]
fn an_angle_that_cannot_be_believed_is_a_fault_while_an_object_is_held_only() {
    // Released, none of the four joints needs an angle.
    let mut desk = running();
    desk.keep_alive(20, 10_000);
    assert_eq!(desk.fault(), None);
    // A hold needs the angles of all joints.
    assert_eq!(desk.expect_refusal(HELD), refusal(Code::NoAngle, "joint"));
    measure(&mut desk, 3, 2_000);
    assert_eq!(desk.expect_refusal(HELD), refusal(Code::NoAngle, "joint"));
    measure(&mut desk, 4, 2_000);
    desk.expect_ok(HELD);
    // One angle becomes stale.
    for _ in 0..6 {
        desk.write([Request::KeepAlive]);
        measure(&mut desk, 3, 2_000);
        desk.wait(10_000);
    }
    assert_eq!(desk.fault(), Some(Fault::SensorStale));

    let mut desk = running();
    measure(&mut desk, 4, 12_001);
    desk.wait(5_000);
    assert_eq!(desk.expect_refusal(HELD), refusal(Code::NoAngle, "joint"));
    // Just outside the range, the value at its end is used.
    measure(&mut desk, 4, 11_900);
    desk.expect_ok(HELD);
    let seen = move_joints(&mut desk, 4, 11_900, 11_000);
    assert_eq!(seen.amplitudes[..], for_every_joint(None, Some(8_000)));
    measure(&mut desk, 4, 12_001);
    desk.wait(5_000);
    assert_eq!(desk.fault(), Some(Fault::SensorRange));
}

#[test]
fn held_is_refused_where_nothing_is_modulated_and_released_is_not_overtaken() {
    let mut desk = TestHost::open(BOOT);
    assert_eq!(desk.expect_refusal(HELD), refusal(Code::NotArmed, "state"));
    desk.prepare(wearer(), &[channel(TRAIN)]);
    desk.start();
    assert_eq!(
        desk.expect_refusal(HELD),
        refusal(Code::NoModulation, "modulation")
    );
    let mut desk = with_joints([joint(0)]);
    desk.start();
    measure(&mut desk, 1, 2_000);
    desk.expect_ok(HELD);
    let at = desk.now();
    let other = Request::Measurement {
        joint: 1,
        centideg: 0,
        at,
    };
    assert_eq!(
        desk.expect_refusal(other),
        refusal(Code::NoModulation, "joint")
    );
    assert_eq!(
        desk.expect_refusal(equal_amplitudes(1, 1_000)).0,
        Code::Controlled
    );
    desk.expect_ok(RELEASED);
    desk.expect_ok(Request::Stop);
}

#[test]
fn arming_names_what_does_not_fit() {
    type Change = fn(&mut ModulationSpec);
    // Quartic that exceeds the limit of 20 mA at one angle only: 0.5 at 50° of 40.01 mA.
    const PEAK: QuarticSpec = QuarticSpec([0, 250_000, 1_000_000, 250_000, 0]);
    #[rustfmt::skip]
    let changes: [(Change, Code, &str); 6] = [
        (|j| (j.flexor.base, j.flexor.lift) = (Amplitude::new(40_002), Some(PEAK)),
            Code::AboveWearerLimit, "lift"),
        (|j| j.extensor.base = Amplitude::new(25_001), Code::AboveWearerLimit, "drop"),
        (|j| j.flexor.channel = 9, Code::NoTrain, "modulation"),
        (|j| j.extensor.channel = 8, Code::NoTrain, "modulation"),
        (|j| j.flexor.channel = 0, Code::ChannelTwice, "modulation"),
        (|j| j.phase_joint = 3, Code::NoPhaseJoint, "phase_joint"),
    ];
    for (change, code, field) in changes {
        let mut other = joint(1);
        change(&mut other);
        let mut desk = with_joints([joint(0), other]);
        assert_eq!(desk.expect_refusal(ARM), refusal(code, field));
    }
    // A slightly smaller base is accepted.
    let mut most = joint(0);
    (most.flexor.base, most.flexor.lift) = (Amplitude::new(40_000), Some(PEAK));
    with_joints([most]).expect_ok(ARM);
    // Mistakes that no setup could make valid are refused at once.
    let mut desk = TestHost::open(BOOT);
    #[rustfmt::skip]
    let at_once: [(Change, Code, &str); 4] = [
        (|j| j.joint = 4, Code::OutOfRange, "joint"),
        (|j| j.extensor.channel = j.flexor.channel, Code::ChannelTwice, "modulation"),
        (|j| j.flexor.lift = Some(QuarticSpec([0, 0, 0, 0, 1_000_001])), Code::ShareLimit, "lift"),
        (|j| j.extensor.drop = Some(QuarticSpec([0, -10, 0, 0, 0])), Code::ShareLimit, "drop"),
    ];
    for (change, code, field) in at_once {
        let mut spec = joint(0);
        change(&mut spec);
        assert_eq!(
            desk.expect_refusal(Request::Modulation(spec)),
            refusal(code, field)
        );
    }
}

#[test]
fn modulated_joints_and_a_joint_or_a_wall_do_not_go_together() {
    let wall = WallSpec {
        at_mdeg: 0,
        side: firmware::haptics::Side::Flexion,
        channel: 4,
        max: Amplitude::new(1),
        stiffness: 1,
        damping: 0,
        cutoff_mhz: 1_000,
        pre_wall: None,
        co_contraction: None,
        angle_min_mdeg: 0,
        angle_max_mdeg: 1_000,
        sensor: firmware::control::SensorSource::Host,
        stale_after_ms: 40,
    };
    for other in [crate::device_desk::joint(4, 5, 1, 10), Request::Wall(wall)] {
        let mut desk = with_joints([joint(0)]);
        desk.expect_ok(other);
        let expected = refusal(Code::JointAndModulation, "modulation");
        assert_eq!(desk.expect_refusal(ARM), expected);
    }
}
