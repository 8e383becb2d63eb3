//! The endpoint study: its algebra against other ways to the same numbers, its calibration
//! on bodies, one replication whole.

use hal_sim::body::arm::{ArmSpec, ELECTRODES, ImuFault};
use hal_sim::random::Random;
use nalgebra::{DMatrix, Vector3};
use studies::endpoint::{
    Features, LeastSquares, Limb, NearestNeighbour, Participant, Recruits, Study, Target, align,
    calibrated, check_imus, frame_of, geometry_error_deg, median, pearson, reachable_n,
    replication, ridge, switches, torques, twitches,
};

fn study() -> Study {
    Study::declared().unwrap()
}

/// A limb by cursory anatomy with these gains.
fn limb(gain: f64) -> Limb {
    let mut limb = Participant::drawn(&study(), 5, 0).unwrap().cursory();
    limb.gains = [gain; ELECTRODES];
    limb
}

fn wrenches(n: usize) -> Vec<[f64; 6]> {
    let mut random = Random::new(9);
    (0..n)
        .map(|_| {
            let mut wrench = [0.0; 6];
            wrench[..3].fill_with(|| random.between(-40.0, 40.0));
            wrench
        })
        .collect()
}

#[test]
fn the_declaration_tells_all_that_is_wrong() {
    let text = studies::endpoint::DECLARED
        .replace("folds = 10", "folds = 1")
        .replace("ridge = 0.01", "ridge = 0")
        .replace("least = [0.85, 1.0]", "least = [1.0, 0.85]");
    let error = Study::read(&text).unwrap_err().to_string();
    for said in [
        "E715",
        "regression.folds",
        "regression.ridge",
        "comfort.least",
    ] {
        assert!(error.contains(said), "{error}");
    }
}

/// Of each joint one muscle at most, and only one that helps.
#[test]
fn the_nearest_neighbour_takes_one_helping_muscle_of_a_joint() {
    let limb = limb(5.0);
    let arms = limb.arms_m();
    for wrench in wrenches(200) {
        let forces = NearestNeighbour.forces_n(&limb, &wrench);
        let wanted = limb.frame.torques(&wrench);
        for (joint, torque) in wanted.iter().enumerate() {
            let members: Vec<usize> = (0..ELECTRODES)
                .filter(|at| limb.actions[*at].joint == joint)
                .collect();
            let chosen: Vec<usize> = members
                .iter()
                .copied()
                .filter(|at| forces[*at] > 0.0)
                .collect();
            let along = |at: usize| torque.dot(&arms[at].normalize());
            let best = members.iter().map(|at| along(*at)).fold(f64::MIN, f64::max);
            match chosen[..] {
                [] => assert!(best <= 0.0),
                [at] => {
                    assert_eq!(along(at), best);
                    // Line 11: the torque along the muscle's is the wanted one's share.
                    let made = forces[at] * arms[at].norm();
                    assert!((made - best).abs() < 1e-12 * best.max(1.0));
                }
                _ => panic!("{chosen:?}"),
            }
        }
    }
}

/// Bounded least squares against its optimality conditions: each force at a bound is pushed
/// against it, each between is balanced, to 1e-9 of the torque's scale.
#[test]
fn least_squares_meets_its_conditions() {
    let limb = limb(2.0);
    let squares = LeastSquares { ridge_m: 0.002 };
    let (arms, most) = (limb.arms_m(), limb.greatest_n());
    let mut at_bounds = [0; 2];
    for wrench in wrenches(300) {
        let forces = squares.forces_n(&limb, &wrench);
        let (made, wanted) = (torques(&limb, &forces), limb.frame.torques(&wrench));
        for (at, action) in limb.actions.iter().enumerate() {
            let left = wanted[action.joint] - made[action.joint];
            let slope = left.dot(&arms[at]) - 0.002 * 0.002 * forces[at];
            if forces[at] <= 0.0 {
                at_bounds[0] += 1;
                assert!(slope < 1e-9, "{slope}");
            } else if forces[at] >= most[at] {
                at_bounds[1] += 1;
                assert!(slope > -1e-9, "{slope}");
            } else {
                assert!(slope.abs() < 1e-9, "{slope}");
            }
        }
        // It never leaves more of the joints' torque undone than the nearest neighbour held
        // to the same bounds, but for the ridge.
        let near = NearestNeighbour.forces_n(&limb, &wrench);
        let near = std::array::from_fn(|at| f64::min(near[at], most[at]));
        let cost = |forces: &[f64; ELECTRODES]| {
            let made = torques(&limb, forces);
            let left: f64 = wanted
                .iter()
                .zip(made)
                .map(|(a, b)| (a - b).norm_squared())
                .sum();
            left + 4e-6 * forces.iter().map(|it| it * it).sum::<f64>()
        };
        assert!(cost(&forces) <= cost(&near) + 1e-9);
    }
    assert!(at_bounds.iter().all(|it| *it > 20), "{at_bounds:?}");
}

#[test]
fn what_is_reachable_saturates_one_muscle() {
    let limb = limb(3.0);
    for direction in studies::endpoint::DIRECTIONS {
        let size = reachable_n(&limb, &direction);
        let [x, y, z] = direction.map(|it| it * size);
        let forces = NearestNeighbour.forces_n(&limb, &[x, y, z, 0.0, 0.0, 0.0]);
        let most = limb.greatest_n();
        let parts = (0..ELECTRODES).filter(|at| limb.actions[*at].joint > 0);
        let greatest = parts.map(|at| forces[at] / most[at]).fold(0.0, f64::max);
        assert!((greatest - 1.0).abs() < 1e-9, "{direction:?} {greatest}");
    }
}

#[test]
fn least_squares_switches_less_than_the_nearest_neighbour() {
    let limb = limb(3.0);
    let near = switches(&NearestNeighbour, &limb, 20.0, 0.1);
    let squares = switches(&LeastSquares { ridge_m: 0.002 }, &limb, 20.0, 0.1);
    assert!(
        near.jumps > 0 && squares.greatest < near.greatest,
        "{near:?} {squares:?}"
    );
}

/// The dual against the primal normal equations, solved by another factorisation.
#[test]
fn ridge_is_what_the_normal_equations_say() {
    let how = study().regression;
    let features = Features::new(&how, 3, 1);
    let mut random = Random::new(4);
    let mut draw = |n: usize| -> Vec<Vec<f64>> {
        (0..n)
            .map(|_| (0..3).map(|_| random.unit()).collect())
            .collect()
    };
    let (inputs, outputs) = (draw(40), draw(40));
    let rows = features.rows(&inputs);
    let wanted = DMatrix::from_fn(40, 3, |r, c| outputs[r][c]);
    let dual = ridge(&rows, &wanted, how.ridge).unwrap();
    let mut normal = rows.transpose() * &rows;
    for at in 0..normal.nrows() {
        normal[(at, at)] += how.ridge;
    }
    let primal = normal.lu().solve(&(rows.transpose() * &wanted)).unwrap();
    let off = (&dual - &primal).amax() / primal.amax();
    assert!(off < 1e-9, "{off}");
}

/// Features' products are a Gaussian kernel, to what so many features allow.
#[test]
fn features_are_of_the_gaussian_kernel() {
    let mut how = study().regression;
    how.features = 20_000;
    let features = Features::new(&how, 2, 3);
    for distance in [0.3_f64, 1.0, 2.0] {
        let product = features
            .of(&[0.1, 0.2])
            .dot(&features.of(&[0.1, 0.2 + distance]));
        let kernel = (-0.5 * (distance / how.length_scale).powi(2)).exp();
        assert!((product - kernel).abs() < 0.03, "{product} {kernel}");
    }
}

/// A published pair: Anscombe's first set has r = 0.81642 and t = 4.2415, two-sided
/// p = 0.00217.
#[test]
fn correlation_is_pearsons() {
    let x = [10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0];
    let y = [
        8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68,
    ];
    let found = pearson(&x, &y).unwrap();
    assert!((found.r - 0.816_420_516_344_84).abs() < 1e-12, "{found:?}");
    assert!(
        (found.p - 0.5 * 0.002_169_628_873_078_8).abs() < 1e-11,
        "{found:?}"
    );
    let down = pearson(&x, &y.map(|it| -it)).unwrap();
    assert!((down.p + found.p - 1.0).abs() < 1e-12);
    assert!(pearson(&x, &[1.0; 11]).is_err());
}

#[test]
fn alignment_undoes_a_turn_about_the_vertical() {
    let mut random = Random::new(2);
    let turn = 0.7_f64;
    let mut targets: Vec<Target> = (0..12)
        .map(|command| {
            let [x, y, z] = [0; 3].map(|_| random.between(-5.0, 5.0));
            let turned = [
                turn.cos() * x - turn.sin() * y,
                turn.sin() * x + turn.cos() * y,
            ];
            Target {
                command,
                wanted_n: [x, y, z],
                measured: [
                    turned[0],
                    turned[1],
                    z,
                    0.1 * turned[0],
                    0.1 * turned[1],
                    0.0,
                ],
                currents_ma: [0.0; 9],
            }
        })
        .collect();
    let found = align(&mut targets);
    assert!((found + turn).abs() < 1e-12, "{found}");
    for it in &targets {
        for axis in 0..3 {
            assert!((it.measured[axis] - it.wanted_n[axis]).abs() < 1e-12);
        }
        assert!((it.measured[3] - 0.1 * it.wanted_n[0]).abs() < 1e-12);
    }
}

/// Calibrated on a body without noise, lines of action turn the limb the way it turned, and
/// gains follow what a stronger body gives.
#[test]
fn calibration_finds_turning_and_strength() {
    let study = study();
    let calibrate = |stronger: f64| {
        let mut person = Participant::drawn(&study, 7, 1).unwrap();
        let mut spec: ArmSpec = person.arm.spec().clone();
        spec.reached = spec.reached.map(|it| stronger * it);
        (spec.force_noise, spec.crosstalk) = (0.0, [0.0; ELECTRODES]);
        spec.imu.askew_deg = 0.0;
        (spec.imu.gyro_noise_rad_s, spec.imu.gyro_bias_rad_s) = (0.0, 0.0);
        person.arm = hal_sim::body::arm::Arm::new(spec).unwrap();
        person.now_us = 0;
        let cursory = person.cursory();
        let turning = twitches(&mut person.arm, &cursory, &study, &mut person.now_us);
        let limb = calibrated(&cursory, (&turning, &[]), 77.0, &study).unwrap();
        let mut angles = Vec::new();
        for (channel, turned) in turning.iter().enumerate() {
            let mean: Vector3<f64> = turned.iter().sum();
            angles.push(limb.arms_m()[channel].angle(&mean).to_degrees());
        }
        let (before, after) = (
            geometry_error_deg(&cursory, &person.arm),
            geometry_error_deg(&limb, &person.arm),
        );
        println!("to turning {angles:.0?}, geometry {before:.0?} to {after:.0?}");
        assert!(
            angles.iter().all(|it| *it < 90.0) && median(&angles) < 30.0,
            "{angles:?}"
        );
        limb
    };
    let (weak, strong) = (calibrate(1.0), calibrate(2.0));
    for (weak, strong) in weak.gains.iter().zip(strong.gains) {
        assert!((strong / weak - 2.0).abs() < 0.05, "{weak} {strong}");
    }
}

#[test]
fn imus_that_are_missing_or_swapped_are_named() {
    for index in 0..20 {
        let spec = ArmSpec::drawn(11, index);
        check_imus(&spec).unwrap();
        for (segment, name) in ["shoulder", "upper arm", "forearm"].iter().enumerate() {
            let mut wrong = spec.clone();
            wrong.imu_faults[segment] = ImuFault::Missing;
            let error = check_imus(&wrong).unwrap_err().to_string();
            assert!(
                error.contains(&format!("IMU of the {name} reads nothing")),
                "{error}"
            );
        }
        for (segment, name) in ["upper arm", "forearm"].iter().enumerate() {
            for order in [[2, 1, 3], [1, 3, 2], [-1, -2, 3], [2, 3, 1]] {
                let mut wrong = spec.clone();
                wrong.imu_faults[segment + 1] = ImuFault::Swapped(order);
                let error = check_imus(&wrong).unwrap_err().to_string();
                assert!(
                    error.contains(&format!("{name} reads its axes as")),
                    "{error}"
                );
            }
        }
    }
}

/// One replication of a short protocol: every condition, the same again from the same seed.
/// `--nocapture` prints it.
#[test]
fn a_replication_is_whole_and_repeats() {
    let mut study = study();
    study.protocol.repetitions = 2;
    study.protocol.voluntary_repetitions = 2;
    study.protocol.contraction_s = 0.5;
    study.protocol.rest_s = 0.5;
    study.protocol.pause_s = 2.0;
    let run = || replication(&study, 3, 0).unwrap();
    let first = run();
    let text = |it| serde_json::to_string(it).unwrap();
    assert_eq!(text(&first), text(&run()));
    for person in &first.people {
        let names: Vec<&str> = person.conditions.iter().map(|it| it.name).collect();
        assert_eq!(names, studies::endpoint::CONDITIONS);
        for it in &person.conditions {
            let of = if it.name == "C1" { 12 } else { 24 };
            assert_eq!(it.targets.len(), of);
            println!(
                "{:8} diag {:.2?} rmse {:.1?} range {:.1?} median {:.1} table {:?}",
                it.name,
                it.measures.diagonal(),
                it.measures.rmse_n,
                it.measures.range_n,
                it.measures.median_n(),
                it.table_1.first(),
            );
        }
        println!("geometry {:.0?}", person.geometry_deg);
        println!("gains {:.2?}", person.gains);
        println!("{:?} {:.2?}", person.switches, person.freshness);
    }
    // S1's own frame was found on S1: nothing but noise is between it and the calibration.
    let s1 = frame_of(&study, &Participant::drawn(&study, 3, 0).unwrap()).unwrap();
    assert_eq!(s1.gains, first.people[0].gains[0]);
}
