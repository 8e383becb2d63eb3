//! Setpoints: hold, extrapolation, order, and wrapping of time.

use crate::control_joint::{degrees, two_point};
use firmware::control::setpoint::{HORIZON_US, SetpointTrack};
use firmware::control::{HoldPolicy, Joint, JointState, LawSpec, SetpointError};
use firmware::units::{AngularRate, Micros, us};
use fixed::types::I16F16;

#[test]
fn a_track_holds_or_goes_on_for_a_while() {
    let go_on = HoldPolicy::Extrapolate { max_ms: 50 };
    let t = Micros::new(u32::MAX - 20_000);
    let rate = |deg| Some(AngularRate::new(I16F16::from_num(deg)));
    // Columns: given rate, wait in ms, policy, expected angle.
    let table = [
        (rate(100), 0, go_on, 10.0),
        (rate(100), 25, go_on, 12.5),
        (rate(100), 50, go_on, 15.0),
        (rate(100), 900, go_on, 15.0),
        (rate(100), 900, HoldPolicy::Hold, 10.0),
        (rate(-100), 30, go_on, 7.0),
        (None, 25, go_on, 10.0),
    ];
    for (rate, wait, policy, expected) in table {
        let mut track = SetpointTrack::default();
        track.accept(t, t, degrees(10.0), rate).unwrap();
        assert_eq!(track.value_at(t - us(1), policy), None);
        assert_eq!(
            track.value_at(t + us(wait * 1000), policy),
            Some(degrees(expected))
        );
    }
    // Of two setpoints 10 ms apart, 2° are motion (200 °/s) and 20° are a step.
    for (second, expected) in [(12.0, 16.0), (30.0, 30.0)] {
        let mut track = SetpointTrack::default();
        track.accept(t, t, degrees(10.0), None).unwrap();
        track
            .accept(t, t + us(10_000), degrees(second), None)
            .unwrap();
        assert_eq!(
            track.value_at(t + us(30_000), go_on),
            Some(degrees(expected))
        );
    }
}

#[test]
fn a_track_keeps_its_angle_for_hours_and_then_listens() {
    let mut track = SetpointTrack::default();
    let mut now = Micros::new(7);
    track.accept(now, now, degrees(10.0), None).unwrap();
    for _ in 0..400 {
        now += us(30_000_000);
        assert_eq!(track.value_at(now, HoldPolicy::Hold), Some(degrees(10.0)));
    }
    track.accept(now, now, degrees(20.0), None).unwrap();
    assert_eq!(track.value_at(now, HoldPolicy::Hold), Some(degrees(20.0)));
}

#[test]
fn setpoints_out_of_place_are_refused_by_name() {
    let joint = Joint::new(&two_point(LawSpec::PAPER)).unwrap();
    let mut state = JointState::default();
    let now = Micros::new(100);
    let mut set =
        |at: Micros, deg: f64| joint.accept_setpoint(&mut state, now, at, degrees(deg), None);
    let range = SetpointError::OutOfRange {
        min_mdeg: 0,
        max_mdeg: 100_000,
    };
    assert_eq!(set(now, -0.1), Err(range));
    assert_eq!(set(now, 100.1), Err(range));
    assert_eq!(
        set(now + us(HORIZON_US + 1), 1.0),
        Err(SetpointError::TooFarAhead)
    );
    assert_eq!(
        set(now - us(HORIZON_US + 1), 1.0),
        Err(SetpointError::TooOld)
    );
    // The first setpoint is due at once; eight more may wait.
    for i in 0..9 {
        assert_eq!(set(now + us(i * 1000), 1.0), Ok(()));
    }
    assert_eq!(set(now + us(8000), 1.0), Err(SetpointError::OutOfOrder));
    assert_eq!(set(now + us(9000), 1.0), Err(SetpointError::TooManyWaiting));
}
