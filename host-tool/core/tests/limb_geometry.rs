//! The device's limb geometry in double precision compared with numerical derivatives, and the
//! device's own number format compared with double precision.

use firmware::bench::limb::{before_the_trunk, nominal_limb};
use firmware::limb::{
    AXES, JointName, Limb, LimbSpec, LineSpec, Number, Pose, Vector, ViaSpec, Wrench,
};
use firmware::units::{Amplitude, Angle};
use hal_sim::random;
use host_core::limb::{Exact, PostureMatrices, Single, ToDouble};

const POSTURES: u64 = 200;
/// Step of the central differences: both h² times the third derivative and 1e-16/h stay below 1e-9.
const STEP: f64 = 1e-5;

/// Returns the nominal limb with the long head of the triceps, from the shoulder blade over
/// shoulder and elbow.
fn with_biarticular() -> LimbSpec {
    let mut spec = nominal_limb();
    let via = |segment, at_um| ViaSpec { segment, at_um };
    let line = LineSpec {
        channel: 9,
        joint: JointName::Elbow,
        vias: [
            via(1, [45_000, 140_000, -10_000]),
            via(2, [25_000, 0, -290_000]),
            via(3, [20_000, 0, 15_000]),
        ]
        .into_iter()
        .collect(),
        gain_mn_per_ma: 8_000,
        threshold: Amplitude::new(8_000),
        limit: Amplitude::new(25_000),
    };
    spec.lines.push(line).unwrap();
    spec
}

/// Returns random posture `n` within the nominal arm's ranges, radians.
fn posture(n: u64, spec: &LimbSpec) -> [f64; AXES] {
    let mut index = n * AXES as u64;
    spec.ranges_mdeg.map(|(low, high)| {
        index += 1;
        let (low, high) = (f64::from(low), f64::from(high));
        ((high - low) * random::unit(18, index) + low) / 1000.0 * std::f64::consts::PI / 180.0
    })
}

fn exact(radians: [f64; AXES]) -> [Exact; AXES] {
    radians.map(Exact)
}

/// Returns the derivative of a quantity of the pose over one angle, by central differences.
fn derivative<const N: usize>(
    limb: &Limb<Exact>,
    at: [f64; AXES],
    axis: usize,
    tell: impl Fn(&Pose<Exact>) -> [f64; N],
) -> [f64; N] {
    let side = |step: f64| {
        let mut there = at;
        there[axis] += step;
        tell(&limb.skeleton().pose(&exact(there)))
    };
    let (after, before) = (side(STEP), side(-STEP));
    std::array::from_fn(|n| (after[n] - before[n]) / (2.0 * STEP))
}

#[test]
fn both_jacobians_are_the_differences_of_lengths_and_places() {
    let spec = with_biarticular();
    let limb = Limb::<Exact>::new(&spec).unwrap();
    let (mut arm, mut muscles, mut lines_moved) = (0.0_f64, 0.0_f64, 0);
    for n in 0..POSTURES {
        let at = posture(n, &spec);
        let jacobians = limb.jacobians(&exact(at));
        let levers: Vec<_> = jacobians.muscles().collect();
        for axis in 0..AXES {
            let lengths = derivative::<10>(&limb, at, axis, |pose| {
                std::array::from_fn(|line| limb.lines()[line].length(pose).0)
            });
            for (lever, slope) in levers.iter().zip(lengths) {
                let lever = lever[axis].0;
                muscles = muscles.max((lever + slope).abs());
                lines_moved += usize::from(lever.abs() > 1e-3);
            }
            let hand = derivative::<3>(&limb, at, axis, |pose| pose.hand.to_array().map(|x| x.0));
            let column = jacobians.arm()[axis].linear.to_array();
            for (slope, Exact(part)) in hand.into_iter().zip(column) {
                arm = arm.max((part - slope).abs());
            }
        }
    }
    println!("arm {arm:.1e} m/rad, muscles {muscles:.1e} m/rad");
    assert!(arm < 1e-8 && muscles < 1e-8, "{arm} {muscles}");
    // Every line has a lever at some joint, and those over two joints at both.
    assert!(lines_moved > POSTURES as usize * 10 * 2, "{lines_moved}");
}

/// Checks the rotation of the forearm with each angle, the second half of the Jacobian's columns.
#[test]
fn the_axes_are_those_that_the_forearm_turns_about() {
    let spec = nominal_limb();
    let limb = Limb::<Exact>::new(&spec).unwrap();
    let mut worst = 0.0_f64;
    for n in 0..POSTURES {
        let at = posture(n, &spec);
        let pose = limb.skeleton().pose(&exact(at));
        let [.., (_, forearm)] = pose.segments;
        for axis in 0..AXES {
            let turned = derivative::<3>(&limb, at, axis, |pose| {
                let [.., (_, forearm)] = pose.segments;
                forearm.x.to_array().map(|x| x.0)
            });
            let expected = pose.axes[axis].cross(forearm.x).to_array();
            for (found, Exact(expected)) in turned.into_iter().zip(expected) {
                worst = worst.max((found - expected).abs());
            }
        }
    }
    assert!(worst < 1e-8, "{worst}");
}

/// A line over two joints acts at both; nearest-neighbour control considers it at one.
#[test]
fn a_line_over_two_joints_has_levers_at_both() {
    let limb = Limb::<Exact>::new(&with_biarticular()).unwrap();
    let jacobians = limb.jacobians_at_posture(&before_the_trunk()).unwrap();
    let long_head = jacobians.muscles().nth(9).unwrap().map(|lever| lever.0);
    let about = |axes: std::ops::Range<usize>| {
        long_head[axes]
            .iter()
            .map(|lever| lever * lever)
            .sum::<f64>()
            .sqrt()
    };
    let [sc, gh, el] = [about(0..3), about(3..6), about(6..9)];
    assert!(sc == 0.0 && gh > 5e-3 && el > 10e-3, "{sc} {gh} {el}");
}

/// For a line with one section between the segments, equation (3) is the negative of our lever. An
/// additional section within a segment enters the average although it produces no torque.
#[test]
fn the_print_s_average_is_minus_the_lever_for_one_stretch_only() {
    let limb = Limb::<Exact>::new(&nominal_limb()).unwrap();
    let radians = limb.radians(&before_the_trunk()).unwrap();
    let pose = limb.skeleton().pose(&radians);
    let [.., (elbow, _)] = pose.segments;
    let printed = |line: usize| {
        let points: Vec<_> = limb.lines()[line].points(&pose).map(|(_, at)| at).collect();
        let stretches = points.len() - 1;
        let sum = points.windows(2).fold(Vector::ZERO, |sum, pair| {
            let u = pair[1].minus(pair[0]).direction();
            sum.plus(pair[1].minus(elbow).cross(u))
        });
        sum.times(Exact(1.0 / stretches as f64))
    };
    let ours = |line: usize| limb.lines()[line].torques(&pose)[2];
    let apart = |line: usize| {
        let sum = printed(line).plus(ours(line));
        sum.dot(sum).0.sqrt() / ours(line).dot(ours(line)).0.sqrt()
    };
    let (biceps, triceps) = (apart(0), apart(1));
    println!("biceps, one stretch: {biceps:.1e}; triceps, two: {triceps:.3} of the lever");
    assert!(biceps < 1e-12 && triceps > 0.05, "{biceps} {triceps}");
}

/// Hand position and levers with the device's functions compared with double precision over the
/// whole range, and the remaining error with exact functions in the device's number format.
#[test]
fn the_device_s_numbers_stay_near_exact_ones() {
    let spec = nominal_limb();
    let exact = Limb::<Exact>::new(&spec).unwrap();
    fn off<N: Number + ToDouble>(spec: &LimbSpec, exact: &Limb<Exact>) -> (f64, f64) {
        let limb = Limb::<N>::new(spec).unwrap();
        let (mut hand, mut lever) = (0.0_f64, 0.0_f64);
        for n in 0..POSTURES {
            let posture = posture(n, spec).map(|radians| {
                Angle::from_millideg((radians * 180_000.0 / std::f64::consts::PI) as i32)
            });
            let angles = (
                limb.radians(&posture).unwrap(),
                exact.radians(&posture).unwrap(),
            );
            let here = limb.skeleton().pose(&angles.0).hand.to_array();
            let there = exact.skeleton().pose(&angles.1).hand.to_array();
            let apart = here
                .into_iter()
                .zip(there)
                .map(|(a, b)| a.to_double() - b.0);
            hand = hand.max(apart.map(|x| x * x).sum::<f64>().sqrt());
            let (here, there) = (limb.jacobians(&angles.0), exact.jacobians(&angles.1));
            for (a, b) in here.muscles().flatten().zip(there.muscles().flatten()) {
                lever = lever.max((a.to_double() - b.0).abs());
            }
        }
        (hand, lever)
    }
    let (hand, lever) = off::<f32>(&spec, &exact);
    let (hand_rounded, lever_rounded) = off::<Single>(&spec, &exact);
    println!(
        "device: hand {:.3} mm, levers {:.4} mm; rounding alone {:.1e} mm, {:.1e} mm",
        hand * 1e3,
        lever * 1e3,
        hand_rounded * 1e3,
        lever_rounded * 1e3
    );
    // Nine rotations, each with an error of at most 1.1 mrad, move a hand at 0.7 m by at most 7 mm.
    assert!((2e-4..3e-3).contains(&hand), "{hand}");
    assert!((1e-5..3e-4).contains(&lever), "{lever}");
    assert!(
        hand_rounded < 2e-6 && lever_rounded < 2e-6,
        "{hand_rounded} {lever_rounded}"
    );
}

/// Converting a wrench to torques and back gives the same wrench.
#[test]
fn a_wrench_is_told_from_its_torques() {
    let limb = Limb::<Exact>::new(&nominal_limb()).unwrap();
    let jacobians = limb.jacobians_at_posture(&before_the_trunk()).unwrap();
    let posed = PostureMatrices::new(&jacobians).unwrap();
    let wanted = nalgebra::SVector::from([12.0, -7.0, 30.0, 0.4, -1.1, 0.6]);
    let back = posed.given * posed.torques(&wanted);
    assert!((back - wanted).amax() < 1e-10);
    // The device's module computes the same torques.
    let wrench = Wrench {
        force: Vector::new(Exact(12.0), Exact(-7.0), Exact(30.0)),
        torque: Vector::new(Exact(0.4), Exact(-1.1), Exact(0.6)),
    };
    for (ours, theirs) in posed
        .torques(&wanted)
        .iter()
        .zip(jacobians.torques(&wrench))
    {
        assert!((ours - theirs.0).abs() < 1e-12);
    }
}
