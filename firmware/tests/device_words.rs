//! What a client written from docs/protocol.md alone relies on.

use crate::device_desk::*;
use crate::device_force::{BOOT, FORCE, SLOW, control, force, muscle};
use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::haptics::{Side, WallSpec};
use firmware::link::{Code, Event, Request, Telemetry};
use firmware::safety::{Fault, State, StopCause, WearerSpec};
use firmware::units::{Amplitude, Micros};

fn samples(heard: Vec<Heard>) -> Vec<Telemetry> {
    let sample = |heard| match heard {
        Heard::Telemetry(sample) => Some(sample),
        _ => None,
    };
    heard.into_iter().filter_map(sample).collect()
}

/// Stimulating with channel 0 under force control.
fn following() -> Desk {
    let mut desk = Desk::open(BOOT);
    let wearer = WearerSpec {
        host_timeout_ms: 1_000,
        ..wearer()
    };
    desk.prepare(wearer, &[channel(SLOW)]);
    desk.must(muscle(0));
    desk.must(control(0, FORCE));
    desk.must(Request::Subscribe { period_ms: 1 });
    desk.must(Request::Arm);
    desk.must(Request::Start);
    desk
}

fn code(desk: &mut Desk, request: Request) -> Option<Code> {
    let refusal = desk.answer(request).err()?;
    Code::from_number(refusal.0)
}

#[test]
fn telemetry_gives_back_the_force_that_was_asked() {
    let mut desk = following();
    for wanted in 1..=2_000 {
        desk.send(force(0, wanted));
        desk.wait(2_000);
        let last = samples(desk.heard()).pop().expect("a sample each ms");
        assert_eq!(last.force_control[0].target_mn, Some(wanted));
    }
}

#[test]
fn a_mask_of_nothing_does_not_keep_the_host_from_being_silent() {
    let nothing = || Request::Amplitudes {
        mask: 0,
        values: heapless::Vec::new(),
    };
    let mut desk = Desk::open(BOOT);
    let refused = Err((Code::OutOfRange as u16, "mask".to_owned()));
    assert_eq!(desk.answer(nothing()), refused);
    desk.run(wearer(), &[channel(PLAIN)], 10_000);
    let setpoints = desk.status().counters.setpoints;
    desk.heard();
    let mut heard = Vec::new();
    for _ in 0..110 {
        desk.send(nothing());
        desk.wait(10_000);
        heard.extend(desk.heard());
    }
    let silent = |h: &Heard| matches!(h, Heard::Event(_, Event::Stopping(StopCause::HostSilent)));
    assert!(heard.iter().any(silent));
    assert_eq!(desk.status().counters.setpoints, setpoints);
}

/// The ninth stop of a window has no place to wait for the window's time.
#[test]
fn twelve_stops_are_acknowledged_eight_with_the_windows_time() {
    let mut desk = Desk::open(BOOT);
    desk.run(wearer(), &[channel(PLAIN)], 10_000);
    desk.wait(100);
    desk.heard();
    let arrived = desk.now();
    let numbers: Vec<u16> = (desk.seq..).take(12).collect();
    let stops = numbers.iter();
    let bytes: Vec<u8> = stops
        .flat_map(|&seq| frame(desk.session, seq, Request::Stop))
        .collect();
    desk.board
        .receive(arrived, &bytes, &desk.sensors, &mut desk.record);
    desk.wait(1_000);
    let heard = desk.heard();
    let at = |seq| {
        heard.iter().find_map(|h| match h {
            Heard::Ack(s, at) if *s == seq => Some(*at),
            _ => None,
        })
    };
    let began = heard.iter().find_map(|h| match h {
        Heard::Event(at, Event::Stopping(StopCause::Request)) => Some(*at),
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
    desk.must(force(0, 2_000));
    desk.wait(20_000);
    desk.must(Request::Stop);
    assert_eq!(desk.state(), State::Stopping);
    assert_eq!(desk.answer(force(0, 2_500)), Ok(()));
    desk.wait(200_000);
    assert_eq!(desk.state(), State::Idle);
    assert_eq!(code(&mut desk, force(0, 100)), Some(Code::NotArmed));
}

#[test]
fn an_untimed_force_while_a_timed_one_waits_is_out_of_order() {
    let mut desk = following();
    let at = Some(desk.now().plus(50_000));
    desk.must(Request::Force {
        channel: 0,
        at,
        millinewton: 1_000,
        millinewton_per_s: None,
    });
    assert_eq!(code(&mut desk, force(0, 900)), Some(Code::SetpointTime));
    desk.wait(60_000);
    assert_eq!(code(&mut desk, force(0, 900)), None);
}

fn wall() -> Request {
    Request::Wall(WallSpec {
        at_mdeg: 10_000,
        side: Side::Flexion,
        channel: 0,
        max: Amplitude(10_000),
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

fn joint() -> Request {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude(5_000),
        max: Amplitude(10_000),
    };
    Request::Joint(JointSpec {
        law: LawSpec::ALONE,
        law_period_ms: 2,
        cutoff_mhz: 17_000,
        flexors: heapless::Vec::from_slice(&[point(0)]).unwrap(),
        extensor: point(1),
        hold: HoldPolicy::Hold,
        angle_min_mdeg: 0,
        angle_max_mdeg: 90_000,
        sensor: SensorSource::Host,
        stale_after_ms: 40,
        wearer: None,
        response: None,
    })
}

/// The host measures, and never has: nothing is put out, however long; one
/// measurement, and its age counts.
#[test]
fn without_a_first_measurement_nothing_is_played() {
    for request in [wall(), joint()] {
        let is_joint = matches!(request, Request::Joint(_));
        let mut desk = Desk::open(BOOT);
        desk.prepare(wearer(), &[channel(PLAIN); 2]);
        desk.must(request);
        desk.must(Request::Arm);
        desk.must(Request::Start);
        let checked = desk.status().counters.pulses;
        for _ in 0..100 {
            desk.must(Request::KeepAlive);
            if is_joint {
                desk.must(Request::Angle {
                    at: None,
                    centideg: 6_000,
                    centideg_per_s: None,
                });
            }
            desk.wait(8_000);
        }
        assert_eq!(desk.state(), State::Stimulating);
        assert_eq!(desk.status().counters.pulses, checked);
        let at: Micros = desk.now();
        desk.must(Request::Measurement {
            joint: 0,
            centideg: 3_000,
            at,
        });
        for _ in 0..6 {
            desk.must(Request::KeepAlive);
            desk.wait(8_000);
        }
        let status = desk.status();
        assert!(status.counters.pulses > checked);
        assert_eq!(status.fault.map(|f| f.fault), Some(Fault::SensorStale));
    }
}
