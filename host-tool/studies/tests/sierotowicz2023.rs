//! Tests of the endpoint study: its algebra against other methods, its calibration on simulated
//! arms, one whole replication.

use hal_sim::body::arm::{ArmSpec, ELECTRODES};
use hal_sim::random::Random;
use nalgebra::{DMatrix, Vector3};
use studies::sierotowicz2023::{
    Device, Features, Method, Model, Participant, Study, Target, align, frame_of, pearson,
    replication, ridge, switches,
};

fn study() -> Study {
    Study::load_embedded().unwrap()
}

/// Returns an arm by cursory anatomy with these gains.
fn device(gain: f64) -> (Model, Device) {
    let mut model = Participant::random(&study(), 5, 0).unwrap().cursory_model();
    model.gains = [gain; ELECTRODES];
    let device = Device::new(&model).unwrap();
    (model, device)
}

#[test]
fn the_declaration_tells_all_that_is_wrong() {
    let text = studies::sierotowicz2023::DECLARED
        .replace("folds = 10", "folds = 1")
        .replace("ridge = 0.01", "ridge = 0")
        .replace("least = [0.85, 1.0]", "least = [1.0, 0.85]");
    let error = Study::parse(&text).unwrap_err().to_string();
    for said in [
        "E715",
        "regression.folds",
        "regression.ridge",
        "comfort.least",
    ] {
        assert!(error.contains(said), "{error}");
    }
}

/// The model in the device is the intended arm: the hand's place by lengths and directions, a
/// forearm that flexion turns, and the torque of a line as a cross product, all computed here in
/// another way.
#[test]
fn the_device_is_told_the_arm_that_is_meant() {
    let (model, device) = device(2.0);
    let segments = device.segments();
    let stature = model.frame.stature_m;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    // Raised by 45 degrees between forward and right; axes are backward, right, up.
    let along = Vector3::new(-0.5, 0.5, -half);
    let elbow = 0.1 * stature * Vector3::y() + 0.186 * stature * along;
    assert!((segments[3].0 - elbow).norm() < 1e-5, "{}", segments[3].0);
    // Perpendicular to the upper arm, as far forward as possible.
    let forward = -Vector3::x();
    let front = (forward - along * along.dot(&forward)).normalize();
    let forearm = -segments[3].1.column(2);
    assert!((forearm - front).norm() < 1e-4, "{forearm}");
    // Biceps: from 0.20 m above the elbow, 0.03 m in front, to 0.05 m below, 0.02 m towards the
    // upper arm.
    let (origin, insertion) = (-0.20 * along + 0.03 * front, 0.05 * front - 0.02 * along);
    let torque = insertion.cross(&(origin - insertion).normalize());
    assert!((device.arm_m(0) - torque).norm() < 1e-5);
    let flexes = device.arm_m(0).dot(&along.cross(&front));
    assert!((0.02..0.06).contains(&flexes), "{flexes}");
}

/// Postures with a turned forearm are converted correctly, too.
#[test]
fn angles_put_the_arm_where_its_posture_says() {
    let (model, _) = device(2.0);
    for (plane, elevation, rotation, elbow) in [
        (0.0_f64, 60.0_f64, -30.0_f64, 20.0),
        (90.0, 70.0, 40.0, 80.0),
        (120.0, 30.0, 10.0, 100.0),
    ] {
        let mut model = model.clone();
        let posture = &mut model.frame.posture;
        (posture.plane_deg, posture.elevation_deg) = (plane, elevation);
        (posture.rotation_deg, posture.elbow_deg) = (rotation, elbow);
        let segments = Device::new(&model).unwrap().segments();
        let (p, e) = (plane.to_radians(), elevation.to_radians());
        let along = Vector3::new(-e.sin() * p.cos(), e.sin() * p.sin(), -e.cos());
        let upper = -segments[2].1.column(2);
        assert!((upper - along).norm() < 1e-4, "{upper} {along}");
        // The simulated arm's own bones, from other code, in the device's axes.
        let mut spec = ArmSpec::nominal();
        spec.posture = model.frame.posture;
        let bones = hal_sim::body::arm::Skeleton::new(spec.posture, spec.lengths());
        let [x, y, z] = studies::sierotowicz2023::turned(bones.forearm.into());
        let forearm = -segments[3].1.column(2);
        assert!((forearm - Vector3::new(x, y, z)).norm() < 1e-4, "{forearm}");
    }
}

/// The device reports all mistakes of a calibration.
#[test]
fn an_arm_that_cannot_be_is_refused() {
    let (mut model, _) = device(2.0);
    (model.gains[0], model.gains[3]) = (0.0, 1e9);
    let error = Device::new(&model).unwrap_err().to_string();
    for said in ["E700", "channel 0", "channel 3", "gain_mn_per_ma"] {
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn what_is_reachable_saturates_one_muscle() {
    let (_, device) = device(3.0);
    for direction in studies::sierotowicz2023::DIRECTIONS {
        let size = device.reachable_n(direction);
        let wanted = direction.map(|direction| direction * size);
        let forces = device.forces_n(Method::Exact, wanted).unwrap();
        // All but the trapezius, which belongs to the girdle.
        let mut parts = device.parts(&forces);
        parts[7] = 0.0;
        let greatest = parts.into_iter().fold(0.0, f64::max);
        assert!((greatest - 1.0).abs() < 1e-9, "{direction:?} {greatest}");
    }
}

/// In the device's arithmetic, the same muscles are recruited by nearly the same forces, and
/// currents stay within their ranges.
#[test]
fn the_devices_numbers_are_nearly_exact() {
    let (model, device) = device(3.0);
    for direction in studies::sierotowicz2023::DIRECTIONS {
        let wanted = direction.map(|direction| 10.0 * direction);
        let [ours, exact] =
            [Method::Nearest, Method::Exact].map(|method| device.forces_n(method, wanted).unwrap());
        assert!(
            (ours - exact).norm() < 5e-3 * exact.norm(),
            "{ours} {exact}"
        );
        for (ma, [least, greatest]) in device
            .currents_ma(&(10.0 * ours))
            .iter()
            .zip(model.ranges_ma)
        {
            let is_within = *ma >= least - 1e-3 && *ma <= greatest + 1e-3;
            assert!(*ma == 0.0 || is_within, "{ma} of {least} to {greatest}");
        }
        assert!(device.is_beyond(&(1e3 * ours)));
    }
}

#[test]
fn least_squares_switches_less_than_the_nearest_neighbour() {
    let (_, device) = device(3.0);
    let of = |method| switches(&device, method, 20.0, 0.1).unwrap();
    let (near, squares) = (of(Method::Nearest), of(Method::Squares));
    assert!(
        near.jumps > 0 && squares.greatest < near.greatest,
        "{near:?} {squares:?}"
    );
}

/// Compares the dual with the primal normal equations, solved by another factorisation.
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

/// Products of features approximate a Gaussian kernel, within the accuracy of their number.
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

/// A published pair: Anscombe's first set has r = 0.81642 and t = 4.2415, two-sided p = 0.00217.
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
    let down = pearson(&x, &y.map(|value| -value)).unwrap();
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
                is_beyond: false,
            }
        })
        .collect();
    let found = align(&mut targets);
    assert!((found + turn).abs() < 1e-12, "{found}");
    for target in &targets {
        for axis in 0..3 {
            assert!((target.measured[axis] - target.wanted_n[axis]).abs() < 1e-12);
        }
        assert!((target.measured[3] - 0.1 * target.wanted_n[0]).abs() < 1e-12);
    }
}

/// One replication of a short protocol: every condition, and the same result with the same seed.
/// `--nocapture` prints it.
#[test]
fn a_replication_is_whole_and_repeats() {
    let study = crate::sierotowicz2023_calibration::short();
    let run = || replication(&study, 3, 0).unwrap();
    let first = run();
    let text = |replication| serde_json::to_string(replication).unwrap();
    assert_eq!(text(&first), text(&run()));
    for person in &first.people {
        let names: Vec<&str> = person
            .conditions
            .iter()
            .map(|condition| &*condition.name)
            .collect();
        assert_eq!(names, studies::sierotowicz2023::CONDITIONS);
        for condition in &person.conditions {
            let of = if condition.name == "C1" { 12 } else { 24 };
            assert_eq!(condition.targets.len(), of);
            println!(
                "{:8} diag {:.2?} rmse {:.1?} range {:.1?} median {:.1} table {:?}",
                condition.name,
                condition.measures.diagonal(),
                condition.measures.rmse_n,
                condition.measures.range_n,
                condition.measures.median_n(),
                condition.table_1.first(),
            );
        }
        println!("geometry {:.0?}", person.geometry_deg);
        println!("gains {:.2?}", person.gains);
        println!("{:?} {:.2?}", person.switches, person.freshness);
        println!("{:?} {:.5}", person.walks, person.share_of_numbers());
    }
    // S1's own frame was found on S1, so that it differs from the calibration only by noise.
    let s1 = frame_of(&study, &Participant::random(&study, 3, 0).unwrap()).unwrap();
    assert_eq!(s1.gains, first.people[0].gains[0]);
}
