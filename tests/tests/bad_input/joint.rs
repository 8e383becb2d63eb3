//! Requests of a joint: controller, mapping, sensor.

use crate::bad_input::bench::{Bench, joint};
use crate::bad_input::table::{Edit, Expect, Row, all, edit, field, refused, row};
use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::link::{Code, Request};
use firmware::units::Amplitude;
use tests::desk;

pub fn rows() -> Vec<Row> {
    all([
        law_rows(),
        plain_rows(),
        point_rows(),
        sensor_rows(),
        arm_rows(),
    ])
}

/// Returns rows of a field that `edit` sets, if it can hold the number.
fn rows_of(name: &'static str, min: i32, max: i32, edit: Edit<JointSpec>) -> Vec<Row> {
    let joint = || joint(SensorSource::Host);
    field(Bench::draft, name, min, max).edits(joint, edit, Request::Joint)
}

#[rustfmt::skip]
fn law_rows() -> Vec<Row> {
    macro_rules! law {
        ($field:literal, $min:literal, $max:literal, $v:ident => $law:expr) => {
            rows_of($field, $min, $max, edit!(s, v => {
                let $v = v.try_into().ok()?;
                s.law = $law;
            }))
        };
    }
    all([
        law!("lambda_milli", 1, 100_000, v => LawSpec::Paper { lambda_milli: v, w_milli: 1_000 }),
        law!("w_milli", 0, 100_000, v => LawSpec::Paper { lambda_milli: 1_000, w_milli: v }),
        law!("lambda_milli", 100, 100_000, v => recommended(v, 605, 6_620, 91_600)),
        law!("k1_milli", 1, 100_000, v => recommended(12_700, v, 6_620, 91_600)),
        law!("k2_milli", 10, 100_000, v => recommended(12_700, 605, v, 91_600)),
        law!("b_milli", 1_000, 1_000_000, v => recommended(12_700, 605, 6_620, v)),
        law!("kp_milli", 0, 100_000, v => LawSpec::Pid { kp_milli: v, ki_milli: 1, kd_milli: 1 }),
        law!("ki_milli", 0, 100_000, v => LawSpec::Pid { kp_milli: 1, ki_milli: v, kd_milli: 1 }),
        law!("kd_milli", 0, 100_000, v => LawSpec::Pid { kp_milli: 1, ki_milli: 1, kd_milli: v }),
    ])
}

fn recommended(lambda_milli: u32, k1_milli: u32, k2_milli: u32, b_milli: u32) -> LawSpec {
    LawSpec::Recommended {
        lambda_milli,
        k1_milli,
        k2_milli,
        b_milli,
        k3_milli: 0,
        ki_milli: 0,
    }
}

#[rustfmt::skip]
fn plain_rows() -> Vec<Row> {
    all([
        rows_of("law_period_ms", 1, 20, edit!(s, v => s.law_period_ms = v.try_into().ok()?)),
        rows_of("cutoff_mhz", 500, 20_000, edit!(s, v => s.cutoff_mhz = v.try_into().ok()?)),
        rows_of("stale_after_ms", 2, 500, edit!(s, v => s.stale_after_ms = v.try_into().ok()?)),
        rows_of("angle_min_mdeg", -180_000, 179_999, edit!(s, v => {
            s.angle_max_mdeg = 180_000;
            s.angle_min_mdeg = v.try_into().ok()?;
        })),
        rows_of("angle_max_mdeg", 30_001, 180_000, edit!(s, v => {
            s.angle_min_mdeg = 30_000;
            s.angle_max_mdeg = v.try_into().ok()?;
        })),
        rows_of("max_ms", 1, 1_000, edit!(s, v => s.hold = HoldPolicy::Extrapolate { max_ms: v.try_into().ok()? })),
    ])
}

fn edited(edit: impl Fn(&mut JointSpec)) -> JointSpec {
    let mut spec = joint(SensorSource::Host);
    edit(&mut spec);
    spec
}

#[rustfmt::skip]
fn point_rows() -> Vec<Row> {
    let none = edited(|s| s.flexors.clear());
    let two = edited(|s| s.flexors.push(PointSpec { channel: 2, ..s.extensor }).unwrap());
    let twice = edited(|s| s.extensor.channel = 0);
    let points = |name, spec, expect| row(name, Bench::draft, Request::Joint(spec), expect);
    let rows = vec![
        points("no flexor", none, refused(Code::OutOfRange, "flexors").allowed(1, 2)),
        points("two flexors", two, Expect::Done),
        points("flexor and extensor on one channel", twice, refused(Code::ChannelTwice, "joint").on(1)),
    ];
    all([
        rows,
        // The other channel avoids 0 and 9.
        rows_of("channel", 0, 9, edit!(s, v => {
            s.extensor.channel = 8;
            s.flexors[0].channel = v.try_into().ok()?;
        })),
        rows_of("channel", 0, 9, edit!(s, v => {
            s.flexors[0].channel = 8;
            s.extensor.channel = v.try_into().ok()?;
        })),
        rows_of("threshold", 0, 10_000, edit!(s, v => s.flexors[0].threshold = Amplitude::new(v.try_into().ok()?))),
        rows_of("threshold", 0, 10_000, edit!(s, v => s.extensor.threshold = Amplitude::new(v.try_into().ok()?))),
        rows_of("max", 0, 200_000, edit!(s, v => {
            s.flexors[0].threshold = Amplitude::ZERO;
            s.flexors[0].max = Amplitude::new(v.try_into().ok()?);
        })),
        rows_of("max", 0, 200_000, edit!(s, v => {
            s.extensor.threshold = Amplitude::ZERO;
            s.extensor.max = Amplitude::new(v.try_into().ok()?);
        })),
    ])
}

#[rustfmt::skip]
fn sensor_rows() -> Vec<Row> {
    const fn codes(code_at_0: u16, code_at_100: u16) -> SensorSource {
        SensorSource::Adc { code_at_0, code_at_100 }
    }
    all([
        rows_of("code_at_0", 0, 4_095, edit!(s, v => s.sensor = codes(v.try_into().ok()?, 2_000))),
        rows_of("code_at_100", 0, 4_095, edit!(s, v => s.sensor = codes(2_000, v.try_into().ok()?))),
        // The span can be no larger than the codes allow.
        rows_of("code_at_100 - code_at_0", 100, 4_095, edit!(s, v => {
            s.sensor = codes(0, u16::try_from(v).ok().filter(|&v| v <= 4_095)?);
        })),
    ])
}

fn with(edit: fn(&mut JointSpec)) -> Bench {
    Bench::draft().after_requests([Request::Joint(edited(edit))])
}

/// Returns rows on rules that involve the channels, which arming checks.
#[rustfmt::skip]
fn arm_rows() -> Vec<Row> {
    let arm = |name, scene, expect| row(name, scene, desk::ARM, expect);
    let above = refused(Code::AboveWearerLimit, "max").on(2).allowed(0, 20_000);
    vec![
        arm("a joint within its channels", || with(|_| ()), Expect::Done),
        arm("a joint on a channel without a train", || with(|s| s.extensor.channel = 5), refused(Code::NoTrain, "joint").on(6)),
        arm("a joint up to its channel's limit", || with(|s| s.extensor.max = Amplitude::new(20_000)), Expect::Done),
        arm("a joint above its channel's limit", || with(|s| s.extensor.max = Amplitude::new(20_001)), above),
    ]
}
