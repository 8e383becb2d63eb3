//! A simulated arm as the wearer of a session: its nine angles, and the force at its hand.

use firmware::bench::limb::nominal_limb;
use firmware::limb::Limb;
use firmware::units::Micros;
use hal_sim::body::arm::{Arm, ArmSpec, Muscle, Posture, Support};
use hal_sim::body::{Body, Drive, Pulse};
use hal_sim::native::native;
use host_core::limb::Exact;
use host_core::record::{Run, read_samples, write_samples};
use host_core::report::{self, Report};
use host_core::run::{Outcome, SessionFile, run, simulated_port};
use host_core::session::{BodySpec, Session};
use nalgebra::{Matrix3, Vector3};

const EXAMPLE: &str = include_str!("../../sessions/endpoint_arm.toml");

/// Returns a random arm without crosstalk between electrodes and muscles.
fn arm(index: u64, posture: Posture) -> Arm {
    let drawn = ArmSpec::random(7, index);
    let crosstalk = drawn.crosstalk.map(|_| 0.0);
    Arm::new(ArmSpec {
        posture,
        crosstalk,
        ..drawn
    })
    .unwrap()
}

/// Converts a vector from the body's axes to the device's.
fn to_device_axes(vector3: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(-vector3.x, -vector3.y, vector3.z)
}

/// The device's kinematic chain, set to the nine angles, agrees with the position of the body's
/// bones.
#[test]
fn the_nine_angles_are_those_of_the_device_s_chain() {
    let chain = Limb::<Exact>::new(&nominal_limb()).unwrap();
    for index in 0..200 {
        let at = |n: u64, most: u64| ((index * n) % most) as f64;
        let posture = Posture {
            plane_deg: at(17, 120) - 20.0,
            // beyond that it may be close to the singular middle axis
            elevation_deg: 1.0 + at(31, 79),
            rotation_deg: at(13, 120) - 60.0,
            elbow_deg: at(7, 101),
        };
        let body = arm(index, posture);
        let angles = body.posture_deg().unwrap();
        let pose = chain
            .skeleton()
            .pose(&angles.map(|deg| Exact(deg.to_radians())));
        let axes = |segment: usize| {
            let turn = &pose.segments[segment].1;
            let [x, y, z] =
                [turn.x, turn.y, turn.z].map(|vector| vector.to_array().map(|exact| exact.0));
            Matrix3::from_columns(&[x.into(), y.into(), z.into()])
        };
        let bones = body.skeleton();
        let (upper_arm, forearm) = (axes(2), axes(3));
        for (found, expected) in [
            (-upper_arm.column(2), bones.upper_arm),
            (upper_arm.column(1).into(), bones.hinge),
            (-forearm.column(2), bones.forearm),
            (forearm.column(1).into(), bones.hinge), // pronation is zero
        ] {
            let off = (found - to_device_axes(expected)).norm();
            assert!(off < 1e-9, "{posture:?}: {angles:?}, {off}");
        }
        assert_eq!(axes(1), Matrix3::identity(), "the girdle is at rest");
    }
}

/// Stimulates one muscle with 25 mA at 40 Hz for half a second; returns the change of each angle.
fn angle_changes(muscle: Muscle, held: Support) -> [f64; 9] {
    let mut body = Arm::new(ArmSpec {
        crosstalk: [0.0; 9],
        ..ArmSpec::nominal()
    })
    .unwrap();
    body.set_support(held);
    let rest = body.posture_deg().unwrap();
    for n in 0..20 {
        let t_us = n * 25_000;
        body.advance(t_us);
        body.pulse(&Pulse {
            t_us,
            channel: muscle as usize,
            drive: Drive::Milliamps(25.0),
            width_us: 200,
            conducted: false,
        });
    }
    body.advance(500_000);
    assert_eq!(body.hand_force_n().is_some(), held == Support::InCuff);
    let there = body.posture_deg().unwrap();
    std::array::from_fn(|axis| there[axis] - rest[axis])
}

/// Muscles move the angles for which they are known; in the cuff the remaining movement is small.
#[test]
fn muscles_turn_what_they_are_known_for() {
    let (elevation, flexion, abduction, rotation) = (1, 3, 4, 5);
    let (elbow, pronation) = (6, 8);
    for (muscle, axis, sign) in [
        (Muscle::Biceps, elbow, 1.0),
        (Muscle::Biceps, pronation, -1.0),
        (Muscle::Triceps, elbow, -1.0),
        (Muscle::DeltoidSuperior, abduction, 1.0),
        (Muscle::DeltoidAnterior, flexion, 1.0),
        (Muscle::DeltoidPosterior, flexion, -1.0),
        (Muscle::PectoralisSternal, rotation, 1.0),
        (Muscle::Trapezius, elevation, 1.0),
    ] {
        let free = angle_changes(muscle, Support::Freely);
        let held = angle_changes(muscle, Support::InCuff);
        println!("{muscle:?}: free {free:.2?}, in the cuff {held:.2?}");
        assert!(sign * free[axis] > 0.1, "{muscle:?}, axis {axis}: {free:?}");
        let most = |angles: [f64; 9]| {
            angles
                .into_iter()
                .fold(0.0, |most: f64, value| most.max(value.abs()))
        };
        assert!((0.1..3.0).contains(&most(held)), "{muscle:?}: {held:?}");
    }
}

fn play(text: &str) -> Outcome {
    let file = SessionFile::parse("endpoint_arm.toml", text).unwrap();
    let boot = Micros::new(u32::MAX - 2_000_000);
    let port = simulated_port(&file.session, 1, Box::new(native(boot)), boot).unwrap();
    run(&file, port, None, |_| ()).0
}

/// The record contains the reference and the actual force.
#[test]
fn a_record_has_the_force_that_is_wanted_and_the_one_that_comes() {
    let outcome = play(EXAMPLE);
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    assert_eq!(outcome.refused, 0, "{:?}", outcome.trial.events);
    let trial = outcome.trial;
    let held = trial.samples.iter().find(|s| s.t_s > 1.9).unwrap();
    println!("wanted {:?}, came {:?}", held.hand_n, held.hand_true_n);
    assert_eq!(held.hand_n, [Some(-2.0), Some(3.0), Some(2.5)]);
    assert_eq!(held.hand_made, Some(1.0));
    let given: Vec<f64> = held.hand_true_n.iter().flatten().copied().collect();
    let along = given[0] * -2.0 + given[1] * 3.0 + given[2] * 2.5;
    assert!(
        along > 0.0,
        "the force that comes points elsewhere: {given:?}"
    );
    // Before the first reference the arm is at rest.
    let first = trial.samples.first().unwrap();
    assert_eq!(first.hand_true_n, [Some(0.0), Some(0.0), Some(0.0)]);
    let path = std::env::temp_dir().join(format!("flexor-arm-{}.csv", std::process::id()));
    let mut out = Vec::new();
    write_samples(&mut out, &trial.channels, &trial.samples).unwrap();
    std::fs::write(&path, out).unwrap();
    let again = read_samples(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(again, trial.samples);
    // The page shows both forces and their difference, although only the simulation knows the true
    // force.
    let page = report::page(&Report {
        run: &Run {
            title: "An arm".to_owned(),
            trials: vec![trial],
            ..Run::default()
        },
        paper: &[],
        assumptions: &[],
        command: "flexor run",
    });
    assert!(page.contains("Force at the hand over time"));
    let sentence = "The reference force at the hand reached 4.4 N; the force of the simulated arm \
                differed from it by ";
    assert!(page.contains(sentence), "{page}");
}

/// Without a support nothing measures the force of the arm.
#[test]
fn an_arm_that_nothing_holds_tells_no_force() {
    let text = EXAMPLE.replace("held = \"cuff\"", "held = \"freely\"");
    let outcome = play(&text.replace("duration_s = 6.0", "duration_s = 1.5"));
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    let samples = &outcome.trial.samples;
    assert!(samples.iter().all(|s| s.hand_true_n.is_empty()));
    assert!(samples.iter().any(|s| s.hand_made == Some(1.0)));
}

#[test]
fn an_arm_is_drawn_by_its_number_and_what_it_cannot_be_is_told() {
    let drawn = |line: &str| {
        let text = EXAMPLE.replace("held = \"cuff\"", line);
        Session::parse("it.toml", &text).map(|session| session.body.unwrap())
    };
    let spec = |line: &str| match drawn(line).unwrap() {
        BodySpec::Arm { spec, .. } => *spec,
        other => panic!("{other:?}"),
    };
    assert_eq!(spec("drawn = 3"), spec("drawn = 3"));
    assert_ne!(spec("drawn = 3"), spec("drawn = 4"));
    assert_eq!(spec("").stature_m, ArmSpec::nominal().stature_m);
    let text = EXAMPLE.replace("elevation_deg = 45", "elevation_deg = 121");
    let text = text.replace("elbow_deg = 90", "elbow_deg = 101\nload_ohm = 5");
    let refusal = Session::parse("it.toml", &text).unwrap_err();
    let numbers: Vec<u16> = refusal.errors().map(|e| e.problem().number()).collect();
    assert_eq!(numbers.len(), 3, "{}", refusal.lines());
}
