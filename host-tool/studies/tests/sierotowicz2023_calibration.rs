//! Tests of the endpoint study's calibration and its use: twitches, IMUs, another S1, a condition
//! on the device.

use hal_sim::body::arm::{ArmSpec, ELECTRODES, ImuFault};
use host_core::run::DeviceName;
use nalgebra::Vector3;
use studies::sierotowicz2023::{
    Device, Model, Participant, Study, check_imus, fit_model, geometry_error_deg, median, play_c3,
    replication, twitches,
};

fn study() -> Study {
    Study::load_embedded().unwrap()
}

/// Returns a short protocol.
pub(super) fn short() -> Study {
    let mut study = study();
    study.protocol.repetitions = 2;
    study.protocol.voluntary_repetitions = 2;
    study.protocol.contraction_s = 0.5;
    study.protocol.rest_s = 0.5;
    study.protocol.pause_s = 2.0;
    study.walk.turn_s = 1.0;
    study
}

/// An invalid gain, and a posture without known moment arms.
#[test]
fn a_gain_that_is_none_and_an_unknown_posture_are_told() {
    let study = study().rested();
    let mut person = without_noise(1.0);
    let cursory = person.cursory_model();
    let turning = twitches(&mut person.arm, &cursory, &study, &mut person.now_us);
    let error = fit_model(&cursory, (&turning, &[]), 0.0, &study).unwrap_err();
    assert_eq!(
        error.to_string(),
        "E719 biceps brachii: the gain found from its twitches is 0; allowed: a finite number \
         above 0"
    );
    let mut spec = ArmSpec::random(11, 0);
    spec.posture.elevation_deg = 130.0;
    let error = check_imus(&spec).unwrap_err().to_string();
    assert!(
        error.starts_with(
            "E716 a randomly generated arm is impossible: E711 arm: the moment arms are not"
        ),
        "{error}"
    );
}

/// Returns participant 1 of seed 7 without noise, `stronger` times as strong.
fn without_noise(stronger: f64) -> Participant {
    let mut person = Participant::random(&study(), 7, 1).unwrap();
    let mut spec: ArmSpec = person.arm.spec().clone();
    spec.reached = spec.reached.map(|value| stronger * value);
    (spec.force_noise, spec.crosstalk) = (0.0, [0.0; ELECTRODES]);
    spec.imu.askew_deg = 0.0;
    (spec.imu.gyro_noise_rad_s, spec.imu.gyro_bias_rad_s) = (0.0, 0.0);
    person.arm = hal_sim::body::arm::Arm::new(spec).unwrap();
    person.now_us = 0;
    person
}

/// After a calibration without noise, lines of action turn the limb as it turned, and gains are
/// proportional to strength.
#[test]
fn calibration_finds_turning_and_strength() {
    let study = study().rested();
    let calibrate = |stronger: f64| {
        let mut person = without_noise(stronger);
        let cursory = person.cursory_model();
        let turning = twitches(&mut person.arm, &cursory, &study, &mut person.now_us);
        let model = fit_model(&cursory, (&turning, &[]), 77.0, &study).unwrap();
        let device = Device::new(&model).unwrap();
        let angles: Vec<f64> = turning
            .iter()
            .enumerate()
            .map(|(channel, turned)| {
                let mean: Vector3<f64> = turned.iter().sum();
                device.arm_m(channel).angle(&mean).to_degrees()
            })
            .collect();
        let error =
            |model: &Model| geometry_error_deg(&Device::new(model).unwrap(), model, &person.arm);
        let (before, after) = (error(&cursory), error(&model));
        println!("to turning {angles:.0?}, geometry {before:.0?} to {after:.0?}");
        assert!(
            angles.iter().all(|angle| *angle < 90.0) && median(&angles) < 30.0,
            "{angles:?}"
        );
        model
    };
    let (weak, strong) = (calibrate(1.0), calibrate(2.0));
    for (weak, strong) in weak.gains.iter().zip(strong.gains) {
        assert!((strong / weak - 2.0).abs() < 0.05, "{weak} {strong}");
    }
}

/// Returns the angular speeds of each twitch of channel 5, after the declared waits and after waits
/// until rest, rad/s.
fn twitches_of_the_pectoralis(person: &Participant) -> [Vec<f64>; 2] {
    [study(), study().rested()].map(|study| {
        let mut person = person.clone();
        let cursory = person.cursory_model();
        let turning = twitches(&mut person.arm, &cursory, &study, &mut person.now_us);
        turning[5].iter().map(|vector| vector.norm()).collect()
    })
}

/// One cause of an unseen twitch: after the declared 2 s an arm still oscillates from the previous
/// channel, so that the first twitch differs from the next ones.
#[test]
fn an_arm_that_rings_hides_a_twitch() {
    let [rings, rests] = twitches_of_the_pectoralis(&without_noise(1.0));
    println!("{rings:.4?} {rests:.4?}");
    assert!(rings[0] < 0.02 && rings[1] > 0.02, "{rings:?}");
    for value in &rests {
        assert!((value / rests[0] - 1.0).abs() < 0.02, "{rests:?}");
    }
}

/// The other cause: the comfortable currents end where a muscle begins. This S1 yields no frame,
/// with or without rest, and another is generated.
#[test]
fn another_first_participant_is_drawn_where_a_channel_does_not_twitch() {
    let s1 = Participant::random(&study(), 2023, 3 * 19).unwrap();
    let threshold = s1.arm.spec().threshold_ma[5];
    assert!((1.0..1.06).contains(&(s1.ranges_ma[5][1] / threshold)));
    for twitches in twitches_of_the_pectoralis(&s1) {
        assert!(twitches.iter().any(|twitch| *twitch < 0.02), "{twitches:?}");
    }
    let mut study = short();
    let found = replication(&study, 2023, 19).unwrap();
    assert_eq!((found.in_vain, found.people.len()), (1, 3));
    study.calibration.substitutes = 0;
    let error = replication(&study, 2023, 19).unwrap_err().to_string();
    assert!(error.contains("E718 pectoralis clavicular"), "{error}");
}

#[test]
fn imus_that_are_missing_or_swapped_are_named() {
    for index in 0..20 {
        let spec = ArmSpec::random(11, index);
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

/// One condition on the device: it outputs what the study requested, and the arm responds as the
/// study computed, except that pulses are up to 4 ms later within a period.
#[test]
fn a_condition_is_played_on_the_device() {
    let mut study = study();
    study.played.targets = 3;
    let found = play_c3(&study, study.seed, &DeviceName::Native).unwrap();
    println!("{}", found.in_words(&DeviceName::Native));
    assert_eq!(found.played, 3);
    assert_eq!(found.pulses[0], found.pulses[1]);
    // The first three targets are C3's own, before they are turned about the vertical.
    let [off, rms] = found.force_n;
    assert!(off < 0.05 * rms && rms > 0.5, "{found:?}");
    assert!(found.current_ma < 0.02, "{found:?}");
    // Thresholds were found from 20 to 50 Hz.
    study.protocol.frequency_hz = 60.0;
    let error = play_c3(&study, study.seed, &DeviceName::Native).unwrap_err();
    let told = error.to_string();
    assert!(
        told.starts_with("E730 --device native does not play condition C3: "),
        "{told}"
    );
    assert!(told.contains("frequency_hz"), "{told}");
}
