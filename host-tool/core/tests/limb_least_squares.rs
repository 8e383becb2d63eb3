//! Bounded least squares compared with the crate `nnls` and with the conditions of a minimum, and
//! applied to arms.

use firmware::bench::limb::{before_the_trunk, nominal_limb};
use firmware::limb::{JointName, LINES, Limb, LimbSpec, LineSpec, ViaSpec};
use firmware::units::Angle;
use hal_sim::random;
use host_core::limb::{
    Bounded, Exact, LeastSquares, PostureMatrices, RecruitmentError, Weights, amplitudes, force,
};
use nalgebra::{SMatrix, SVector};
use ndarray::{Array1, Array2};

type Square = SMatrix<f64, LINES, LINES>;
type Column = SVector<f64, LINES>;

/// Returns random problem `n`: rows of levers, a wanted torque, and limits in newtons, some of them
/// 0.
fn problem(n: u64) -> Bounded {
    let mut index = n * 1000;
    let mut part = || {
        index += 1;
        random::unit(7, index) - 0.5
    };
    let levers = SMatrix::<f64, 9, LINES>::from_fn(|_, _| part() * 0.06);
    let wanted = SVector::<f64, 9>::from_fn(|_, _| part() * 10.0);
    Bounded {
        curvature: levers.transpose() * levers + Square::identity() * 1e-5,
        slope: levers.transpose() * wanted,
        upper: Column::from_fn(|line, _| match (n + line as u64) % 23 {
            0 => 0.0,
            _ => 60.0 + 110.0 * part(),
        }),
    }
}

/// Solves the problem by Lawson and Hanson's least-distance programming (Solving Least Squares
/// Problems, chapter 23), which `nnls` solves as one non-negative problem: with H = L·Lᵀ and z =
/// Lᵀ(x − H⁻¹c), the shortest z with G·z ≥ h.
fn by_nnls(problem: &Bounded) -> Column {
    let factor = problem.curvature.cholesky().unwrap();
    let unbounded = factor.solve(&problem.slope);
    let back = factor.l().transpose().try_inverse().unwrap();
    let mut e = Array2::<f64>::zeros((LINES + 1, 2 * LINES));
    for j in 0..LINES {
        for i in 0..LINES {
            e[(i, j)] = back[(j, i)];
            e[(i, j + LINES)] = -back[(j, i)];
        }
        e[(LINES, j)] = -unbounded[j];
        e[(LINES, j + LINES)] = unbounded[j] - problem.upper[j];
    }
    let mut f = Array1::<f64>::zeros(LINES + 1);
    f[LINES] = 1.0;
    let (y, _) = nnls::nnls(e.view(), f.view());
    let r = e.dot(&y) - &f;
    let z = Column::from_fn(|i, _| -r[i] / r[LINES]);
    unbounded + back * z
}

#[test]
fn answers_are_those_of_another_implementation() {
    let (mut worst, mut at_bounds) = (0.0_f64, [0; 3]);
    // If a limit is 0, both bounds of the muscle are equal, on which `nnls` panics.
    for problem in (0..3000).map(problem).filter(|p| p.upper.min() > 0.0) {
        let x = problem.solve().unwrap();
        let scale = problem.upper.amax();
        worst = worst.max((x - by_nnls(&problem)).amax() / scale);
        for (x, upper) in x.iter().zip(&problem.upper) {
            let place = usize::from(*x > 0.0) + usize::from(x == upper);
            at_bounds[place] += 1;
        }
    }
    println!("worst {worst:.1e} of the largest limit; at 0, between, at limit {at_bounds:?}");
    assert!(worst < 1e-9, "{worst}");
    assert!(at_bounds.iter().all(|&count| count > 1000), "{at_bounds:?}");
}

/// At a minimum in a box, every component of the gradient is zero or points against a bound.
#[test]
fn answers_meet_the_conditions_of_a_minimum() {
    let mut worst = 0.0_f64;
    for problem in (0..20_000).map(problem) {
        let x = problem.solve().unwrap();
        let gradient = problem.curvature * x - problem.slope;
        let scale = problem.slope.amax();
        for line in 0..LINES {
            let (x, upper) = (x[line], problem.upper[line]);
            assert!((0.0..=upper).contains(&x));
            let slope = gradient[line] / scale;
            let off = match (x == 0.0, x == upper) {
                (true, true) => 0.0,
                (true, false) => -slope,
                (false, true) => slope,
                (false, false) => slope.abs(),
            };
            worst = worst.max(off);
        }
    }
    println!("worst {worst:.1e} of the largest slope");
    assert!(worst < 1e-9, "{worst}");
}

/// Two identical muscles, on which `nnls` panics, each take half.
#[test]
fn muscles_that_are_alike_share() {
    let alike = Square::from_fn(|i, j| match (i < 2 && j < 2, i == j) {
        (true, _) => 1.0 + if i == j { 0.5 } else { 0.0 },
        (false, same) => f64::from(u8::from(same)),
    });
    for (upper, expected) in [(9.0, 0.8), (0.3, 0.3)] {
        let mut slope = Column::zeros();
        (slope[0], slope[1]) = (2.0, 2.0);
        let problem = Bounded {
            curvature: alike,
            slope,
            upper: Column::repeat(upper),
        };
        let x = problem.solve().unwrap();
        assert!(
            (x[0] - expected).abs() < 1e-12 && (x[1] - expected).abs() < 1e-12,
            "{x}"
        );
        assert_eq!(x.rows(2, 8).amax(), 0.0);
    }
}

fn arm(spec: &LimbSpec) -> (Limb<Exact>, PostureMatrices) {
    let limb = Limb::<Exact>::new(spec).unwrap();
    let posed =
        PostureMatrices::new(&limb.jacobians_at_posture(&before_the_trunk()).unwrap()).unwrap();
    (limb, posed)
}

/// Small forces are produced nearly exactly, large ones up to the limits.
#[test]
fn forces_stay_between_nothing_and_the_most() {
    let (limb, posed) = arm(&nominal_limb());
    let most: Vec<f64> = limb.max_forces().map(|most| most.0).collect();
    let mut squares = LeastSquares::new(&limb, Weights::DECLARED).unwrap();
    for n in 0..200_u32 {
        let angle = f64::from(n);
        let strength = f64::from(n) * 2.0;
        let wanted = force([angle.cos(), angle.sin(), (0.37 * angle).sin()].map(|x| x * strength));
        let found = squares.recruit(&posed, &wanted).unwrap();
        for (line, most) in most.iter().enumerate() {
            assert!((0.0..=*most).contains(&found.forces[line]));
        }
        // The tenth channel has no line.
        assert_eq!(found.forces[9], 0.0);
        // The solution is better than no activation at all, whose value is 0.
        let problem = squares.problem(&posed, &wanted);
        let x = found.forces;
        let value = 0.5 * x.dot(&(problem.curvature * x)) - problem.slope.dot(&x);
        assert!(n == 0 || value < 0.0, "{n}");
        let device = Limb::<f32>::new(&nominal_limb()).unwrap();
        let orders = amplitudes(&device, &found.forces);
        assert!(
            orders
                .iter()
                .all(|(_, a)| (8_000..=25_000).contains(&a.get()))
        );
    }
}

/// With a second elbow extensor from the shoulder blade, least squares uses its effect at both
/// joints.
#[test]
fn a_two_joint_muscle_is_used_for_both_joints() {
    let nominal = nominal_limb();
    let mut two = nominal.clone();
    let via = |segment, at_um| ViaSpec { segment, at_um };
    let vias = [
        via(1, [45_000, 140_000, -10_000]),
        via(2, [25_000, 0, -290_000]),
        via(3, [20_000, 0, 15_000]),
    ];
    let long_head = LineSpec {
        channel: 9,
        joint: JointName::Elbow,
        vias: vias.into_iter().collect(),
        ..nominal.lines[1].clone()
    };
    two.lines.push(long_head).unwrap();
    let missed = |spec: &LimbSpec| {
        let (limb, posed) = arm(spec);
        // The wanted force extends the elbow and draws the upper arm back.
        let wanted = posed.given
            * (posed.levers * Column::from_fn(|n, _| f64::from(u8::from(n == 9)) * 40.0));
        let (wanted, used) = match limb.lines().len() {
            10 => (wanted, true),
            _ => (force([8.0, 0.0, -8.0]), false),
        };
        let found = LeastSquares::new(&limb, Weights::DECLARED)
            .unwrap()
            .recruit(&posed, &wanted);
        let found = found.unwrap();
        (found.force_error_n(&wanted), used && found.forces[9] > 10.0)
    };
    let (misses, is_used) = missed(&two);
    assert!(is_used && misses < 1.0, "{misses}");
    assert!(!missed(&nominal).1);
}

/// Along a reference force that turns slowly, the cost of changes makes them smaller.
#[test]
fn the_weight_of_change_smooths() {
    let (limb, posed) = arm(&nominal_limb());
    let walked = |weights| {
        let mut recruit = LeastSquares::new(&limb, weights).unwrap();
        let mut last: Option<Column> = None;
        let (mut largest, mut missed) = (0.0_f64, 0.0);
        for step in 0..400 {
            let angle = f64::from(step) * std::f64::consts::TAU / 400.0;
            let wanted = force([20.0 * angle.cos(), 20.0 * angle.sin(), 0.0]);
            let found = recruit.recruit(&posed, &wanted).unwrap();
            if let Some(last) = last {
                largest = largest.max((found.forces - last).amax());
            }
            missed += found.force_error_n(&wanted) / 400.0;
            last = Some(found.forces);
        }
        (largest, missed)
    };
    let ((rough, exact), (smooth, late)) = (walked(Weights::DECLARED), walked(Weights::SMOOTH));
    println!("largest step {rough:.2} N, smoothed {smooth:.2} N; missed {exact:.2} N, {late:.2} N");
    assert!(smooth < rough, "{smooth} {rough}");
    assert!(late > exact, "{late} {exact}");
}

#[test]
fn what_cannot_be_had_is_told() {
    let mut spec = nominal_limb();
    spec.lines[3].gain_mn_per_ma = 0;
    spec.ranges_mdeg[4].0 = -90_000;
    let mistakes = RecruitmentError::check_spec(&spec).unwrap_err().to_string();
    assert_eq!(
        mistakes,
        "E700 the specification of the arm has mistakes:\n  \
         axis 4: ranges_mdeg is -90000; allowed: -80000 to 80000 (shoulder abduction)\n  \
         line 3: gain_mn_per_ma is 0; allowed: 1 to 100000000 (channel 3): a muscle without \
         gain gives no force at any amplitude"
    );
    let (limb, posed) = arm(&nominal_limb());
    let mut posture = before_the_trunk();
    posture[6] = Angle::from_centideg(14_000);
    let refused =
        RecruitmentError::from(limb.jacobians_at_posture(&posture).unwrap_err()).to_string();
    assert!(refused.starts_with("E701 elbow flexion is 140°; allowed for this wearer: 0 to 130°"));
    let none = Weights {
        effort: 0.0,
        ..Weights::DECLARED
    };
    let refused = LeastSquares::new(&limb, none).unwrap_err().to_string();
    assert_eq!(
        refused,
        "E705 the weight `effort` of the least squares is 0; allowed: above 0"
    );
    let mut recruit = LeastSquares::new(&limb, Weights::DECLARED).unwrap();
    let refused = recruit.recruit_within(&posed, &force([0.0, 0.0, 900.0]), 5.0);
    let Err(RecruitmentError::Beyond { nearest, wanted_n }) = refused else {
        panic!("{refused:?}");
    };
    assert_eq!(wanted_n, 900.0);
    let beyond = RecruitmentError::Beyond { nearest, wanted_n }.to_string();
    let impossible = "E703 a force of 900.0 N is not possible in this posture; the largest in this";
    assert!(beyond.starts_with(impossible), "{beyond}");
    // The force named in the error is possible, and a slightly larger one is not.
    let times = |share: f64| force(nearest.map(|part| part * share));
    assert!(recruit.recruit_within(&posed, &times(1.0), 5.0).is_ok());
    assert!(recruit.recruit_within(&posed, &times(1.001), 5.0).is_err());
    let not_finite = recruit.recruit(&posed, &force([f64::NAN, 0.0, 0.0]));
    assert_eq!(not_finite, Err(RecruitmentError::NotConverged));
    // The bones hang in one line, which itself carries a load.
    let mut plumb = nominal_limb();
    plumb.offsets_um[1] = [0, 0, -150_000];
    let hanging = Limb::<Exact>::new(&plumb)
        .unwrap()
        .jacobians(&[Exact(0.0); 9]);
    let singular = PostureMatrices::new(&hanging).unwrap_err().to_string();
    assert!(
        singular.starts_with("E704 the joints and the hand lie in one line, so the arm"),
        "{singular}"
    );
}
