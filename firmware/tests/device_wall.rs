//! The virtual wall on the device: configuration, refusals, output, and ends of stimulation.

use crate::device_desk::*;
use firmware::control::SensorSource;
use firmware::haptics::{CoContraction, PreWall, Side, WallSpec};
use firmware::link::{Code, Event, Request, Telemetry};
use firmware::safety::{Fault, State, StopCause};
use firmware::units::{Amplitude, Micros};

const BOOT: Micros = Micros::new(u32::MAX - 100_000);

/// Wall at 90° with 1 mA/°, 5 to 10 mA over the 9° before it, and 4 mA on the antagonist.
const WALL: WallSpec = WallSpec {
    at_mdeg: 90_000,
    side: Side::Flexion,
    channel: 0,
    max: Amplitude::new(20_000),
    stiffness: 1_000,
    damping: 0,
    cutoff_mhz: 10_000,
    pre_wall: Some(PreWall {
        depth_mdeg: 9_000,
        begin: Amplitude::new(5_000),
        end: Amplitude::new(10_000),
    }),
    co_contraction: Some(CoContraction {
        channel: 1,
        amplitude: Amplitude::new(4_000),
    }),
    angle_min_mdeg: 0,
    angle_max_mdeg: 150_000,
    sensor: SensorSource::Host,
    stale_after_ms: 40,
};

/// Configures two channels with a limit of 20 mA and `wall`, without arming.
fn with_wall(wall: WallSpec) -> TestHost {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN); 2]);
    desk.expect_ok(Request::Wall(wall));
    desk
}

/// Arms and starts with the limb at `centideg`.
fn running(wall: WallSpec, centideg: i16) -> TestHost {
    let mut desk = with_wall(wall);
    desk.expect_ok(Request::Subscribe { period_ms: 5 });
    desk.expect_ok(ARM);
    desk.measure(centideg);
    desk.expect_ok(Request::Start);
    desk
}

/// Holds the limb at `centideg` for 100 ms. Returns the last telemetry.
fn hold(desk: &mut TestHost, centideg: i16) -> Telemetry {
    for _ in 0..10 {
        desk.expect_ok(Request::KeepAlive);
        desk.measure(centideg);
        desk.wait(5_000);
    }
    desk.samples().pop().expect("telemetry was subscribed to")
}

#[test]
fn depth_becomes_amplitude_and_telemetry_shows_both() {
    let mut desk = running(WALL, 8_000);
    let outside = hold(&mut desk, 8_000);
    assert_eq!(outside.amplitudes, [None, None]);
    assert_eq!(outside.reference_centideg, Some(9_000));
    assert_eq!(outside.measured_centideg, Some(8_000));
    assert_eq!(outside.effort_milli, Some(-10_000));
    // In the middle of the pre-wall.
    let near = hold(&mut desk, 8_550);
    assert!(
        (7_499..=7_500).contains(&near.amplitudes[0].unwrap().get()),
        "{near:?}"
    );
    assert_eq!(near.amplitudes[1], None);
    let inside = hold(&mut desk, 9_500);
    assert_eq!(
        inside.amplitudes,
        [Some(Amplitude::new(15_000)), Some(Amplitude::new(4_000))]
    );
    assert_eq!(inside.effort_milli, Some(5_000));
    assert!(!inside.limiting);
    let deep = hold(&mut desk, 11_000);
    assert_eq!(deep.amplitudes[0], Some(Amplitude::new(20_000)));
    assert!(deep.limiting);
    // Outside the wall the output is silent, and telemetry reports that.
    let out = hold(&mut desk, 8_000);
    assert_eq!(out.amplitudes, [None, None]);
    let last = *driven_starts(&desk.record.levels, 0).last().unwrap();
    assert!(desk.since_boot_us() - last > 60_000);
    // 15 mA of 100 mA full scale were emitted.
    let codes: Vec<u16> = desk.record.dac.iter().map(|d| d.2).collect();
    assert!(codes.contains(&9_830));
}

#[test]
fn the_boards_converter_feeds_the_wall_by_the_same_path() {
    let mut desk = with_wall(WallSpec {
        sensor: SensorSource::Adc {
            code_at_0: 500,
            code_at_100: 2_500,
        },
        ..WALL
    });
    desk.sensors.joint = Some(500 + 20 * 95);
    desk.expect_ok(Request::Subscribe { period_ms: 5 });
    desk.start();
    desk.keep_alive(10, 10_000);
    let seen = desk.samples().pop().unwrap();
    assert_eq!(seen.measured_centideg, Some(9_500));
    assert_eq!(
        seen.amplitudes,
        [Some(Amplitude::new(15_000)), Some(Amplitude::new(4_000))]
    );
    let at = desk.now();
    let host = Request::Measurement {
        joint: 0,
        centideg: 0,
        at,
    };
    assert_eq!(desk.expect_refusal(host).0, Code::SensorNotHost);
}

#[test]
fn a_silent_host_ends_a_wall_whatever_it_measures() {
    let mut desk = running(WALL, 9_500);
    hold(&mut desk, 9_500);
    for _ in 0..20 {
        desk.measure(9_500);
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
    desk.keep_alive(10, 10_000);
    assert_eq!(desk.fault(), Some(Fault::SensorStale));
    let mut desk = running(WALL, 9_500);
    desk.measure(17_001);
    desk.wait(5_000);
    assert_eq!(desk.fault(), Some(Fault::SensorRange));
}

#[test]
fn a_stop_lets_the_wall_fall_and_the_channels_are_its_own() {
    let mut desk = running(WALL, 9_500);
    hold(&mut desk, 9_500);
    assert_eq!(
        desk.expect_refusal(equal_amplitudes(1, 1_000)).0,
        Code::Controlled
    );
    desk.expect_ok(Request::Stop);
    desk.wait(200_000);
    assert!(has_event(
        &desk.take_messages(),
        Event::Stopped(StopCause::Request)
    ));
}

#[test]
fn arming_names_what_does_not_fit() {
    type Change = fn(&mut WallSpec);
    fn changed(change: Change) -> WallSpec {
        let mut wall = WALL;
        change(&mut wall);
        wall
    }
    fn other(wall: &mut WallSpec) -> &mut CoContraction {
        wall.co_contraction.as_mut().unwrap()
    }
    #[rustfmt::skip]
    let at_arming: [(Change, Code, &str); 4] = [
        (|w| w.max = Amplitude::new(20_001), Code::AboveWearerLimit, "max"),
        (|w| other(w).amplitude = Amplitude::new(20_001), Code::AboveWearerLimit, "amplitude"),
        (|w| w.channel = 5, Code::NoTrain, "wall"),
        (|w| other(w).channel = 9, Code::NoTrain, "wall"),
    ];
    for (change, code, field) in at_arming {
        let mut desk = with_wall(changed(change));
        assert_eq!(desk.expect_refusal(ARM), refusal(code, field));
    }
    // Mistakes that no setup could make valid are refused at once.
    let mut desk = TestHost::open(BOOT);
    let at_once: [(Change, Code, &str); 4] = [
        (|w| w.stiffness = 0, Code::OutOfRange, "stiffness"),
        (|w| w.at_mdeg = -1, Code::OutOfRange, "at_mdeg"),
        (|w| w.stale_after_ms = 0, Code::OutOfRange, "stale_after_ms"),
        (|w| other(w).channel = 0, Code::ChannelTwice, "wall"),
    ];
    for (change, code, field) in at_once {
        let wall = Request::Wall(changed(change));
        assert_eq!(desk.expect_refusal(wall), refusal(code, field));
    }
}

#[test]
fn a_joint_and_a_wall_do_not_go_together() {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN); 3]);
    desk.expect_ok(Request::Wall(WALL));
    desk.expect_ok(joint(2, 1, 2_000, 10_000));
    let expected = refusal(Code::JointAndWall, "wall");
    assert_eq!(desk.expect_refusal(ARM), expected);
    desk.expect_ok(Request::Clear);
    desk.prepare(wearer(), &[channel(PLAIN); 3]);
    desk.expect_ok(Request::Wall(WALL));
    desk.expect_ok(ARM);
}
