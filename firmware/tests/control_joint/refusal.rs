//! What a spec may not say, and its way over the wire.

use crate::control_joint::{point, two_point};
use firmware::control::{
    HoldPolicy, Joint, JointSpec, LawSpec, PointSpec, SensorSource, SpecError, SpecField,
};

/// Each wrong field by its name and what it allows.
#[test]
fn a_wrong_spec_is_refused_by_field() {
    use SpecField as F;
    let good = || two_point(LawSpec::PAPER);
    let law = |law| JointSpec { law, ..good() };
    let sliding = |lambda_milli, k1_milli, k2_milli, b_milli| {
        law(LawSpec::Recommended {
            lambda_milli,
            k1_milli,
            k2_milli,
            b_milli,
            k3_milli: 0,
            ki_milli: 0,
        })
    };
    let flexor = |p: PointSpec| JointSpec {
        flexors: [p].into_iter().collect(),
        ..good()
    };
    let adc = |code_at_0, code_at_100| JointSpec {
        sensor: SensorSource::Adc {
            code_at_0,
            code_at_100,
        },
        ..good()
    };
    let pid = |kp_milli, ki_milli, kd_milli| {
        law(LawSpec::Pid {
            kp_milli,
            ki_milli,
            kd_milli,
        })
    };
    let table = [
        (
            law(LawSpec::Paper {
                lambda_milli: 0,
                w_milli: 1,
            }),
            F::Lambda,
            1,
            100_000,
        ),
        (
            law(LawSpec::Paper {
                lambda_milli: 1,
                w_milli: 100_001,
            }),
            F::W,
            0,
            100_000,
        ),
        (sliding(99, 1, 100, 1000), F::Lambda, 100, 100_000),
        (sliding(100, 0, 100, 1000), F::K1, 1, 100_000),
        (sliding(100, 1, 9, 1000), F::K2, 10, 100_000),
        (sliding(100, 1, 100, u32::MAX), F::B, 1000, 1_000_000),
        (pid(100_001, 0, 0), F::Kp, 0, 100_000),
        (pid(0, 100_001, 0), F::Ki, 0, 100_000),
        (pid(0, 0, 100_001), F::Kd, 0, 100_000),
        (
            JointSpec {
                law_period_ms: 0,
                ..good()
            },
            F::LawPeriod,
            1,
            20,
        ),
        (
            JointSpec {
                law_period_ms: 21,
                ..good()
            },
            F::LawPeriod,
            1,
            20,
        ),
        (
            JointSpec {
                cutoff_mhz: 499,
                ..good()
            },
            F::Cutoff,
            500,
            20_000,
        ),
        (
            JointSpec {
                flexors: heapless::Vec::new(),
                ..good()
            },
            F::FlexorCount,
            1,
            2,
        ),
        (flexor(point(10, 1, 2)), F::Channel, 0, 9),
        (flexor(point(0, 1, 200_001)), F::Maximum, 0, 200_000),
        (flexor(point(0, 28_001, 28_000)), F::Threshold, 0, 28_000),
        (
            JointSpec {
                hold: HoldPolicy::Extrapolate { max_ms: 0 },
                ..good()
            },
            F::Extrapolation,
            1,
            1000,
        ),
        (
            JointSpec {
                angle_min_mdeg: i32::MIN,
                ..good()
            },
            F::AngleMin,
            -180_000,
            179_999,
        ),
        (
            JointSpec {
                angle_max_mdeg: 0,
                ..good()
            },
            F::AngleMax,
            1,
            180_000,
        ),
        (adc(4096, 0), F::CodeAt0, 0, 4095),
        (adc(0, 4096), F::CodeAt100, 0, 4095),
        (adc(2000, 2099), F::CodeSpan, 100, 4095),
        (
            JointSpec {
                stale_after_ms: 1,
                ..good()
            },
            F::StaleAfter,
            2,
            500,
        ),
    ];
    for (spec, field, min, max) in table {
        assert_eq!(
            Joint::new(&spec).err(),
            Some(SpecError::OutOfRange { field, min, max })
        );
    }
    let twice = flexor(point(2, 1, 2));
    assert_eq!(
        Joint::new(&twice).err(),
        Some(SpecError::ChannelTwice { channel: 2 })
    );
}

#[test]
fn a_spec_survives_the_wire() {
    let spec = two_point(LawSpec::ALONE);
    let mut buffer = [0; 128];
    let bytes = postcard::to_slice(&spec, &mut buffer).unwrap();
    assert_eq!(postcard::from_bytes::<JointSpec>(bytes).unwrap(), spec);
}
