//! A joint from the outside: amplitudes at participant P's voltages, sensors,
//! setpoints and times, refusals, and properties over every input.

use firmware::control::setpoint::{HORIZON_US, SetpointTrack};
use firmware::control::{
    Effort, HoldPolicy, Joint, JointSpec, JointState, LawSpec, MeasurementError, Orders, PointSpec,
    SensorFault, SensorSource, SetpointError, SpecError, SpecField,
};
use firmware::units::{Amplitude, Angle, AngularRate, Micros};
use fixed::types::I16F16;
use proptest::prelude::*;

fn point(channel: u8, threshold: u32, max: u32) -> PointSpec {
    PointSpec {
        channel,
        threshold: Amplitude(threshold),
        max: Amplitude(max),
    }
}

/// Participant P (Hamana 2022 table 7), two-point.
fn two_point(law: LawSpec) -> JointSpec {
    let pair = [
        PointSpec::of_pair(0, Amplitude(28_000), 700),
        PointSpec::of_pair(1, Amplitude(36_000), 700),
    ];
    JointSpec {
        law,
        law_period_ms: 11,
        cutoff_mhz: 3000,
        flexors: pair.into_iter().collect(),
        extensor: point(2, 14_000, 26_000),
        hold: HoldPolicy::Extrapolate { max_ms: 100 },
        angle_min_mdeg: 0,
        angle_max_mdeg: 100_000,
        sensor: SensorSource::Host,
        stale_after_ms: 100,
    }
}

fn one_point(law: LawSpec) -> JointSpec {
    let flexors = [point(0, 24_000, 28_000)].into_iter().collect();
    JointSpec {
        flexors,
        ..two_point(law)
    }
}

fn degrees(deg: f64) -> Angle {
    Angle(I16F16::from_num(deg))
}

/// The orders of the first tick at this error, so without derivative.
fn at_error(spec: &JointSpec, error: f64) -> Orders {
    let joint = Joint::new(spec).unwrap();
    let mut state = JointState::default();
    let now = Micros(u32::MAX);
    joint
        .measurement(&mut state, now, now, degrees(50.0))
        .unwrap();
    joint
        .setpoint(&mut state, now, now, degrees(50.0 + error), None)
        .unwrap();
    joint.tick(&mut state, now, None).unwrap()
}

fn millivolts(orders: &Orders) -> Vec<u32> {
    orders.amplitudes.iter().map(|(_, a)| a.0).collect()
}

/// u = 10·√(10·|e|) + 0.011 V against hand-computed volts: (7)–(12).
#[test]
fn the_papers_mapping_at_participant_ps_voltages() {
    // Error °, one-point [A, E], two-point [A, B, E], limiting for each.
    let table: [(f64, [u32; 2], [u32; 3], [bool; 2]); 6] = [
        (
            0.0,
            [24_000, 14_000],
            [19_600, 25_200, 14_000],
            [false, false],
        ),
        (
            0.009,
            [27_011, 14_000],
            [22_611, 28_211, 14_000],
            [false, false],
        ),
        (
            0.064,
            [28_000, 14_000],
            [27_611, 33_211, 14_000],
            [true, false],
        ),
        (
            0.1,
            [28_000, 14_000],
            [28_000, 35_211, 14_000],
            [true, true],
        ),
        (
            10.0,
            [28_000, 14_000],
            [28_000, 36_000, 14_000],
            [true, true],
        ),
        (
            -0.064,
            [24_000, 22_011],
            [19_600, 25_200, 22_011],
            [false, false],
        ),
    ];
    for (error, one, two, limiting) in table {
        for (spec, expected, limits) in [
            (one_point(LawSpec::PAPER), one.to_vec(), limiting[0]),
            (two_point(LawSpec::PAPER), two.to_vec(), limiting[1]),
        ] {
            let orders = at_error(&spec, error);
            let got = millivolts(&orders);
            for (g, e) in got.iter().zip(&expected) {
                // One bit of the angle is 1.5e-5°, which the root makes 3 mV.
                assert!(
                    g.abs_diff(*e) <= 3,
                    "at {error}°: {got:?}, not {expected:?}"
                );
            }
            assert_eq!(orders.limiting, limits, "at {error}°");
        }
    }
}

#[test]
fn a_fraction_spans_threshold_to_maximum_of_each_point() {
    // A pure proportional law: the fraction is the error in radians.
    let law = LawSpec::Pid {
        kp_milli: 1000,
        ki_milli: 0,
        kd_milli: 0,
    };
    let half = at_error(&two_point(law), 0.5_f64.to_degrees());
    for (got, exact) in millivolts(&half).iter().zip([23_800, 30_600, 14_000]) {
        assert!(got.abs_diff(exact) <= 1 && *got <= exact, "{half:?}");
    }
    assert!(!half.limiting);
    let back = at_error(&two_point(law), (-0.5_f64).to_degrees());
    for (got, exact) in millivolts(&back).iter().zip([19_600, 25_200, 20_000]) {
        assert!(got.abs_diff(exact) <= 1 && *got <= exact, "{back:?}");
    }
    let steep = LawSpec::Pid {
        kp_milli: 10_000,
        ki_milli: 0,
        kd_milli: 0,
    };
    let full = at_error(&two_point(steep), 40.0);
    assert_eq!(millivolts(&full), [28_000, 36_000, 14_000]);
    assert!(full.limiting);
}

#[test]
fn nothing_flows_before_the_first_setpoint_is_due() {
    let joint = Joint::new(&two_point(LawSpec::PAPER)).unwrap();
    let mut state = JointState::default();
    let now = Micros(u32::MAX - 3000);
    joint
        .measurement(&mut state, now, now, degrees(30.0))
        .unwrap();
    joint
        .setpoint(&mut state, now, now.plus(5000), degrees(80.0), None)
        .unwrap();
    for ms in 0..10 {
        let orders = joint.tick(&mut state, now.plus(ms * 1000), None).unwrap();
        if ms < 5 {
            assert_eq!(millivolts(&orders), [0, 0, 0]);
            assert_eq!((orders.target, orders.limiting), (orders.measured, false));
        } else {
            assert_eq!(millivolts(&orders), [28_000, 36_000, 14_000]);
            assert_eq!(orders.target, degrees(80.0));
        }
    }
}

#[test]
fn the_law_runs_once_a_period_across_the_wrap() {
    let joint = Joint::new(&two_point(LawSpec::RECOMMENDED)).unwrap();
    let mut state = JointState::default();
    let start = Micros(u32::MAX - 50_000);
    joint
        .setpoint(&mut state, start, start, degrees(60.0), None)
        .unwrap();
    let mut changes = Vec::new();
    let mut before: Option<Effort> = None;
    for ms in 0..100 {
        let now = start.plus(ms * 1000);
        joint
            .measurement(&mut state, now, now, degrees(f64::from(ms) * 0.1))
            .unwrap();
        let effort = joint.tick(&mut state, now, None).unwrap().effort;
        if before.replace(effort) != Some(effort) {
            changes.push(ms);
        }
    }
    assert_eq!(changes, (0..100).step_by(11).collect::<Vec<_>>());
}

#[test]
fn a_bad_sensor_gives_a_named_fault_and_no_orders() {
    let joint = Joint::new(&two_point(LawSpec::RECOMMENDED)).unwrap();
    let mut state = JointState::default();
    let t0 = Micros(u32::MAX - 50_000);
    assert_eq!(joint.tick(&mut state, t0, None), Err(SensorFault::Absent));
    joint
        .measurement(&mut state, t0, t0, degrees(10.0))
        .unwrap();
    let stale = Err(SensorFault::Stale { limit_ms: 100 });
    assert!(joint.tick(&mut state, t0.plus(100_000), None).is_ok());
    assert_eq!(joint.tick(&mut state, t0.plus(100_001), None), stale);
    // A whole turn of the clock later it is still stale.
    assert_eq!(joint.tick(&mut state, t0.plus(1), None), stale);
    let t1 = t0.plus(200_000);
    joint
        .measurement(&mut state, t1, t1, degrees(120.5))
        .unwrap();
    let wild = Err(SensorFault::OutOfRange { centideg: 12_050 });
    assert_eq!(joint.tick(&mut state, t1, None), wild);
    joint
        .measurement(&mut state, t1, t1.plus(1), degrees(-20.0))
        .unwrap_err();
    let t2 = t1.plus(1000);
    joint
        .measurement(&mut state, t2, t2, degrees(-20.0))
        .unwrap();
    assert!(joint.tick(&mut state, t2, None).is_ok());
}

#[test]
fn measurements_have_one_order_and_one_source() {
    let spec = two_point(LawSpec::PAPER);
    let joint = Joint::new(&spec).unwrap();
    let mut state = JointState::default();
    let now = Micros(3);
    let at = |state: &mut JointState, at: Micros| joint.measurement(state, now, at, degrees(1.0));
    assert_eq!(at(&mut state, now.minus(10)), Ok(()));
    assert_eq!(
        at(&mut state, now.minus(10)),
        Err(MeasurementError::OutOfOrder)
    );
    assert_eq!(
        at(&mut state, now.minus(11)),
        Err(MeasurementError::OutOfOrder)
    );
    assert_eq!(
        at(&mut state, now.plus(5001)),
        Err(MeasurementError::InTheFuture)
    );
    assert_eq!(at(&mut state, now.plus(5000)), Ok(()));

    let sensor = SensorSource::Adc {
        code_at_0: 3000,
        code_at_100: 1000,
    };
    let board = Joint::new(&JointSpec { sensor, ..spec }).unwrap();
    let mut state = JointState::default();
    let refused = board.measurement(&mut state, now, now, degrees(1.0));
    assert_eq!(refused, Err(MeasurementError::NotFromHost));
    for (code, deg) in [
        (3000, 0.0),
        (1000, 100.0),
        (2000, 50.0),
        (0, 150.0),
        (4095, -54.75),
    ] {
        assert_eq!(board.angle_from_code(code), Some(degrees(deg)));
    }
    assert!(joint.angle_from_code(0).is_none());
    let orders = board
        .tick(&mut state, now, board.angle_from_code(2000))
        .unwrap();
    assert_eq!(orders.measured, degrees(50.0));
}

#[test]
fn a_track_holds_or_goes_on_for_a_while() {
    let go_on = HoldPolicy::Extrapolate { max_ms: 50 };
    let t = Micros(u32::MAX - 20_000);
    let rate = |deg| Some(AngularRate(I16F16::from_num(deg)));
    // Rate given, wait in ms, policy, angle expected.
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
        assert_eq!(track.value_at(t.minus(1), policy), None);
        assert_eq!(
            track.value_at(t.plus(wait * 1000), policy),
            Some(degrees(expected))
        );
    }
    // Two setpoints 10 ms apart: 2° is motion (200 °/s), 20° is a step.
    for (second, expected) in [(12.0, 16.0), (30.0, 30.0)] {
        let mut track = SetpointTrack::default();
        track.accept(t, t, degrees(10.0), None).unwrap();
        track
            .accept(t, t.plus(10_000), degrees(second), None)
            .unwrap();
        assert_eq!(
            track.value_at(t.plus(30_000), go_on),
            Some(degrees(expected))
        );
    }
}

#[test]
fn a_track_keeps_its_angle_for_hours_and_then_listens() {
    let mut track = SetpointTrack::default();
    let mut now = Micros(7);
    track.accept(now, now, degrees(10.0), None).unwrap();
    for _ in 0..400 {
        now = now.plus(30_000_000);
        assert_eq!(track.value_at(now, HoldPolicy::Hold), Some(degrees(10.0)));
    }
    track.accept(now, now, degrees(20.0), None).unwrap();
    assert_eq!(track.value_at(now, HoldPolicy::Hold), Some(degrees(20.0)));
}

#[test]
fn setpoints_out_of_place_are_refused_by_name() {
    let joint = Joint::new(&two_point(LawSpec::PAPER)).unwrap();
    let mut state = JointState::default();
    let now = Micros(100);
    let mut set = |at: Micros, deg: f64| joint.setpoint(&mut state, now, at, degrees(deg), None);
    let range = SetpointError::OutOfRange {
        min_mdeg: 0,
        max_mdeg: 100_000,
    };
    assert_eq!(set(now, -0.1), Err(range));
    assert_eq!(set(now, 100.1), Err(range));
    assert_eq!(
        set(now.plus(HORIZON_US + 1), 1.0),
        Err(SetpointError::TooFarAhead)
    );
    assert_eq!(
        set(now.minus(HORIZON_US + 1), 1.0),
        Err(SetpointError::TooOld)
    );
    for i in 0..8 {
        assert_eq!(set(now.plus(i * 1000), 1.0), Ok(()));
    }
    assert_eq!(set(now.plus(7000), 1.0), Err(SetpointError::OutOfOrder));
    assert_eq!(set(now.plus(8000), 1.0), Err(SetpointError::TooManyWaiting));
}

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
    let spec = two_point(LawSpec::RECOMMENDED);
    let mut buffer = [0; 128];
    let bytes = postcard::to_slice(&spec, &mut buffer).unwrap();
    assert_eq!(postcard::from_bytes::<JointSpec>(bytes).unwrap(), spec);
}

fn any_law() -> impl Strategy<Value = LawSpec> {
    let gain = |low: u32| prop_oneof![Just(low), low..=100_000_u32, Just(100_000)];
    prop_oneof![
        (gain(1), gain(0)).prop_map(|(lambda_milli, w_milli)| LawSpec::Paper {
            lambda_milli,
            w_milli
        }),
        (gain(100), gain(1), gain(10), 1000..=1_000_000_u32).prop_map(
            |(lambda_milli, k1_milli, k2_milli, b_milli)| LawSpec::Recommended {
                lambda_milli,
                k1_milli,
                k2_milli,
                b_milli
            }
        ),
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
            }
        },
    )
}

/// One thing that happens to a joint: gap before it in µs, an offset of its
/// time stamp, an angle and a rate in raw bits.
fn any_event() -> impl Strategy<Value = (u8, u32, i32, i32, Option<i32>)> {
    let gap = prop_oneof![60 => 0..5000_u32, 1 => any::<u32>()];
    let offset = prop_oneof![20 => -5000..5000_i32, 1 => any::<i32>()];
    let bits = prop_oneof![4 => -13_000_000..13_000_000_i32, 1 => any::<i32>()];
    (0..6_u8, gap, offset, bits, any::<Option<i32>>())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    /// No accepted spec and no input panics (overflow checks are on), every
    /// channel is named once, and every amplitude is 0 on all channels or
    /// within threshold and maximum on each.
    #[test]
    fn amplitudes_stay_within_the_wearers_range(
        spec in any_spec(),
        start in any::<u32>(),
        events in proptest::collection::vec(any_event(), 1..80),
    ) {
        let Ok(joint) = Joint::new(&spec) else { return Ok(()) };
        let points: Vec<PointSpec> = spec.flexors.iter().copied().chain([spec.extensor]).collect();
        let mut state = JointState::default();
        let mut now = Micros(start);
        let middle = f64::from(spec.angle_min_mdeg / 2 + spec.angle_max_mdeg / 2) / 1000.0;
        joint.setpoint(&mut state, now, now, degrees(middle), None).unwrap();
        let _ = joint.measurement(&mut state, now, now, degrees(middle));
        for (kind, gap, offset, bits, rate) in events {
            now = now.plus(gap);
            let at = now.plus(offset.cast_unsigned());
            let angle = Angle(I16F16::from_bits(bits));
            let rate = rate.map(|r| AngularRate(I16F16::from_bits(r)));
            match kind {
                0 => { let _ = joint.setpoint(&mut state, now, at, angle, rate); }
                1 => { let _ = joint.measurement(&mut state, now, at, angle); }
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
