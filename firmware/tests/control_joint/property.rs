//! Properties of every accepted specification, with arbitrary inputs.

use crate::control_joint::{degrees, point};
use firmware::control::super_twisting::SuperTwisting;
use firmware::control::{
    HoldPolicy, Joint, JointSpec, JointState, LawSpec, PointSpec, SensorSource,
};
use firmware::units::{Amplitude, Angle, AngularRate, Micros, us};
use fixed::types::I16F16;
use proptest::prelude::*;

fn any_law() -> impl Strategy<Value = LawSpec> {
    let gain = |low: u32| prop_oneof![Just(low), low..=100_000_u32, Just(100_000)];
    prop_oneof![
        (gain(1), gain(0)).prop_map(|(lambda_milli, w_milli)| LawSpec::Paper {
            lambda_milli,
            w_milli
        }),
        (
            gain(100),
            gain(1),
            gain(10),
            1000..=1_000_000_u32,
            gain(0),
            gain(0)
        )
            .prop_map(|(lambda_milli, k1, k2_milli, b_milli, k3, ki_milli)| {
                // The upper bounds are those of the slowest period.
                LawSpec::Recommended {
                    lambda_milli,
                    k1_milli: k1.min(SuperTwisting::k1_milli(b_milli, 20).max.cast_unsigned()),
                    k2_milli,
                    b_milli,
                    k3_milli: k3.min(SuperTwisting::k3_milli(b_milli, 20).max.cast_unsigned()),
                    ki_milli,
                }
            }),
        (gain(0), gain(0), gain(0)).prop_map(|(kp_milli, ki_milli, kd_milli)| LawSpec::Pid {
            kp_milli,
            ki_milli,
            kd_milli
        }),
    ]
}

fn any_point() -> impl Strategy<Value = PointSpec> {
    (0..=9_u8, 0..=200_000_u32, 0..=200_000_u32)
        .prop_map(|(channel, a, b)| point(channel, a.min(b), a.max(b)))
}

fn any_spec() -> impl Strategy<Value = JointSpec> {
    let hold = prop_oneof![
        Just(HoldPolicy::Hold),
        (1..=1000_u16).prop_map(|max_ms| HoldPolicy::Extrapolate { max_ms })
    ];
    let sensor = prop_oneof![
        Just(SensorSource::Host),
        (0..=4095_u16, 0..=4095_u16).prop_map(|(code_at_0, code_at_100)| SensorSource::Adc {
            code_at_0,
            code_at_100
        }),
    ];
    let angles = (-180_000..180_000_i32, -180_000..=180_000_i32);
    let points = (proptest::collection::vec(any_point(), 1..=2), any_point());
    let timing = (1..=20_u8, 500..=20_000_u32, 2..=500_u16);
    (any_law(), points, angles, hold, sensor, timing).prop_map(
        |(
            law,
            (flexors, extensor),
            (a, b),
            hold,
            sensor,
            (law_period_ms, cutoff_mhz, stale_after_ms),
        )| {
            JointSpec {
                law,
                law_period_ms,
                cutoff_mhz,
                flexors: flexors.into_iter().collect(),
                extensor,
                hold,
                angle_min_mdeg: a.min(b),
                angle_max_mdeg: a.max(b),
                sensor,
                stale_after_ms,
                wearer: None,
                response: None,
            }
        },
    )
}

/// Generates one event of a joint: kind, preceding gap in µs, offset of its time stamp, an angle
/// and a rate in raw bits.
fn any_event() -> impl Strategy<Value = (u8, u32, i32, i32, Option<i32>)> {
    let gap = prop_oneof![60 => 0..5000_u32, 1 => any::<u32>()];
    let offset = prop_oneof![20 => -5000..5000_i32, 1 => any::<i32>()];
    let bits = prop_oneof![4 => -13_000_000..13_000_000_i32, 1 => any::<i32>()];
    (0..6_u8, gap, offset, bits, any::<Option<i32>>())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// No accepted specification and no input causes a panic (overflow checks are on), every
    /// channel appears once, and the amplitudes are either 0 on all channels or between threshold
    /// and maximum on each.
    #[test]
    fn amplitudes_stay_within_the_wearers_range(
        spec in any_spec(),
        start in any::<u32>(),
        events in proptest::collection::vec(any_event(), 1..80),
    ) {
        let Ok(joint) = Joint::new(&spec) else { return Ok(()) };
        let points: Vec<PointSpec> = spec.flexors.iter().copied().chain([spec.extensor]).collect();
        let mut state = JointState::default();
        let mut now = Micros::new(start);
        let middle = f64::from(spec.angle_min_mdeg / 2 + spec.angle_max_mdeg / 2) / 1000.0;
        joint.accept_setpoint(&mut state, now, now, degrees(middle), None).unwrap();
        let _ = joint.accept_measurement(&mut state, now, now, degrees(middle));
        for (kind, gap, offset, bits, rate) in events {
            now += us(gap);
            let at = now + us(offset.cast_unsigned());
            let angle = Angle::new(I16F16::from_bits(bits));
            let rate = rate.map(|r| AngularRate::new(I16F16::from_bits(r)));
            match kind {
                0 => { let _ = joint.accept_setpoint(&mut state, now, at, angle, rate); }
                1 => { let _ = joint.accept_measurement(&mut state, now, at, angle); }
                2 => { let _ = joint.angle_from_code(bits as u16); }
                _ => {
                    let reading = (kind == 3).then_some(angle);
                    let Ok(orders) = joint.tick(&mut state, now, reading) else { continue };
                    prop_assert_eq!(orders.amplitudes.len(), points.len());
                    let silent = orders.amplitudes.iter().all(|(_, a)| *a == Amplitude::ZERO);
                    for ((channel, a), p) in orders.amplitudes.iter().zip(&points) {
                        prop_assert_eq!(*channel, p.channel);
                        prop_assert!(silent || (p.threshold <= *a && *a <= p.max));
                    }
                    let working = orders.amplitudes.iter().zip(&points)
                        .map(|((_, a), p)| *a > p.threshold).collect::<Vec<_>>();
                    let flexes = working[..points.len() - 1].contains(&true);
                    prop_assert!(!(flexes && working[points.len() - 1]), "both sides work");
                }
            }
        }
    }
}
