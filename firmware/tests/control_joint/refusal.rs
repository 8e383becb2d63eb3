//! Refused specifications, and their encoding on the link.

use crate::control_joint::{point, two_point};
use firmware::control::{
    HoldPolicy, Joint, JointSpec, LawSpec, PointSpec, SensorSource, SpecError, WearerModel,
};
use firmware::range::OutOfRange;

/// Returns the error of a valid specification after one change.
fn spec_error(change: impl FnOnce(&mut JointSpec)) -> Option<SpecError> {
    let mut spec = two_point(LawSpec::PAPER);
    change(&mut spec);
    Joint::new(&spec).err()
}

fn law(law: LawSpec) -> Option<SpecError> {
    spec_error(|spec| spec.law = law)
}

fn paper(lambda_milli: u32, w_milli: u32) -> Option<SpecError> {
    law(LawSpec::Paper {
        lambda_milli,
        w_milli,
    })
}

fn sliding([lambda_milli, k1_milli, k2_milli, b_milli, k3_milli]: [u32; 5]) -> Option<SpecError> {
    law(LawSpec::Recommended {
        lambda_milli,
        k1_milli,
        k2_milli,
        b_milli,
        k3_milli,
        ki_milli: 0,
    })
}

fn pid(kp_milli: u32, ki_milli: u32, kd_milli: u32) -> Option<SpecError> {
    law(LawSpec::Pid {
        kp_milli,
        ki_milli,
        kd_milli,
    })
}

fn flexor(point: PointSpec) -> Option<SpecError> {
    spec_error(|spec| spec.flexors = [point].into_iter().collect())
}

fn adc(code_at_0: u16, code_at_100: u16) -> Option<SpecError> {
    spec_error(|spec| {
        spec.sensor = SensorSource::Adc {
            code_at_0,
            code_at_100,
        }
    })
}

/// Each wrong field is refused with its name, its value and the allowed range.
#[test]
fn a_wrong_spec_is_refused_by_field() {
    const BIG: u32 = u32::MAX;
    #[rustfmt::skip]
    let table = [
        (paper(0, 1), "lambda_milli", 0, 1, 100_000),
        (paper(1, 100_001), "w_milli", 100_001, 0, 100_000),
        (sliding([99, 1, 100, 1000, 0]), "lambda_milli", 99, 100, 100_000),
        (sliding([100, 0, 100, 1000, 0]), "k1_milli", 0, 1, 100_000),
        (sliding([100, 1, 9, 1000, 0]), "k2_milli", 9, 10, 100_000),
        (sliding([100, 1, 100, BIG, 0]), "b_milli", BIG.into(), 1000, 1_000_000),
        // Limits at 11 ms: h·b·k1 <= 200, h·b·k3 <= 7.
        (sliding([100, 18_182, 100, 1_000_000, 0]), "k1_milli", 18_182, 1, 18_181),
        (sliding([100, 1, 100, 1_000_000, 637]), "k3_milli", 637, 0, 636),
        (pid(100_001, 0, 0), "kp_milli", 100_001, 0, 100_000),
        (pid(0, 100_001, 0), "ki_milli", 100_001, 0, 100_000),
        (pid(0, 0, 100_001), "kd_milli", 100_001, 0, 100_000),
        (spec_error(|s| s.law_period_ms = 0), "law_period_ms", 0, 1, 20),
        (spec_error(|s| s.law_period_ms = 21), "law_period_ms", 21, 1, 20),
        (spec_error(|s| s.cutoff_mhz = 499), "cutoff_mhz", 499, 500, 20_000),
        (spec_error(|s| s.flexors.clear()), "flexors", 0, 1, 2),
        (flexor(point(10, 1, 2)), "channel", 10, 0, 9),
        (flexor(point(0, 1, 200_001)), "max", 200_001, 0, 200_000),
        (flexor(point(0, 28_001, 28_000)), "threshold", 28_001, 0, 28_000),
        (spec_error(|s| s.hold = HoldPolicy::Extrapolate { max_ms: 0 }), "max_ms", 0, 1, 1000),
        (spec_error(|s| s.angle_min_mdeg = i32::MIN), "angle_min_mdeg", i32::MIN.into(), -180_000, 179_999),
        (spec_error(|s| s.angle_max_mdeg = 0), "angle_max_mdeg", 0, 1, 180_000),
        (adc(4096, 0), "code_at_0", 4096, 0, 4095),
        (adc(0, 4096), "code_at_100", 4096, 0, 4095),
        (adc(2000, 2099), "code_at_100 - code_at_0", 99, 100, 4095),
        (spec_error(|s| s.stale_after_ms = 1), "stale_after_ms", 1, 2, 500),
    ];
    for (refused, field, value, min, max) in table {
        let range = OutOfRange {
            field,
            value,
            min,
            max,
        };
        assert_eq!(refused, Some(SpecError::Range(range)));
    }
    let twice = flexor(point(2, 1, 2));
    assert_eq!(twice, Some(SpecError::ChannelTwice { channel: 2 }));
}

#[test]
fn a_spec_survives_the_wire() {
    let spec = two_point(LawSpec::ALONE);
    let mut buffer = [0; 128];
    let bytes = postcard::to_slice(&spec, &mut buffer).unwrap();
    assert_eq!(postcard::from_bytes::<JointSpec>(bytes).unwrap(), spec);
}

/// Accepts a quarter to four times the reference wearer's strength, 4033 mrad.
#[test]
fn a_wearer_outside_the_strengths_that_were_tried_is_refused() {
    let spec = |law, stiffness_unm_per_rad| JointSpec {
        wearer: Some(WearerModel {
            rest_mdeg: 5_000,
            stiffness_unm_per_rad,
            damping_unm_s_per_rad: 18_000,
            flexion_unm: 484_000,
            extension_unm: 150_000,
            torque_loss_milli: 250,
            curvature_milli: 1_200,
            lead_ms: 220,
        }),
        ..two_point(law)
    };
    let (min, max) = (30_003, 480_158);
    for law in [LawSpec::RECOMMENDED, LawSpec::PID, LawSpec::PAPER] {
        for (stiffness, is_tried) in [
            (0, false),
            (min - 1, false),
            (min, true),
            (max, true),
            (max + 1, false),
        ] {
            let refused = Joint::new(&spec(law, stiffness as u32)).err();
            let expected = SpecError::Range(OutOfRange {
                field: "stiffness_unm_per_rad",
                value: stiffness.into(),
                min,
                max,
            });
            let is_refused = !is_tried && law != LawSpec::PAPER;
            assert_eq!(
                refused,
                is_refused.then_some(expected),
                "{law:?} {stiffness}"
            );
        }
    }
}
