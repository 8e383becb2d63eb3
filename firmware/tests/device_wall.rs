//! The virtual wall on the device: how it is configured and refused, what it
//! puts out, and what ends it.

use crate::device_desk::*;
use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::haptics::{CoContraction, PreWall, Side, WallSpec};
use firmware::link::{Code, Event, Request, Telemetry};
use firmware::safety::{Fault, State, StopCause};
use firmware::units::{Amplitude, Micros};

const BOOT: Micros = Micros(u32::MAX - 100_000);

/// 1 mA/° from 90° on, 5 to 10 mA over the 9° before it, 4 mA on the antagonist.
const WALL: WallSpec = WallSpec {
    at_mdeg: 90_000,
    side: Side::Flexion,
    channel: 0,
    max: Amplitude(20_000),
    stiffness: 1_000,
    damping: 0,
    cutoff_mhz: 10_000,
    pre_wall: Some(PreWall {
        depth_mdeg: 9_000,
        begin: Amplitude(5_000),
        end: Amplitude(10_000),
    }),
    co_contraction: Some(CoContraction {
        channel: 1,
        amplitude: Amplitude(4_000),
    }),
    angle_min_mdeg: 0,
    angle_max_mdeg: 150_000,
    sensor: SensorSource::Host,
    stale_after_ms: 40,
};

/// Two channels with a limit of 20 mA and `wall`, not armed.
fn with(wall: WallSpec) -> Desk {
    let mut desk = Desk::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN); 2]);
    desk.must(Request::Wall(wall));
    desk
}

fn measure(desk: &mut Desk, centideg: i16) {
    let at = desk.now();
    desk.must(Request::Measurement {
        joint: 0,
        centideg,
        at,
    });
}

/// Armed and started with the limb at `centideg`.
fn running(wall: WallSpec, centideg: i16) -> Desk {
    let mut desk = with(wall);
    desk.must(Request::Subscribe { period_ms: 5 });
    desk.must(Request::Arm);
    measure(&mut desk, centideg);
    desk.must(Request::Start);
    desk
}

/// Holds the limb at `centideg` for 100 ms. The last telemetry.
fn hold(desk: &mut Desk, centideg: i16) -> Telemetry {
    for _ in 0..10 {
        desk.must(Request::KeepAlive);
        measure(desk, centideg);
        desk.wait(5_000);
    }
    let heard = desk.heard();
    let sample = heard.into_iter().rev().find_map(|h| match h {
        Heard::Telemetry(sample) => Some(sample),
        _ => None,
    });
    sample.expect("telemetry was subscribed to")
}

fn refused(desk: &mut Desk, request: Request) -> (Option<Code>, String) {
    let (code, field) = desk.answer(request).unwrap_err();
    (Code::from_number(code), field)
}

#[test]
fn depth_becomes_amplitude_and_telemetry_shows_both() {
    let mut desk = running(WALL, 8_000);
    let outside = hold(&mut desk, 8_000);
    assert_eq!(outside.amplitudes, [None, None]);
    assert_eq!(outside.target_centideg, Some(9_000));
    assert_eq!(outside.measured_centideg, Some(8_000));
    assert_eq!(outside.effort_milli, Some(-10_000));
    // In the middle of the pre-wall.
    let near = hold(&mut desk, 8_550);
    assert!(
        (7_499..=7_500).contains(&near.amplitudes[0].unwrap().0),
        "{near:?}"
    );
    assert_eq!(near.amplitudes[1], None);
    let inside = hold(&mut desk, 9_500);
    assert_eq!(
        inside.amplitudes,
        [Some(Amplitude(15_000)), Some(Amplitude(4_000))]
    );
    assert_eq!(inside.effort_milli, Some(5_000));
    assert!(!inside.limiting);
    let deep = hold(&mut desk, 11_000);
    assert_eq!(deep.amplitudes[0], Some(Amplitude(20_000)));
    assert!(deep.limiting);
    // Out again: silence, and telemetry says so.
    let out = hold(&mut desk, 8_000);
    assert_eq!(out.amplitudes, [None, None]);
    let last = *driven(&desk.record.levels, 0).last().unwrap();
    assert!(desk.time() - last > 60_000);
    // 15 mA of 100 mA full scale was put out.
    let codes: Vec<u16> = desk.record.dac.iter().map(|d| d.2).collect();
    assert!(codes.contains(&9_830));
}

#[test]
fn the_boards_converter_feeds_the_wall_by_the_same_path() {
    let mut desk = with(WallSpec {
        sensor: SensorSource::Adc {
            code_at_0: 500,
            code_at_100: 2_500,
        },
        ..WALL
    });
    desk.sensors.joint = Some(500 + 20 * 95);
    desk.must(Request::Subscribe { period_ms: 5 });
    desk.must(Request::Arm);
    desk.must(Request::Start);
    for _ in 0..10 {
        desk.must(Request::KeepAlive);
        desk.wait(10_000);
    }
    let seen = desk.heard().into_iter().rev().find_map(|h| match h {
        Heard::Telemetry(sample) => Some(sample),
        _ => None,
    });
    let seen = seen.unwrap();
    assert_eq!(seen.measured_centideg, Some(9_500));
    assert_eq!(
        seen.amplitudes,
        [Some(Amplitude(15_000)), Some(Amplitude(4_000))]
    );
    let at = desk.now();
    let host = Request::Measurement {
        joint: 0,
        centideg: 0,
        at,
    };
    assert_eq!(refused(&mut desk, host).0, Some(Code::SensorNotHost));
}

#[test]
fn a_silent_host_ends_a_wall_whatever_it_measures() {
    let mut desk = running(WALL, 9_500);
    hold(&mut desk, 9_500);
    for _ in 0..20 {
        measure(&mut desk, 9_500);
        desk.wait(10_000);
        if desk.state() == State::Idle {
            break;
        }
    }
    let heard = desk.status();
    assert_eq!((heard.state, heard.fault), (State::Idle, None));
}

#[test]
fn a_sensor_that_cannot_be_believed_is_a_fault() {
    let mut desk = running(WALL, 9_500);
    for _ in 0..10 {
        desk.must(Request::KeepAlive);
        desk.wait(10_000);
    }
    let fault = desk.status().fault.map(|f| f.fault);
    assert_eq!(fault, Some(Fault::SensorStale));
    let mut desk = running(WALL, 9_500);
    measure(&mut desk, 17_001);
    desk.wait(5_000);
    let fault = desk.status().fault.map(|f| f.fault);
    assert_eq!(fault, Some(Fault::SensorRange));
}

#[test]
fn a_stop_lets_the_wall_fall_and_the_channels_are_its_own() {
    let mut desk = running(WALL, 9_500);
    hold(&mut desk, 9_500);
    assert_eq!(refused(&mut desk, all(1, 1_000)).0, Some(Code::Controlled));
    desk.must(Request::Stop);
    desk.wait(200_000);
    let heard = desk.heard();
    let stopped = Event::Stopped(StopCause::Request);
    assert!(
        heard
            .iter()
            .any(|h| matches!(h, Heard::Event(_, e) if *e == stopped))
    );
}

#[test]
fn arming_names_what_does_not_fit() {
    let own = |change: fn(&mut WallSpec)| {
        let mut wall = WALL;
        change(&mut wall);
        let mut desk = with(wall);
        let (code, field) = refused(&mut desk, Request::Arm);
        (code.unwrap(), field)
    };
    let is = |code, field: &str| (code, field.to_string());
    assert_eq!(own(|w| w.max.0 = 20_001), is(Code::AboveWearerLimit, "max"));
    assert_eq!(
        own(|w| w.co_contraction.as_mut().unwrap().amplitude.0 = 20_001),
        is(Code::AboveWearerLimit, "amplitude")
    );
    assert_eq!(own(|w| w.channel = 5), is(Code::NoTrain, "wall"));
    assert_eq!(
        own(|w| w.co_contraction.as_mut().unwrap().channel = 9),
        is(Code::NoTrain, "wall")
    );
    // What no setup could make right is refused at once.
    let mut desk = Desk::open(BOOT);
    let mut bad = |change: fn(&mut WallSpec)| {
        let mut wall = WALL;
        change(&mut wall);
        let (code, field) = refused(&mut desk, Request::Wall(wall));
        (code.unwrap(), field)
    };
    assert_eq!(bad(|w| w.stiffness = 0), is(Code::OutOfRange, "stiffness"));
    assert_eq!(bad(|w| w.at_mdeg = -1), is(Code::OutOfRange, "at_mdeg"));
    assert_eq!(
        bad(|w| w.stale_after_ms = 0),
        is(Code::OutOfRange, "stale_after_ms")
    );
    assert_eq!(
        bad(|w| w.co_contraction.as_mut().unwrap().channel = 0),
        is(Code::ChannelTwice, "wall")
    );
}

#[test]
fn a_joint_and_a_wall_do_not_go_together() {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude(2_000),
        max: Amplitude(10_000),
    };
    let joint = JointSpec {
        law: LawSpec::ALONE,
        law_period_ms: 2,
        cutoff_mhz: 17_000,
        flexors: heapless::Vec::from_slice(&[point(2)]).unwrap(),
        extensor: point(1),
        hold: HoldPolicy::Hold,
        angle_min_mdeg: 0,
        angle_max_mdeg: 90_000,
        sensor: SensorSource::Host,
        stale_after_ms: 40,
        wearer: None,
        response: None,
    };
    let mut desk = Desk::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN); 3]);
    desk.must(Request::Wall(WALL));
    desk.must(Request::Joint(joint));
    let expected = (Some(Code::JointAndWall), "wall".to_string());
    assert_eq!(refused(&mut desk, Request::Arm), expected);
    desk.must(Request::Clear);
    desk.prepare(wearer(), &[channel(PLAIN); 3]);
    desk.must(Request::Wall(WALL));
    desk.must(Request::Arm);
}
