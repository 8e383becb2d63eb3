//! The arm's specification, and the muscles that a force recruits.

use firmware::bench::limb::{before_the_trunk, nominal_limb};
use firmware::limb::{
    Choice, Jacobians, Limb, LimbError, LimbSpec, LineSpec, ReachError, Vector, Wrench,
};
use firmware::units::{Amplitude, Angle};

/// Positions of lines in the nominal arm.
const BICEPS: u8 = 0;
const TRICEPS: u8 = 1;
const TRAPEZIUS: u8 = 7;

fn arm() -> (Limb, Jacobians<f32>) {
    let limb = Limb::new(&nominal_limb()).unwrap();
    let given = limb.jacobians_at_posture(&before_the_trunk()).unwrap();
    (limb, given)
}

fn mistakes(change: impl FnOnce(&mut LimbSpec)) -> Vec<LimbError> {
    let (mut spec, mut found) = (nominal_limb(), Vec::new());
    change(&mut spec);
    spec.report_mistakes(&mut |mistake| found.push(mistake));
    assert_eq!(Limb::<f32>::new(&spec).err(), found.first().copied());
    found
}

/// Returns the text of the single mistake in a changed line.
fn of_line(line: usize, change: impl FnOnce(&mut LineSpec)) -> String {
    let found = mistakes(|spec| change(&mut spec.lines[line]));
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].to_string()
}

#[test]
fn a_field_outside_its_range_is_named() {
    assert_eq!(
        of_line(4, |line| line.gain_mn_per_ma = 0),
        "line 4: gain_mn_per_ma is 0; allowed: 1 to 100000000"
    );
    assert_eq!(
        of_line(2, |line| line.channel = 10),
        "line 2: channel is 10; allowed: 0 to 9"
    );
    assert_eq!(
        of_line(2, |line| line.channel = 8),
        "line 8: channel 8 already has a line"
    );
    assert_eq!(
        of_line(1, |line| line.limit = Amplitude::new(8_000)),
        "line 1: limit is 8000; allowed: 8001 to 200000"
    );
    assert_eq!(
        of_line(0, |line| line.vias[1].at_um[2] = 1_000_001),
        "line 0: at_um is 1000001; allowed: -1000000 to 1000000"
    );
    // A biceps on the forearm alone moves no elbow.
    assert_eq!(
        of_line(0, |line| line.vias[0].segment = 3),
        "line 0: segment is 3; allowed: 0 to 2"
    );
    let bones = mistakes(|spec| {
        spec.offsets_um[2] = [0, 0, -9_000];
        spec.ranges_mdeg[4] = (-81_000, 10_000);
        spec.ranges_mdeg[6] = (20_000, 10_000);
        spec.lines.clear();
    });
    let words: Vec<String> = bones.iter().map(ToString::to_string).collect();
    assert_eq!(
        words,
        [
            "way 2: offsets_um is 9000; allowed: 10000 to 1000000",
            "axis 4: ranges_mdeg is -81000; allowed: -80000 to 80000",
            "axis 6: ranges_mdeg is 10000; allowed: 20000 to 180000",
            "lines is 0; allowed: 1 to 10",
        ]
    );
}

#[test]
fn a_posture_outside_the_joint_s_range_is_refused() {
    let (limb, _) = arm();
    let mut posture = before_the_trunk();
    posture[6] = Angle::from_millideg(130_500);
    let refused = limb.jacobians_at_posture(&posture).unwrap_err();
    assert_eq!(
        refused.to_string(),
        "axis 6 is at 130500 m°; allowed: 0 to 130000 m°"
    );
}

/// With all angles at zero the arm hangs; the expected hand position is computed by hand from the
/// specification.
#[test]
fn the_hanging_arm_lies_where_its_bones_add_up() {
    let (limb, _) = arm();
    let pose = limb.skeleton().pose(&[0.0; 9]);
    let [x, y, z] = pose.hand.to_array();
    for (found, expected) in [(x, -0.01), (y, 0.17), (z, -0.54)] {
        assert!((found - expected).abs() < 1e-6, "{found} {expected}");
    }
    // Flexed by 90°, the forearm points forward, which is −x.
    let mut bent = [0.0; 9];
    bent[6] = std::f32::consts::FRAC_PI_2;
    let [x, _, z] = limb.skeleton().pose(&bent).hand.to_array();
    assert!(
        (x + 0.27).abs() < 5e-4 && (z + 0.28).abs() < 5e-4,
        "{x} {z}"
    );
}

/// A force along the forearm's swing flexes or extends the elbow, and each muscle gets the force
/// that its lever arm needs for the requested torque.
#[test]
fn the_elbow_s_two_muscles_answer_opposite_forces() {
    let (limb, given) = arm();
    // Elbow flexion moves the hand in this direction.
    let swing = given.arm()[6].linear;
    for (sign, line) in [(1.0, BICEPS), (-1.0, TRICEPS)] {
        let force = swing.times(sign * 20.0);
        let wanted = Wrench {
            force,
            torque: Vector::ZERO,
        };
        let recruited = limb.recruit(&given, &wanted).unwrap();
        let Choice::Line(found, newtons) = recruited.joints[2] else {
            panic!("{:?}", recruited.joints);
        };
        assert_eq!(found, line);
        // The muscle's torque along its own lever arm equals that part of the requested torque.
        let levers = given.muscles().nth(line.into()).unwrap();
        let torques = given.torques(&wanted);
        let along: f32 = (6..9).map(|axis| levers[axis] * torques[axis]).sum();
        let square: f32 = (6..9).map(|axis| levers[axis] * levers[axis]).sum();
        assert!((newtons - along / square).abs() < 1e-4 * newtons);
        // 9 N/mA from 8 mA on.
        let expected = 8_000.0 + newtons / 9.0 * 1000.0;
        let (_, amplitude) = recruited.orders.iter().find(|(c, _)| *c == line).unwrap();
        assert!((f64::from(amplitude.get()) - f64::from(expected)).abs() <= 1.0);
    }
}

/// The printed argmax would choose the trapezius with a negative force, although it lifts where the
/// girdle should sink.
#[test]
fn where_every_muscle_pulls_the_other_way_none_is_chosen() {
    let (_, given) = arm();
    let levers = given.muscles().nth(TRAPEZIUS.into()).unwrap();
    let wanted = [-1.0, 1.0].map(|sign| {
        // A torque about the sternoclavicular joint along the trapezius' own.
        let force = (0..3).fold(Vector::ZERO, |sum, axis| {
            sum.plus(given.arm()[axis].linear.times(sign * 300.0 * levers[axis]))
        });
        Wrench {
            force,
            torque: Vector::ZERO,
        }
    });
    let [against, along] = wanted.map(|wanted| firmware::limb::nearest(&given, &wanted)[0]);
    assert_eq!(against, Choice::Unhelped);
    assert!(matches!(along, Choice::Line(TRAPEZIUS, _)), "{along:?}");
    // Without any other muscle the force is impossible, and nothing is sent.
    let mut alone = nominal_limb();
    let trapezius = alone.lines[usize::from(TRAPEZIUS)].clone();
    alone.lines.clear();
    alone.lines.push(trapezius).unwrap();
    let alone = Limb::<f32>::new(&alone).unwrap();
    let given = alone.jacobians_at_posture(&before_the_trunk()).unwrap();
    let refused = alone.recruit(&given, &wanted[0]).unwrap_err();
    assert_eq!(refused, ReachError::NoMuscleHelps);
    let rest = alone.recruit(&given, &Wrench::default()).unwrap();
    assert!(rest.orders.is_empty() && rest.joints == [Choice::None; 3]);
}

/// The named share of a wrench is feasible as a whole, and hardly more is.
#[test]
fn a_wrench_that_is_too_strong_names_the_share_that_can_be_made() {
    let (limb, given) = arm();
    let mut refused = 0;
    for n in 0..500_u16 {
        let angle = f32::from(n) * 0.7;
        let (force, up) = (f32::from(n), (angle * 0.31).sin());
        let wanted = Wrench::from_force(force * angle.cos(), force * angle.sin(), force * up);
        let Err(ReachError::TooStrong { line, share }) = limb.recruit(&given, &wanted) else {
            continue;
        };
        refused += 1;
        assert!((0.0..1.0).contains(&share) && line < 9);
        let made = limb.recruit(&given, &wanted.times(share * 0.999_999));
        let limit = Amplitude::new(25_000);
        let strongest = made.unwrap().orders.iter().map(|order| order.1).max();
        assert!(strongest >= Some(Amplitude::new(24_999)) && strongest <= Some(limit));
        assert!(
            limb.recruit(&given, &wanted.times(share * 1.000_01))
                .is_err()
        );
    }
    assert!(refused > 100, "{refused}");
}

/// Forces of another recruitment never exceed the wearer's limit, and zero force gives no
/// amplitude.
#[test]
fn forces_become_amplitudes_within_limits() {
    let (limb, _) = arm();
    let orders = limb.orders(&[0.0, -1.0, 1e9, 7.0, f32::NAN]);
    let found: Vec<_> = orders.iter().map(|(c, a)| (*c, a.get())).collect();
    // 7 N at 6 N/mA above 8 mA.
    assert_eq!(found, [(2, 25_000), (3, 9_167)]);
}

/// For any force in any posture of the range, the amplitudes are within limits or the force is
/// refused, and NaN recruits nothing.
#[test]
fn no_wish_brings_an_amplitude_outside_the_wearer_s_range() {
    let spec = nominal_limb();
    let limb = Limb::<f32>::new(&spec).unwrap();
    let strange = [
        0.0,
        -0.0,
        1e-30,
        3.0,
        1e30,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
    ];
    for n in 0..64_usize {
        let mut posture = before_the_trunk();
        for (axis, angle) in posture.iter_mut().enumerate() {
            let (low, high) = spec.ranges_mdeg[axis];
            *angle = Angle::from_millideg(if n >> (axis % 6) & 1 == 0 { low } else { high });
        }
        let given = limb.jacobians_at_posture(&posture).unwrap();
        for x in strange {
            for z in strange {
                let wanted = Wrench::from_force(x, if n % 2 == 0 { -x } else { x }, z);
                match limb.recruit(&given, &wanted) {
                    Ok(recruited) => {
                        let range = Amplitude::new(8_000)..=Amplitude::new(25_000);
                        assert!(
                            recruited
                                .orders
                                .iter()
                                .all(|order| range.contains(&order.1))
                        );
                        assert!(x.is_finite() && z.is_finite() || recruited.orders.is_empty());
                    }
                    Err(ReachError::TooStrong { share, .. }) => {
                        assert!((0.0..1.0).contains(&share), "{share}");
                    }
                    Err(ReachError::NoMuscleHelps) => {}
                }
            }
        }
    }
}
