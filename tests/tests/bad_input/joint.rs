//! The joint's request: law, mapping, sensor.

use crate::bad_input::bench::{Bench, joint};
use crate::bad_input::table::{Expect, Field, Row, refused, row};
use firmware::control::{HoldPolicy, JointSpec, LawSpec, SensorSource};
use firmware::link::{Code, Request};
use firmware::units::Amplitude;

pub fn rows() -> Vec<Row> {
    let parts = [
        law_rows(),
        plain_rows(),
        point_rows(),
        sensor_rows(),
        arm_rows(),
    ];
    parts.into_iter().flatten().collect()
}

fn rows_of(
    name: &'static str,
    min: i32,
    max: i32,
    edit: fn(&mut JointSpec, i64) -> Option<()>,
) -> Vec<Row> {
    let field = Field {
        scene: Bench::draft,
        name,
        min,
        max,
        channel: None,
    };
    field.rows(|v| {
        let mut spec = joint(SensorSource::Host);
        edit(&mut spec, v)?;
        Some(Request::Joint(spec))
    })
}

fn law_rows() -> Vec<Row> {
    macro_rules! law {
        ($field:literal, $min:literal, $max:literal, $v:ident => $law:expr) => {
            rows_of($field, $min, $max, |s, v| {
                let $v = v.try_into().ok()?;
                s.law = $law;
                Some(())
            })
        };
    }
    [
        law!("lambda_milli", 1, 100_000, v => LawSpec::Paper { lambda_milli: v, w_milli: 1_000 }),
        law!("w_milli", 0, 100_000, v => LawSpec::Paper { lambda_milli: 1_000, w_milli: v }),
        law!("lambda_milli", 100, 100_000, v => recommended(v, 605, 6_620, 91_600)),
        law!("k1_milli", 1, 100_000, v => recommended(12_700, v, 6_620, 91_600)),
        law!("k2_milli", 10, 100_000, v => recommended(12_700, 605, v, 91_600)),
        law!("b_milli", 1_000, 1_000_000, v => recommended(12_700, 605, 6_620, v)),
        law!("kp_milli", 0, 100_000, v => pid(v, 1, 1)),
        law!("ki_milli", 0, 100_000, v => pid(1, v, 1)),
        law!("kd_milli", 0, 100_000, v => pid(1, 1, v)),
    ]
    .into_iter()
    .flatten()
    .collect()
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

fn pid(kp_milli: u32, ki_milli: u32, kd_milli: u32) -> LawSpec {
    LawSpec::Pid {
        kp_milli,
        ki_milli,
        kd_milli,
    }
}

fn plain_rows() -> Vec<Row> {
    macro_rules! plain {
        ($field:ident, $min:literal, $max:literal) => {
            rows_of(stringify!($field), $min, $max, |s, v| {
                s.$field = v.try_into().ok()?;
                Some(())
            })
        };
    }
    let max_above_min = rows_of("angle_max_mdeg", 30_001, 180_000, |s, v| {
        s.angle_min_mdeg = 30_000;
        s.angle_max_mdeg = v.try_into().ok()?;
        Some(())
    });
    let min = rows_of("angle_min_mdeg", -180_000, 179_999, |s, v| {
        s.angle_max_mdeg = 180_000;
        s.angle_min_mdeg = v.try_into().ok()?;
        Some(())
    });
    let hold = rows_of("max_ms", 1, 1_000, |s, v| {
        let max_ms = v.try_into().ok()?;
        s.hold = HoldPolicy::Extrapolate { max_ms };
        Some(())
    });
    [
        plain!(law_period_ms, 1, 20),
        plain!(cutoff_mhz, 500, 20_000),
        plain!(stale_after_ms, 2, 500),
        min,
        max_above_min,
        hold,
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn point_rows() -> Vec<Row> {
    let mut none = joint(SensorSource::Host);
    none.flexors.clear();
    let mut two = joint(SensorSource::Host);
    let mut second = two.extensor;
    second.channel = 2;
    two.flexors.push(second).unwrap();
    let mut twice = joint(SensorSource::Host);
    twice.extensor.channel = 0;
    let mut rows = vec![
        row(
            "no flexor",
            Bench::draft,
            Request::Joint(none),
            refused(Code::OutOfRange, "flexors").allowed(1, 2),
        ),
        row(
            "two flexors",
            Bench::draft,
            Request::Joint(two),
            Expect::Done,
        ),
        row(
            "flexor and extensor on one channel",
            Bench::draft,
            Request::Joint(twice),
            refused(Code::ChannelTwice, "joint").on(1),
        ),
    ];
    rows.extend(rows_of("channel", 0, 9, |s, v| {
        s.extensor.channel = 8; // out of the way of 0 and 9
        s.flexors[0].channel = v.try_into().ok()?;
        Some(())
    }));
    rows.extend(rows_of("channel", 0, 9, |s, v| {
        s.flexors[0].channel = 8;
        s.extensor.channel = v.try_into().ok()?;
        Some(())
    }));
    rows.extend(rows_of("threshold", 0, 10_000, |s, v| {
        s.flexors[0].threshold = Amplitude(v.try_into().ok()?);
        Some(())
    }));
    rows.extend(rows_of("threshold", 0, 10_000, |s, v| {
        s.extensor.threshold = Amplitude(v.try_into().ok()?);
        Some(())
    }));
    rows.extend(rows_of("max", 0, 200_000, |s, v| {
        s.flexors[0].threshold = Amplitude::ZERO;
        s.flexors[0].max = Amplitude(v.try_into().ok()?);
        Some(())
    }));
    rows.extend(rows_of("max", 0, 200_000, |s, v| {
        s.extensor.threshold = Amplitude::ZERO;
        s.extensor.max = Amplitude(v.try_into().ok()?);
        Some(())
    }));
    rows
}

fn sensor_rows() -> Vec<Row> {
    let zero = rows_of("code_at_0", 0, 4_095, |s, v| {
        let code_at_0 = v.try_into().ok()?;
        s.sensor = SensorSource::Adc {
            code_at_0,
            code_at_100: 2_000,
        };
        Some(())
    });
    let hundred = rows_of("code_at_100", 0, 4_095, |s, v| {
        let code_at_100 = v.try_into().ok()?;
        s.sensor = SensorSource::Adc {
            code_at_0: 2_000,
            code_at_100,
        };
        Some(())
    });
    // The span can be no larger than the codes allow.
    let span = rows_of("code_at_100 - code_at_0", 100, 4_095, |s, v| {
        s.sensor = SensorSource::Adc {
            code_at_0: 0,
            code_at_100: u16::try_from(v).ok().filter(|&v| v <= 4_095)?,
        };
        Some(())
    });
    [zero, hundred, span].into_iter().flatten().collect()
}

/// What can only be judged with the channels: at arming.
fn arm_rows() -> Vec<Row> {
    fn with(edit: fn(&mut JointSpec)) -> Bench {
        let mut bench = Bench::draft();
        let mut spec = joint(SensorSource::Host);
        edit(&mut spec);
        bench.client.joint(spec).unwrap();
        bench
    }
    vec![
        row(
            "a joint within its channels",
            || with(|_| ()),
            Request::Arm,
            Expect::Done,
        ),
        row(
            "a joint on a channel without a train",
            || with(|s| s.extensor.channel = 5),
            Request::Arm,
            refused(Code::NoTrain, "joint").on(6),
        ),
        row(
            "a joint up to its channel's limit",
            || with(|s| s.extensor.max = Amplitude(20_000)),
            Request::Arm,
            Expect::Done,
        ),
        row(
            "a joint above its channel's limit",
            || with(|s| s.extensor.max = Amplitude(20_001)),
            Request::Arm,
            refused(Code::AboveWearerLimit, "max")
                .on(2)
                .allowed(0, 20_000),
        ),
    ]
}
