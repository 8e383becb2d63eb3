//! Joint control through its public interface: amplitudes at participant P's voltages, sensors and
//! times here; setpoints, refusals and properties over every input in the submodules.

mod limit_cycle;
mod property;
mod refusal;
mod track;

use firmware::control::{
    Effort, HoldPolicy, Joint, JointSpec, JointState, LawSpec, MeasurementError, Orders, PointSpec,
    SensorFault, SensorSource,
};
use firmware::units::{Amplitude, Angle, Micros, us};
use fixed::types::I16F16;

fn point(channel: u8, threshold: u32, max: u32) -> PointSpec {
    PointSpec {
        channel,
        threshold: Amplitude::new(threshold),
        max: Amplitude::new(max),
    }
}

/// Returns the joint of participant P (Hamana 2022 table 7) with two points.
fn two_point(law: LawSpec) -> JointSpec {
    let pair = [
        PointSpec::of_pair(0, Amplitude::new(28_000), 700),
        PointSpec::of_pair(1, Amplitude::new(36_000), 700),
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
        wearer: None,
        response: None,
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
    Angle::new(I16F16::from_num(deg))
}

/// Joint with its state.
struct RunningJoint {
    joint: Joint,
    state: JointState,
}

impl RunningJoint {
    fn new(spec: &JointSpec) -> Self {
        Self {
            joint: Joint::new(spec).unwrap(),
            state: JointState::default(),
        }
    }

    fn add_measurement(
        &mut self,
        now: Micros,
        at: Micros,
        deg: f64,
    ) -> Result<(), MeasurementError> {
        self.joint
            .accept_measurement(&mut self.state, now, at, degrees(deg))
    }

    fn measure_now(&mut self, now: Micros, deg: f64) {
        self.add_measurement(now, now, deg).unwrap();
    }

    fn set_reference(&mut self, now: Micros, at: Micros, deg: f64) {
        let (state, angle) = (&mut self.state, degrees(deg));
        self.joint
            .accept_setpoint(state, now, at, angle, None)
            .unwrap();
    }

    fn tick(&mut self, now: Micros) -> Result<Orders, SensorFault> {
        self.joint.tick(&mut self.state, now, None)
    }
}

/// Returns the orders of the first tick at this error in degrees, which has no derivative part.
fn orders_at_error(spec: &JointSpec, error: f64) -> Orders {
    let mut worn = RunningJoint::new(spec);
    let now = Micros::new(u32::MAX);
    worn.measure_now(now, 50.0);
    worn.set_reference(now, now, 50.0 + error);
    worn.tick(now).unwrap()
}

fn millivolts(orders: &Orders) -> Vec<u32> {
    orders.amplitudes.iter().map(|(_, a)| a.get()).collect()
}

/// Compares u = 10·√(10·|e|) + 0.011 V with volts computed by hand from equations (7)–(12).
#[test]
fn the_papers_mapping_at_participant_ps_voltages() {
    // Columns: error in °, one point [A, E], two points [A, B, E], limiting for each.
    #[rustfmt::skip]
    let table = [
        (0.0, [24_000, 14_000], [19_600, 25_200, 14_000], [false, false]),
        (0.009, [27_011, 14_000], [22_611, 28_211, 14_000], [false, false]),
        (0.064, [28_000, 14_000], [27_611, 33_211, 14_000], [true, false]),
        (0.1, [28_000, 14_000], [28_000, 35_211, 14_000], [true, true]),
        (10.0, [28_000, 14_000], [28_000, 36_000, 14_000], [true, true]),
        (-0.064, [24_000, 22_011], [19_600, 25_200, 22_011], [false, false]),
    ];
    for (error, single, two, limiting) in table {
        for (spec, expected, limits) in [
            (one_point(LawSpec::PAPER), single.to_vec(), limiting[0]),
            (two_point(LawSpec::PAPER), two.to_vec(), limiting[1]),
        ] {
            let orders = orders_at_error(&spec, error);
            let got = millivolts(&orders);
            for (g, e) in got.iter().zip(&expected) {
                // One bit of the angle is 1.5e-5°, which the square root turns into 3 mV.
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
    // With a purely proportional controller, the fraction is the error in radians.
    let law = LawSpec::Pid {
        kp_milli: 1000,
        ki_milli: 0,
        kd_milli: 0,
    };
    let half = orders_at_error(&two_point(law), 0.5_f64.to_degrees());
    for (got, exact) in millivolts(&half).iter().zip([23_800, 30_600, 14_000]) {
        assert!(got.abs_diff(exact) <= 1 && *got <= exact, "{half:?}");
    }
    assert!(!half.limiting);
    let back = orders_at_error(&two_point(law), (-0.5_f64).to_degrees());
    for (got, exact) in millivolts(&back).iter().zip([19_600, 25_200, 20_000]) {
        assert!(got.abs_diff(exact) <= 1 && *got <= exact, "{back:?}");
    }
    let steep = LawSpec::Pid {
        kp_milli: 10_000,
        ki_milli: 0,
        kd_milli: 0,
    };
    let full = orders_at_error(&two_point(steep), 40.0);
    assert_eq!(millivolts(&full), [28_000, 36_000, 14_000]);
    assert!(full.limiting);
}

#[test]
fn nothing_flows_before_the_first_setpoint_is_due() {
    let mut worn = RunningJoint::new(&two_point(LawSpec::PAPER));
    let now = Micros::new(u32::MAX - 3000);
    worn.measure_now(now, 30.0);
    worn.set_reference(now, now + us(5000), 80.0);
    for ms in 0..10 {
        let orders = worn.tick(now + us(ms * 1000)).unwrap();
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
    let mut worn = RunningJoint::new(&two_point(LawSpec::ALONE));
    let start = Micros::new(u32::MAX - 50_000);
    worn.set_reference(start, start, 60.0);
    let mut changes = Vec::new();
    let mut before: Option<Effort> = None;
    for ms in 0..100 {
        let now = start + us(ms * 1000);
        worn.measure_now(now, f64::from(ms) * 0.1);
        let effort = worn.tick(now).unwrap().effort;
        if before.replace(effort) != Some(effort) {
            changes.push(ms);
        }
    }
    assert_eq!(changes, (0..100).step_by(11).collect::<Vec<_>>());
}

#[test]
fn a_bad_sensor_gives_a_named_fault_and_no_orders() {
    let mut worn = RunningJoint::new(&two_point(LawSpec::ALONE));
    let t0 = Micros::new(u32::MAX - 50_000);
    assert_eq!(worn.tick(t0), Err(SensorFault::Absent));
    worn.measure_now(t0, 10.0);
    let stale = Err(SensorFault::Stale { limit_ms: 100 });
    assert!(worn.tick(t0 + us(100_000)).is_ok());
    assert_eq!(worn.tick(t0 + us(100_001)), stale);
    // It is still stale after a whole turn of the clock.
    assert_eq!(worn.tick(t0 + us(1)), stale);
    let t1 = t0 + us(200_000);
    worn.measure_now(t1, 120.5);
    let wild = Err(SensorFault::OutOfRange { centideg: 12_050 });
    assert_eq!(worn.tick(t1), wild);
    worn.add_measurement(t1, t1 + us(1), -20.0).unwrap_err();
    let t2 = t1 + us(1000);
    worn.measure_now(t2, -20.0);
    assert!(worn.tick(t2).is_ok());
}

#[test]
fn measurements_have_one_order_and_one_source() {
    let spec = two_point(LawSpec::PAPER);
    let mut worn = RunningJoint::new(&spec);
    let now = Micros::new(3);
    for (at, taken) in [
        (now - us(10), Ok(())),
        (now - us(10), Err(MeasurementError::OutOfOrder)),
        (now - us(11), Err(MeasurementError::OutOfOrder)),
        (now + us(5001), Err(MeasurementError::InTheFuture)),
        (now + us(5000), Ok(())),
    ] {
        assert_eq!(worn.add_measurement(now, at, 1.0), taken, "{at:?}");
    }
    assert!(worn.joint.angle_from_code(0).is_none());

    let sensor = SensorSource::Adc {
        code_at_0: 3000,
        code_at_100: 1000,
    };
    let mut worn = RunningJoint::new(&JointSpec { sensor, ..spec });
    let refused = worn.add_measurement(now, now, 1.0);
    assert_eq!(refused, Err(MeasurementError::NotFromHost));
    let board = worn.joint;
    for (code, deg) in [
        (3000, 0.0),
        (1000, 100.0),
        (2000, 50.0),
        (0, 150.0),
        (4095, -54.75),
    ] {
        assert_eq!(board.angle_from_code(code), Some(degrees(deg)));
    }
    let read = board.angle_from_code(2000);
    let orders = board.tick(&mut worn.state, now, read).unwrap();
    assert_eq!(orders.measured, degrees(50.0));
}
