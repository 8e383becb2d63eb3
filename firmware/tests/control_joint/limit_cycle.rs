//! Limit cycles that no lower gain ends, and oscillations that are not caused by the loop.

use crate::control_joint::{RunningJoint, two_point};
use firmware::control::{JointSpec, LawSpec, LimitCycle};
use firmware::units::{Micros, us};
use std::f64::consts::TAU;

/// Returns the limit cycles that the joint detects within `ms`, from references and angles in
/// degrees as functions of time in s.
fn find_limit_cycles(
    law: LawSpec,
    ms: u32,
    wanted: impl Fn(f64) -> f64,
    angle: impl Fn(f64) -> f64,
) -> Vec<LimitCycle> {
    let mut worn = RunningJoint::new(&JointSpec {
        law_period_ms: law.default_period_ms(),
        cutoff_mhz: law.default_cutoff_mhz(),
        ..two_point(law)
    });
    let mut now = Micros::new(u32::MAX - 5_000_000);
    let mut cycles = Vec::new();
    for ms in 0..ms {
        let t = f64::from(ms) / 1000.0;
        worn.measure_now(now, angle(t));
        if ms % 11 == 0 {
            worn.set_reference(now, now, wanted(t));
        }
        worn.tick(now).unwrap();
        cycles.extend(worn.state.take_limit_cycle());
        now += us(1000);
    }
    cycles
}

/// The joint is moved from outside at 2.5 Hz.
#[test]
fn a_swing_that_no_gain_ends_lowers_it_to_the_floor_and_then_stops() {
    for (law, wide) in [
        (LawSpec::RECOMMENDED, 6.0),
        (LawSpec::ALONE, 6.0),
        (LawSpec::PID, 6.0),
        (LawSpec::RECOMMENDED, 2.0),
    ] {
        let shaken = |t: f64| 40.0 + wide * (2.5 * TAU * t).sin();
        let cycles = find_limit_cycles(law, 60_000, |_| 40.0, shaken);
        let gains: Vec<_> = cycles.iter().map(|cycle| cycle.gain_milli).collect();
        assert!(
            cycles
                .iter()
                .all(|cycle| cycle.period_ms.abs_diff(400) <= 8)
        );
        let swing = cycles[0].swing.get().to_num::<f64>() / (2.0 * wide);
        assert!((0.8..1.0).contains(&swing), "{swing}");
        assert_eq!(gains[0], Some(700));
        assert!(gains.is_sorted_by(|a, b| a >= b));
        // A swing of 5° may continue at the lowest gain, a larger one may not.
        let last = if wide > 2.5 { None } else { Some(125) };
        assert_eq!(gains.last(), Some(&last), "{gains:?}");
    }
}

#[test]
fn the_papers_law_swings_as_it_does_in_print() {
    let shaken = |t: f64| 40.0 + 6.0 * (2.5 * TAU * t).sin();
    assert_eq!(
        find_limit_cycles(LawSpec::PAPER, 20_000, |_| 40.0, shaken),
        []
    );
}

/// The finger follows a moving reference late and not far enough, with harmonics.
#[test]
fn a_targets_own_course_is_no_limit_cycle() {
    for hz in [0.1, 0.2, 0.3, 0.5, 1.0] {
        for harmonic in [1.0, 2.0, 3.0] {
            let wanted = |t: f64| 45.0 + 35.0 * (hz * TAU * t).sin();
            let angle = |t: f64| {
                let lags = 45.0 + 30.0 * (hz * TAU * (t - 0.1)).sin();
                lags + 3.0 * (harmonic * hz * TAU * t).cos()
            };
            assert_eq!(
                find_limit_cycles(LawSpec::RECOMMENDED, 40_000, wanted, angle),
                []
            );
        }
    }
    // Steps back and forth, and up a staircase, with an overshoot.
    let ring = |t: f64| (-t * 6.0).exp() * (3.0 * TAU * t).cos();
    for stays in [0.3, 0.5, 1.0, 2.0] {
        let square = |t: f64| {
            if ((t / stays) as u32).is_multiple_of(2) {
                30.0
            } else {
                50.0
            }
        };
        let angle = |t: f64| square(t) - (square(t) - 40.0) * 2.0 * ring(t % stays);
        assert_eq!(
            find_limit_cycles(LawSpec::RECOMMENDED, 30_000, square, angle),
            []
        );
        let stair = |t: f64| 10.0 + 3.0 * ((t / stays) as u32 % 20) as f64;
        let angle = |t: f64| stair(t) - 3.0 * ring(t % stays);
        assert_eq!(
            find_limit_cycles(LawSpec::RECOMMENDED, 30_000, stair, angle),
            []
        );
    }
}
