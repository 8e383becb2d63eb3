//! Reports of a limit cycle to the host: first the lowered gain, then the fault.

use crate::device_desk::{ARM, OwnedResponse, PLAIN, TestHost, angle, channel, joint, wearer};
use firmware::link::{Event, Request};
use firmware::safety::Fault;
use firmware::units::Micros;

/// The joint moves 6° about 40° at 2.5 Hz for up to a minute, whatever its stimulation.
#[test]
fn a_swing_that_no_gain_ends_is_told_and_then_a_fault() {
    let mut desk = TestHost::open(Micros::new(u32::MAX - 3_000_000));
    desk.prepare(wearer(), &[channel(PLAIN); 2]);
    desk.expect_ok(joint(0, 1, 2_000, 10_000));
    desk.expect_ok(ARM);
    desk.measure(4_000);
    desk.expect_ok(Request::Start);
    let (mut gains, mut faulted) = (Vec::new(), None);
    for frame in 0..6_000 {
        let turn = f64::from(frame) * 0.010 * 2.5 * core::f64::consts::TAU;
        let at = desk.now();
        desk.send(angle(4_000));
        desk.send(Request::Measurement {
            joint: 0,
            centideg: (4_000.0 + 600.0 * turn.sin()) as i16,
            at,
        });
        desk.wait(10_000);
        for heard in desk.take_messages() {
            match heard {
                OwnedResponse::Event(
                    _,
                    Event::LimitCycle {
                        swing_centideg,
                        period_ms,
                        gain_milli,
                    },
                ) => {
                    assert!((900..=1_200).contains(&swing_centideg));
                    assert!((390..=410).contains(&period_ms));
                    gains.push(gain_milli);
                }
                OwnedResponse::Event(_, Event::Faulted(record)) => faulted = Some(record.fault),
                _ => {}
            }
        }
        if faulted.is_some() {
            break;
        }
    }
    assert_eq!(faulted, Some(Fault::LimitCycle));
    assert!(desk.isolated_since().is_some());
    assert!(gains.is_sorted_by(|a, b| a >= b), "{gains:?}");
    assert_eq!((gains.first(), gains.last()), (Some(&700), Some(&125)));
}
