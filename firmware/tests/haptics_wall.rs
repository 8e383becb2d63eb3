//! The virtual wall: its output against the paper's formulas in floating point, and all refused
//! specifications.

use firmware::control::{SensorFault, SensorSource};
use firmware::haptics::{
    CoContraction, PreWall, Side, Wall, WallError, WallOrders, WallSpec, WallState,
};
use firmware::range::OutOfRange;
use firmware::units::{Amplitude, Angle, Micros};
use proptest::prelude::*;

/// Harris' second scenario: 80 mA on the triceps, proportional only.
const PLAIN: WallSpec = WallSpec {
    at_mdeg: 90_000,
    side: Side::Flexion,
    channel: 0,
    max: Amplitude::new(80_000),
    stiffness: 8_889,
    damping: 0,
    cutoff_mhz: 10_000,
    pre_wall: None,
    co_contraction: None,
    angle_min_mdeg: 0,
    angle_max_mdeg: 150_000,
    sensor: SensorSource::Host,
    stale_after_ms: 50,
};

const PRE_WALL: PreWall = PreWall {
    depth_mdeg: 9_000,
    begin: Amplitude::new(20_000),
    end: Amplitude::new(80_000),
};

/// Returns the orders of one tick at rest at this angle, hundredths of a degree.
fn orders_at(spec: &WallSpec, centideg: i16) -> WallOrders {
    let wall = Wall::new(spec).unwrap();
    let (mut state, now) = (WallState::default(), Micros::new(u32::MAX - 3));
    let angle = Angle::from_centideg(centideg);
    wall.accept_measurement(&mut state, now, now, angle)
        .unwrap();
    wall.tick(&mut state, now, None).unwrap()
}

fn amplitudes(spec: &WallSpec, centideg: i16) -> Vec<u32> {
    let orders = orders_at(spec, centideg);
    orders.amplitudes.iter().map(|(_, a)| a.get()).collect()
}

#[test]
fn the_papers_equation_1_holds_on_both_sides_of_the_wall() {
    assert_eq!(amplitudes(&PLAIN, 8_999), [0]);
    assert_eq!(amplitudes(&PLAIN, 9_000), [0]);
    assert_eq!(amplitudes(&PLAIN, 9_100), [8_889]);
    assert_eq!(amplitudes(&PLAIN, 9_500), [44_445]);
    let deep = orders_at(&PLAIN, 11_000);
    assert_eq!(deep.amplitudes[0], (0, Amplitude::new(80_000)));
    assert!(deep.limiting && !orders_at(&PLAIN, 9_500).limiting);
    assert_eq!(deep.penetration, Angle::from_centideg(2_000));
    assert_eq!(deep.wall, Angle::from_centideg(9_000));
    // The mirror image of the wall stops extension.
    let mirror = WallSpec {
        side: Side::Extension,
        ..PLAIN
    };
    assert_eq!(amplitudes(&mirror, 8_900), [8_889]);
    assert_eq!(amplitudes(&mirror, 9_100), [0]);
}

#[test]
fn the_pre_wall_ramps_from_its_begin_to_its_end_and_the_wall_goes_on_from_there() {
    let paper = WallSpec {
        pre_wall: Some(PRE_WALL),
        ..PLAIN
    };
    assert_eq!(amplitudes(&paper, 8_100), [0]);
    let first = amplitudes(&paper, 8_101)[0];
    assert!((20_000..20_100).contains(&first), "{first}");
    let half = amplitudes(&paper, 8_550)[0];
    assert!((49_990..=50_000).contains(&half), "{half}");
    // The full amplitude is reached at the wall, as in the paper.
    assert!((79_999..=80_000).contains(&amplitudes(&paper, 9_000)[0]));
    let gentle = WallSpec {
        pre_wall: Some(PreWall {
            end: Amplitude::new(30_000),
            ..PRE_WALL
        }),
        ..PLAIN
    };
    assert_eq!(amplitudes(&gentle, 9_100), [38_889]);
}

#[test]
fn the_antagonist_works_inside_the_wall_only() {
    let spec = WallSpec {
        pre_wall: Some(PRE_WALL),
        co_contraction: Some(CoContraction {
            channel: 1,
            amplitude: Amplitude::new(40_000),
        }),
        ..PLAIN
    };
    // Equation 2.
    assert_eq!(amplitudes(&spec, 8_999)[1], 0);
    assert_eq!(amplitudes(&spec, 9_000)[1], 0);
    assert_eq!(amplitudes(&spec, 9_001)[1], 40_000);
}

/// Runs the wall over a sequence of angles, one per millisecond, and returns the amplitudes.
fn follow(spec: &WallSpec, course: impl Iterator<Item = f64>) -> Vec<u32> {
    let wall = Wall::new(spec).unwrap();
    let mut state = WallState::default();
    (0u32..)
        .zip(course)
        .map(|(ms, deg)| {
            let now = Micros::new(ms * 1000);
            let angle = Angle::from_centideg((deg * 100.0).round() as i16);
            wall.accept_measurement(&mut state, now, now, angle)
                .unwrap();
            wall.tick(&mut state, now, None).unwrap().amplitudes[0]
                .1
                .get()
        })
        .collect()
}

#[test]
fn damping_adds_on_the_way_in_takes_away_on_the_way_out_and_never_pulls() {
    let damped = WallSpec {
        damping: 500,
        ..PLAIN
    };
    // 20 °/s for 0.3 s into the wall, then out again.
    let course =
        || (0..600).map(|ms| 90.0 + 0.02 * f64::from(if ms < 300 { ms } else { 600 - ms }));
    let (with, without) = (follow(&damped, course()), follow(&PLAIN, course()));
    // 500 µA·s/° · 20 °/s once the filter has settled; a reading's ±0.01° become at most ±0.63 °/s
    // after the filter.
    let extra = i64::from(with[250]) - i64::from(without[250]);
    assert!((9_500..=10_500).contains(&extra), "{extra}");
    let missing = i64::from(without[450]) - i64::from(with[450]);
    assert!((9_500..=10_500).contains(&missing), "{missing}");
    assert_eq!(with[590], 0);
    assert!(without[590] > 0);
    // In front of the wall there is no damping.
    let passing = (0..300).map(|ms| 80.0 + 0.02 * f64::from(ms));
    assert!(follow(&damped, passing).iter().all(|&a| a == 0));
}

#[test]
fn measurements_are_judged_as_a_joints_are() {
    let wall = Wall::new(&PLAIN).unwrap();
    let mut state = WallState::default();
    assert_eq!(
        wall.tick(&mut state, Micros::new(0), None),
        Err(SensorFault::Absent)
    );
    let angle = Angle::from_centideg(9_500);
    wall.accept_measurement(&mut state, Micros::new(0), Micros::new(0), angle)
        .unwrap();
    assert!(wall.tick(&mut state, Micros::new(50_000), None).is_ok());
    let stale = SensorFault::Stale { limit_ms: 50 };
    assert_eq!(wall.tick(&mut state, Micros::new(50_001), None), Err(stale));
    let (now, far) = (Micros::new(60_000), Angle::from_centideg(17_001));
    wall.accept_measurement(&mut state, now, now, far).unwrap();
    let centideg = 17_001;
    assert_eq!(
        wall.tick(&mut state, now, None),
        Err(SensorFault::OutOfRange { centideg })
    );
}

fn validation_error(change: impl FnOnce(&mut WallSpec)) -> WallError {
    let mut spec = WallSpec {
        pre_wall: Some(PRE_WALL),
        co_contraction: Some(CoContraction {
            channel: 1,
            amplitude: Amplitude::new(40_000),
        }),
        ..PLAIN
    };
    assert!(Wall::new(&spec).is_ok());
    change(&mut spec);
    Wall::new(&spec).unwrap_err()
}

fn range(field: &'static str, value: i64, min: i32, max: i32) -> WallError {
    WallError::Range(OutOfRange {
        field,
        value,
        min,
        max,
    })
}

#[test]
fn every_field_out_of_range_is_named_with_what_it_allows() {
    let pre = |change: fn(&mut PreWall)| validation_error(|s| change(s.pre_wall.as_mut().unwrap()));
    let co = |change: fn(&mut CoContraction)| {
        validation_error(|s| change(s.co_contraction.as_mut().unwrap()))
    };
    let amplitude = 200_000;
    let short = SensorSource::Adc {
        code_at_0: 500,
        code_at_100: 599,
    };
    #[rustfmt::skip]
    let cases = [
        (validation_error(|s| s.at_mdeg = 150_001), range("at_mdeg", 150_001, 0, 150_000)),
        (validation_error(|s| s.at_mdeg = -1), range("at_mdeg", -1, 0, 150_000)),
        (validation_error(|s| s.channel = 10), range("channel", 10, 0, 9)),
        (validation_error(|s| s.max = Amplitude::new(0)), range("max", 0, 1, amplitude)),
        (validation_error(|s| s.max = Amplitude::new(u32::MAX)), range("max", u32::MAX.into(), 1, amplitude)),
        (validation_error(|s| s.stiffness = 0), range("stiffness", 0, 1, amplitude)),
        (validation_error(|s| s.damping = 20_001), range("damping", 20_001, 0, 20_000)),
        (validation_error(|s| s.cutoff_mhz = 499), range("cutoff_mhz", 499, 500, 20_000)),
        (pre(|p| p.depth_mdeg = 99), range("depth_mdeg", 99, 100, 45_000)),
        (pre(|p| p.end = Amplitude::new(80_001)), range("end", 80_001, 0, 80_000)),
        (pre(|p| p.begin = Amplitude::new(80_001)), range("begin", 80_001, 0, 80_000)),
        (co(|c| c.channel = 10), range("channel", 10, 0, 9)),
        (co(|c| c.amplitude = Amplitude::new(0)), range("amplitude", 0, 1, amplitude)),
        (validation_error(|s| s.angle_max_mdeg = 180_001), range("angle_max_mdeg", 180_001, 1, 180_000)),
        (validation_error(|s| s.stale_after_ms = 1), range("stale_after_ms", 1, 2, 500)),
        (validation_error(|s| s.sensor = short), range("code_at_100 - code_at_0", 99, 100, 4095)),
    ];
    for (refused, expected) in cases {
        assert_eq!(refused, expected);
    }
    assert_eq!(
        co(|c| c.channel = 0),
        WallError::ChannelTwice { channel: 0 }
    );
}

fn any_spec() -> impl Strategy<Value = WallSpec> {
    let pre = (100u32..45_000, 0u32..200_000, 0u32..200_000);
    (
        (-180_000i32..180_000, 1u32..=200_000, 1u32..=200_000),
        (0u32..=20_000, 500u32..=20_000),
        (any::<bool>(), proptest::option::of(pre), any::<bool>()),
    )
        .prop_map(|((at_mdeg, max, stiffness), (damping, cutoff_mhz), rest)| {
            let (flexion, pre, has_co_contraction) = rest;
            let pre_wall = pre.map(|(depth_mdeg, a, b)| PreWall {
                depth_mdeg,
                begin: Amplitude::new(a.min(b).min(max)),
                end: Amplitude::new(a.max(b).min(max)),
            });
            WallSpec {
                at_mdeg,
                side: if flexion {
                    Side::Flexion
                } else {
                    Side::Extension
                },
                max: Amplitude::new(max),
                stiffness,
                damping,
                cutoff_mhz,
                pre_wall,
                co_contraction: has_co_contraction.then_some(CoContraction {
                    channel: 9,
                    amplitude: Amplitude::new(max),
                }),
                angle_min_mdeg: -180_000,
                angle_max_mdeg: 180_000,
                ..PLAIN
            }
        })
}

proptest! {
    /// A valid wall stays within its maximum and within one bit of the formulas for any angles.
    #[test]
    fn a_wall_never_exceeds_its_maximum_and_keeps_to_its_formula(
        spec in any_spec(),
        angles in prop::collection::vec(-19_999i16..19_999, 1..40),
    ) {
        let wall = Wall::new(&spec).unwrap();
        let mut state = WallState::default();
        for (ms, centideg) in (0u32..).zip(angles) {
            let now = Micros::new((u32::MAX - 20_000).wrapping_add(ms * 1000));
            let angle = Angle::from_centideg(centideg);
            wall.accept_measurement(&mut state, now, now, angle).unwrap();
            let orders = wall.tick(&mut state, now, None).unwrap();
            prop_assert!(orders.amplitudes.iter().all(|(_, a)| *a <= spec.max));
            if spec.damping == 0 || ms == 0 {
                let sign = if spec.side == Side::Flexion { 1.0 } else { -1.0 };
                let deg = |a: Angle| f64::from(a.get().to_bits()) / 65_536.0;
                let p = sign * (deg(angle) - deg(orders.wall));
                let (depth, begin, end) = spec.pre_wall.map_or((0.0, 0.0, 0.0), |pre| {
                    let depth = deg(Angle::from_millideg(pre.depth_mdeg as i32));
                    (depth, f64::from(pre.begin.get()), f64::from(pre.end.get()))
                });
                let exact = if p > 0.0 {
                    end + p * f64::from(spec.stiffness)
                } else if depth + p > 0.0 {
                    begin + (end - begin) * (p + depth) / depth
                } else {
                    0.0
                };
                let exact = exact.min(f64::from(spec.max.get()));
                let got = f64::from(orders.amplitudes[0].1.get());
                // Both values are truncated: the ramp's slope by 2^-26 per bit of angle, the
                // amplitude by 1.
                let cut = 1.0 + (p + depth).max(0.0) / 1024.0;
                prop_assert!((got - exact).abs() <= cut + 1e-6, "{} {} at {}", got, exact, p);
            }
        }
    }
}
