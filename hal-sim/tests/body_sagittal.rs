//! An arm that lifts: mechanics against energy and against itself, moment arms against their
//! sources, stimulated fibres against their muscle.

use hal_sim::body::arm::elbow_arms;
use hal_sim::body::muscle::{Parameters, reference};
use hal_sim::body::sagittal::*;

fn spec() -> SagittalSpec {
    let electrode = Electrode {
        threshold_ma: 8.0,
        full_ma: 30.0,
        reached: 0.25,
    };
    SagittalSpec {
        stature_m: 1.66,
        mass_kg: 57.7,
        strength: 0.7,
        fibre_length: 1.0,
        added_inertia_kg_m2: [0.0; JOINTS],
        damping_nm_s_per_rad: [0.0; JOINTS],
        stiffness_nm_per_rad: [0.0; JOINTS],
        stiffness_per_rad: [0.0; JOINTS],
        viscosity_s: 0.0,
        active_damping_s_per_rad: 0.0,
        activation_s: 0.04,
        width_us: 350,
        curvature: 1.2,
        delay_us: 25_000,
        dynamics: Parameters::mean_subject().normalised_at(60.0),
        electrodes: [electrode; ELECTRODES],
        fast_part: 0.5,
    }
}

const IDLE: Intent = Intent {
    drive: [0.0; MUSCLES],
    flexions: [0.0; JOINTS],
    rates: [0.0; JOINTS],
};

/// Inverse and forward dynamics agree: the torques of a motion produce that motion.
#[test]
fn both_ways_through_the_mechanics_agree() {
    let links = Links::new(1.66, 57.7, [0.01, 0.02]);
    let (q, rate, turned, hand) = ([1.1, 0.6], [1.3, -0.7], [4.0, -2.0], [3.0, -12.0]);
    let torque = links.torques_nm(q, rate, turned, hand);
    let found = links.accelerations(q, rate, torque, hand);
    for (a, b) in found.iter().zip(turned) {
        assert!((a - b).abs() < 1e-9, "{found:?}");
    }
    let [elbow, shoulder] = links.flexions(links.hand_m(q));
    assert!((elbow - q[ELBOW]).abs() < 1e-9 && (shoulder - q[SHOULDER]).abs() < 1e-9);
    // A unit acceleration of one joint needs its inertia as torque.
    let weight = links.torques_nm(q, [0.0; 2], [0.0; 2], [0.0; 2]);
    let inertias = links.inertias(q, 0.0);
    for joint in 0..2 {
        let mut unit = [0.0; 2];
        unit[joint] = 1.0;
        let needed = links.torques_nm(q, [0.0; 2], unit, [0.0; 2])[joint] - weight[joint];
        assert!((needed - inertias[joint]).abs() < 1e-9);
    }
    // Compares the hand's rate with a finite difference.
    let ahead: [f64; 2] = [0, 1].map(|joint| q[joint] + 1e-6 * rate[joint]);
    let (from, to) = (links.hand_m(q), links.hand_m(ahead));
    let found = links.hand_rate_m_s(q, rate);
    for axis in 0..2 {
        assert!((found[axis] - (to[axis] - from[axis]) / 1e-6).abs() < 1e-5);
    }
}

/// The torques that hold a force at the hand follow from the principle of virtual work.
#[test]
fn a_weight_in_the_hand_is_held_by_its_lever() {
    let links = Links::new(1.66, 57.7, [0.0; 2]);
    let q = [1.4, 0.5];
    let with = links.torques_nm(q, [0.0; 2], [0.0; 2], [0.0, -10.0]);
    let without = links.torques_nm(q, [0.0; 2], [0.0; 2], [0.0; 2]);
    let [x, _] = links.hand_m(q);
    let elbow_x = links.upper_m * q[SHOULDER].sin();
    assert!((with[SHOULDER] - without[SHOULDER] - 10.0 * x).abs() < 1e-9);
    assert!((with[ELBOW] - without[ELBOW] - 10.0 * (x - elbow_x)).abs() < 1e-9);
}

/// A falling arm without friction or muscles keeps its energy, and small swings about hanging have
/// the period of the linearised double pendulum.
#[test]
fn a_loose_arm_swings_as_a_double_pendulum() {
    let mut arm = SagittalArm::new(spec(), [0.3, 0.2]).unwrap();
    let links = *arm.links();
    // The torques that hold the arm still give its potential energy; kinetic energy is work done.
    let mut work = 0.0;
    let kinetic = |q: [f64; 2], rate: [f64; 2]| -> f64 {
        // ½·rateᵀ·M·rate, from the torques of an acceleration equal to the rate.
        let moved = links.torques_nm(q, [0.0; 2], rate, [0.0; 2]);
        let held = links.torques_nm(q, [0.0; 2], [0.0; 2], [0.0; 2]);
        (0..2)
            .map(|joint| 0.5 * (moved[joint] - held[joint]) * rate[joint])
            .sum()
    };
    let mut worst = 0.0_f64;
    let mut most = 0.0_f64;
    for _ in 0..600 {
        let before = arm.flexions();
        arm.step(&IDLE, [0.0; 2]);
        let after = arm.flexions();
        let middle = [0, 1].map(|joint| 0.5 * (before[joint] + after[joint]));
        let held = links.torques_nm(middle, [0.0; 2], [0.0; 2], [0.0; 2]);
        for joint in 0..2 {
            work -= held[joint] * (after[joint] - before[joint]);
        }
        if after[ELBOW] <= 0.0 {
            break; // at its stop
        }
        let energy = kinetic(after, arm.rates());
        most = most.max(energy);
        worst = worst.max((energy - work).abs());
    }
    println!("kinetic energy up to {most:.4} J, off by at most {worst:.5} J");
    assert!(most > 0.02 && worst < 0.02 * most, "{most} {worst}");
}

/// Moment arms are those of the sources, signs are those of flexion, and lengths are integrals of
/// the moment arms.
#[test]
fn arms_are_the_published_ones() {
    let geometry = Geometry::for_stature(1.66, 1.0);
    for deg in [0.0, 30.0, 60.0, 90.0, 100.0] {
        let posed = geometry.at([deg, 45.0]);
        let [biceps, triceps, brachialis, _] = elbow_arms::arms_m(deg).unwrap();
        for (muscle, arm) in [(0, biceps), (1, triceps), (4, brachialis)] {
            assert!((posed.arms_m[muscle][ELBOW] - arm).abs() < 1e-12, "{deg}");
        }
    }
    for deg in [20.0, 45.0, 70.0] {
        let arms = geometry.at([80.0, deg]).arms_m;
        println!(
            "shoulder at {deg}°: {:?}",
            arms.map(|arm| (1e4 * arm[SHOULDER]).round() / 10.0)
        );
        assert!(arms[2][SHOULDER] > 0.01, "deltoid, anterior");
        assert!(arms[3][SHOULDER] < -0.01, "deltoid, posterior");
    }
    // After a degree of flexion the biceps is shorter by its moment arm times the angle.
    let by_length = |deg| geometry.at([deg, 45.0]).by_length[0];
    let fibre = |by_length: f64| 1.0 + (-0.5 * by_length.ln()).sqrt();
    let (long, short) = (fibre(by_length(40.0)), fibre(by_length(41.0)));
    let arm = geometry.at([40.5, 45.0]).arms_m[0][ELBOW];
    assert!(((long - short) * 0.1224 / (arm * 1_f64.to_radians()) - 1.0).abs() < 1e-3);
}

/// Pulses at full current give the reached part of the muscle its mean force, pulses below the
/// threshold give none, and the motion is flexion.
#[test]
fn pulses_pull_as_the_calcium_model_has_it() {
    let mut heavy = spec();
    // So heavy that it hardly moves while it is pulled.
    heavy.added_inertia_kg_m2 = [1e6; JOINTS];
    let mut arm = SagittalArm::new(heavy.clone(), [1.4, 0.6]).unwrap();
    let full = arm.full_nm();
    let pulses: Vec<u64> = (0..60).map(|n| n * 1_000_000 / 60).collect();
    let mut due = pulses.iter().copied().peekable();
    for tick in 0..1000_u64 {
        while let Some(at) = due.next_if(|at| *at < (tick + 1) * 1000) {
            arm.pulse(0, at, 30.0, 350);
            arm.pulse(1, at, 8.0, 350);
        }
        arm.step(&IDLE, [0.0; 2]);
    }
    let delayed: Vec<f64> = pulses
        .iter()
        .map(|at| (at + 25_000) as f64 * 1e-6)
        .collect();
    let exact = reference::integrate(&heavy.dynamics, &delayed, 0.999, 1e-3);
    let meant = 0.25 * exact.last().unwrap().force_n * full[0][ELBOW];
    let found = arm.stimulated_nm()[ELBOW];
    assert!(
        meant > 2.0 && (found / meant - 1.0).abs() < 0.01,
        "{found} {meant}"
    );
}

#[test]
fn what_no_arm_can_have_is_named() {
    let wrong = SagittalSpec {
        activation_s: 0.0,
        ..spec()
    };
    let refused = SagittalArm::new(wrong, [1.0, 0.5]).unwrap_err();
    assert!(refused.to_string().contains("E766"), "{refused}");
    assert_eq!(refused, InvalidSagittal("activation_s"));
}
