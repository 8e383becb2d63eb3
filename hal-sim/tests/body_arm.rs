//! The arm: published numbers, signs, virtual work, determinism.

use hal_sim::body::arm::anatomy::ALL;
use hal_sim::body::arm::elbow_arms::{
    BRACHIALIS_M, BRACHIALIS_PRINTED_M, RANGE_DEG, TRICEPS_MEDIAL_M, TRICEPS_MEDIAL_PRINTED_M,
    arms_m, biceps_m,
};
use hal_sim::body::arm::{
    Arm, ArmSpec, ImuFault, InvalidArm, Muscle, Posture, Support, posture::JointRotations,
};
use hal_sim::body::{Body, Drive, Pulse};

/// Evaluates a length at `deg` degrees in mm.
fn mm(at: impl Fn(f64) -> f64, deg: f64) -> f64 {
    1e3 * at(deg.to_radians())
}

#[test]
fn elbow_arms_are_the_published_ones() {
    let medial = |q| -TRICEPS_MEDIAL_M.slope(q);
    for deg in 0..=90 {
        let deg = f64::from(deg);
        let off = mm(medial, deg) - mm(|q| TRICEPS_MEDIAL_PRINTED_M.at(q), deg);
        assert!(off.abs() < 0.5, "{deg}: {off}");
    }
    // Beyond 100° the two fits differ, which is the reason to refuse such angles.
    let brachialis = |q| -BRACHIALIS_M.slope(q);
    for (value, wanted) in [
        (mm(medial, 120.0), -27.0),
        (mm(|q| TRICEPS_MEDIAL_PRINTED_M.at(q), 120.0), -22.6),
        (mm(brachialis, 120.0), 27.7),
        (mm(|q| BRACHIALIS_PRINTED_M.at(q), 120.0), 14.9),
        (mm(biceps_m, 75.0), 41.9),
        (mm(biceps_m, 90.0), 47.1),
        (mm(biceps_m, 105.0), 48.6),
    ] {
        assert!((value - wanted).abs() < 0.06, "{value} for {wanted}");
    }
    assert_eq!(arms_m(RANGE_DEG[1] + 0.1), None);
    assert_eq!(arms_m(f64::NAN), None);
    let [biceps, triceps, brachialis, brachioradialis] = arms_m(90.0).unwrap();
    assert!(biceps > 0.0 && brachialis > 0.0 && brachioradialis > 0.03 && triceps < -0.015);
}

/// Stimulates the arm with trains of these currents (mA) for `s` seconds at 40 Hz.
fn stimulate(arm: &mut Arm, from_us: u64, currents: &[(usize, f64)], s: f64) -> u64 {
    let end_us = from_us + (s * 1e6) as u64;
    let mut now_us = from_us;
    while now_us < end_us {
        arm.advance(now_us);
        for (channel, ma) in currents {
            arm.pulse(&Pulse {
                t_us: now_us,
                channel: *channel,
                drive: Drive::Milliamps(*ma),
                width_us: 200,
                conducted: false,
            });
        }
        now_us += 25_000;
    }
    arm.advance(end_us);
    end_us
}

fn quiet() -> ArmSpec {
    let mut spec = ArmSpec::nominal();
    spec.force_noise = 0.0;
    spec.crosstalk = [0.0; 9];
    spec
}

fn wrench_of(muscle: Muscle) -> [f64; 6] {
    let mut arm = Arm::new(quiet()).unwrap();
    stimulate(&mut arm, 0, &[(muscle as usize, 40.0)], 1.0);
    arm.wrench()
}

/// The hand is in front of the right shoulder: x forward, y to the left, z up. A muscle that turns
/// only the elbow pushes along the line from hand to shoulder, because any other force has a moment
/// about the shoulder.
#[test]
fn muscles_push_where_anatomy_says() {
    let arm = Arm::new(quiet()).unwrap();
    let bones = arm.skeleton();
    let outward = (bones.cuff - bones.shoulder).normalize();
    let along = |[x, y, z, ..]: [f64; 6]| nalgebra::Vector3::new(x, y, z).dot(&outward);
    let biceps = along(wrench_of(Muscle::Biceps));
    assert!(
        biceps < -5.0,
        "biceps pulls the hand to the shoulder: {biceps}"
    );
    let triceps = along(wrench_of(Muscle::Triceps));
    assert!(triceps > 5.0, "triceps pushes it away: {triceps}");
    let [_, _, z, ..] = wrench_of(Muscle::Latissimus);
    assert!(z < -3.0, "latissimus pulls down: {z}");
    let [_, y, ..] = wrench_of(Muscle::PectoralisSternal);
    assert!(y > 3.0, "pectoralis pulls inward: {y}");
    let [_, y, ..] = wrench_of(Muscle::DeltoidSuperior);
    assert!(y < -3.0, "middle deltoid pulls outward: {y}");
    let [x, ..] = wrench_of(Muscle::DeltoidPosterior);
    assert!(x < -1.0, "posterior deltoid pulls back: {x}");
    let [x, _, z, ..] = wrench_of(Muscle::DeltoidAnterior);
    assert!(
        x > 0.3 && z > 0.3,
        "anterior deltoid lifts forward: {x} {z}"
    );
}

/// With almost no tissue stiffness the cuff bears the whole torque: the wrench of Jᵀ w is w.
#[test]
fn the_cuff_feels_the_wrench_that_torques_make() {
    let mut spec = quiet();
    spec.hold.passive_nm_per_rad = [1e-6; 8];
    let arm = Arm::new(spec).unwrap();
    let moves = arm.skeleton().cuff_jacobian();
    let wrench = nalgebra::Vector6::new(3.0, -7.0, 11.0, 0.2, 0.1, -0.3);
    let torques: JointRotations = moves.transpose() * wrench;
    let felt = arm.to_wrench() * torques;
    assert!((felt - wrench).norm() < 1e-4, "{felt}");
    // The actual tissue takes part of the wrench and adds nothing.
    let arm = Arm::new(quiet()).unwrap();
    let felt = arm.to_wrench() * torques;
    assert!(felt.norm() < 1.3 * wrench.norm());
}

#[test]
fn how_often_time_is_advanced_changes_nothing() {
    let run = |chunk: u64| {
        let mut arm = Arm::new(ArmSpec::random(3, 1)).unwrap();
        for t_us in (0..300_000).step_by(25_000) {
            let pulse = Pulse {
                t_us,
                channel: 2,
                drive: Drive::Milliamps(30.0),
                width_us: 200,
                conducted: false,
            };
            arm.pulse(&pulse);
            for to_us in (t_us..t_us + 25_000).step_by(chunk as usize) {
                arm.advance(to_us);
            }
        }
        arm.advance(300_000);
        (arm.wrench(), arm.sensed_wrench())
    };
    assert_eq!(run(25_000), run(333));
}

/// A coarser time step keeps the pulses, the strength of each contraction and the noise of the
/// sensor. At the end of every step, the forces differ by little from those in steps of 1 ms.
#[test]
fn a_coarser_step_simulates_the_same_arm() {
    for support in [Support::InCuff, Support::Freely] {
        let after = |step_ms: u32| {
            let mut arm = Arm::in_steps_of(ArmSpec::random(3, 1), step_ms).unwrap();
            arm.set_support(support);
            stimulate(&mut arm, 0, &[(0, 20.0), (4, 30.0)], 0.5);
            arm
        };
        let fine = after(1);
        let plain = {
            let mut arm = Arm::new(ArmSpec::random(3, 1)).unwrap();
            arm.set_support(support);
            stimulate(&mut arm, 0, &[(0, 20.0), (4, 30.0)], 0.5);
            arm
        };
        assert_eq!(fine.forces_n(), plain.forces_n());
        assert_eq!(fine.angle_deg(), plain.angle_deg());
        for step_ms in [2, 5, 10, 20] {
            let coarse = after(step_ms);
            for (coarse_n, fine_n) in coarse.forces_n().into_iter().zip(fine.forces_n()) {
                assert!((coarse_n - fine_n).abs() <= 1e-3 * fine_n, "{step_ms}");
            }
            let noise = |arm: &Arm| {
                let (sensed, wrench) = (arm.sensed_wrench(), arm.wrench());
                std::array::from_fn::<f64, 6, _>(|axis| sensed[axis] - wrench[axis])
            };
            for (a, b) in noise(&coarse).into_iter().zip(noise(&fine)) {
                assert!((a - b).abs() < 1e-9, "{step_ms}: {a} {b}");
            }
        }
        let mut coarse = Arm::in_steps_of(ArmSpec::random(3, 1), 10).unwrap();
        assert!(!coarse.advance(9_999));
        assert!(coarse.advance(10_000));
    }
}

#[test]
fn contractions_differ_by_the_noise_that_is_fixed() {
    let mut spec = quiet();
    spec.force_noise = 0.08;
    spec.fatigue_floor = 1.0;
    let mut arm = Arm::new(spec).unwrap();
    let mut now_us = 0;
    let mut peaks = Vec::new();
    for _ in 0..60 {
        now_us = stimulate(&mut arm, now_us, &[(0, 40.0)], 0.6);
        peaks.push(arm.forces_n()[0]);
        now_us += 2_500_000;
        arm.advance(now_us);
    }
    let mean = peaks.iter().sum::<f64>() / 60.0;
    let sd = (peaks.iter().map(|peak| (peak - mean).powi(2)).sum::<f64>() / 59.0).sqrt();
    // Three standard errors of a standard deviation from 60 values.
    assert!(
        (sd / mean - 0.08).abs() < 3.0 * 0.08 / 118f64.sqrt(),
        "{}",
        sd / mean
    );
}

#[test]
fn a_muscle_tires_to_its_floor_and_recovers() {
    let mut spec = quiet();
    (spec.fatigue_floor, spec.fatigue_time_s) = (0.4, 2.0);
    let mut arm = Arm::new(spec).unwrap();
    let end_us = stimulate(&mut arm, 0, &[(0, 40.0)], 20.0);
    let tired = arm.freshness()[0];
    assert!((tired - 0.4).abs() < 0.03, "{tired}");
    arm.advance(end_us + 20_000_000);
    assert!(arm.freshness()[0] > 0.99);
    assert_eq!(arm.freshness()[1], 1.0);
}

#[test]
fn currents_reach_neighbours_as_far_as_crosstalk_says() {
    let reached = |crosstalk: f64| {
        let mut spec = quiet();
        spec.crosstalk = [crosstalk; 9];
        let mut arm = Arm::new(spec).unwrap();
        stimulate(&mut arm, 0, &[(Muscle::Biceps as usize, 30.0)], 0.5);
        arm.forces_n()
    };
    let at = |forces: [f64; 11], muscle: Muscle| forces[muscle as usize];
    assert_eq!(at(reached(0.3), Muscle::Brachialis), 0.0);
    assert!(at(reached(0.6), Muscle::Brachialis) > 5.0);
    assert_eq!(at(reached(0.6), Muscle::Latissimus), 0.0);
}

/// A twitch of the biceps turns the forearm in flexion, and the girdle hardly at all.
#[test]
fn a_twitch_turns_what_is_beyond_the_joint() {
    let mut spec = quiet();
    spec.imu.askew_deg = 0.0;
    (spec.imu.gyro_noise_rad_s, spec.imu.gyro_bias_rad_s) = (0.0, 0.0);
    let turning = |spec: &ArmSpec| {
        let mut arm = Arm::new(spec.clone()).unwrap();
        arm.set_support(Support::Freely);
        stimulate(&mut arm, 0, &[(Muscle::Biceps as usize, 40.0)], 0.1);
        [0, 1, 2].map(|segment| arm.imu(segment).unwrap().gyro_rad_s)
    };
    let [shoulder, _, forearm] = turning(&spec);
    // The first axis of the forearm's frame is the hinge.
    assert!(forearm[0] > 0.3, "{forearm:?}");
    assert!(
        shoulder
            .iter()
            .all(|torque_nm| torque_nm.abs() < 0.3 * forearm[0])
    );
    spec.imu_faults = [
        ImuFault::None,
        ImuFault::Missing,
        ImuFault::Swapped([2, -1, 3]),
    ];
    let [_, upper_arm, swapped] = turning(&spec);
    assert_eq!(upper_arm, [0.0; 3]);
    assert_eq!(swapped, [forearm[1], -forearm[0], forearm[2]]);
}

#[test]
fn what_no_arm_can_have_is_named() {
    let refused = |change: fn(&mut ArmSpec)| {
        let mut spec = ArmSpec::nominal();
        change(&mut spec);
        Arm::new(spec).unwrap_err()
    };
    assert_eq!(
        refused(|spec| spec.mass_kg = 0.0),
        InvalidArm::NotPositive("mass_kg")
    );
    assert_eq!(
        refused(|spec| spec.posture.elbow_deg = 101.0),
        InvalidArm::Posture
    );
    assert_eq!(refused(|spec| spec.max_ma[4] = 1.0), InvalidArm::Range(4));
    assert_eq!(
        refused(|spec| spec.force_noise = 1.5),
        InvalidArm::NotAPart("force_noise")
    );
    for index in 0..300 {
        assert!(Arm::new(ArmSpec::random(1, index)).is_ok());
    }
    assert!(Posture::STUDY.is_known());
}

/// Prints the wrench of each muscle in the nominal arm; run with `--nocapture`.
#[test]
fn every_muscle_has_a_moment() {
    let arm = Arm::new(ArmSpec::nominal()).unwrap();
    for muscle in ALL {
        let arms = arm.arms_m(muscle);
        let wrench = arm.to_wrench() * arms;
        let mm: Vec<String> = arms
            .iter()
            .map(|arm| format!("{:6.1}", 1e3 * arm))
            .collect();
        let n: Vec<String> = wrench
            .iter()
            .take(3)
            .map(|wrench| format!("{wrench:6.3}"))
            .collect();
        println!(
            "{:24} {} | N/N {}",
            muscle.name(),
            mm.join(" "),
            n.join(" ")
        );
        assert!(arms.norm() > 0.01, "{muscle:?}");
    }
    println!("shoulder {:.3}", arm.skeleton().shoulder.transpose());
}
