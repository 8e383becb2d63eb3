//! Tests of Harris' characterization: the device's output, the results on a test rig, the report.

use hal_sim::body::bench::IsometricElbow;
use hal_sim::body::bench::arms::{Muscle, Source};
use hal_sim::body::{Body, CHANNELS, Load, Pulse};
use host_core::run::{DeviceName, SessionFile, run};
use std::sync::{Arc, Mutex};
use studies::harris2017::{
    AngleDependence, RampsDeclaration, RampsError, RampsWearer, RunInfo, Setting, Stimulation,
    Study, Test, Threshold, effect_found, fit_law, is_significant, least_found, play_all_on_device,
    relative_torque_change,
};

fn person(index: u64) -> (RampsDeclaration, RampsWearer) {
    let declared = RampsDeclaration::load_embedded().unwrap();
    let person = RampsWearer::random(&declared, declared.seed, index).unwrap();
    (declared, person)
}

/// Seven stimulations with every pulse at its exact µs and width; currents within one step of the
/// converter (1.53 µA) plus half of a setpoint's resolution.
#[test]
fn a_device_puts_out_what_is_meant() {
    let (declared, _) = person(0);
    let (pulses, apart) = play_all_on_device(&declared, &DeviceName::Native).unwrap();
    assert_eq!(pulses.len(), 7);
    // Ten seconds at 50 Hz; width ramps leave out widths below 10 µs.
    let of = |wanted| {
        let mut all = pulses.iter();
        all.find(|(stimulation, _)| *stimulation == wanted)
            .map(|(_, pulses)| pulses)
    };
    let widths = of(Stimulation::Width(35.0)).unwrap();
    let shortest = widths.iter().map(|pulse| pulse.width_us).min();
    assert_eq!((shortest, widths.last().unwrap().width_us), (Some(10), 300));
    assert_eq!(of(Stimulation::Current(25)).unwrap().len(), 500);
    assert_eq!(of(Stimulation::Biceps).unwrap().len(), 501);
    assert!(apart.current_ma < 2.1e-3, "{apart:?}");
}

#[test]
fn a_board_is_no_place_for_a_drawn_elbow() {
    let (declared, _) = person(0);
    let nowhere = DeviceName::Tcp("127.0.0.1:1".to_owned());
    let refused = play_all_on_device(&declared, &nowhere).unwrap_err();
    assert!(matches!(refused, RampsError::Open(_)), "{refused}");
}

/// An arm that records the pulses that reach it.
struct RecordingArm {
    arm: Arc<Mutex<IsometricElbow>>,
    pulses: Arc<Mutex<Vec<Pulse>>>,
    loads: [Load; CHANNELS],
}

impl Body for RecordingArm {
    fn pulse(&mut self, pulse: &Pulse) {
        self.pulses.lock().unwrap().push(*pulse);
        self.arm.lock().unwrap().pulse(pulse);
    }

    fn advance(&mut self, to_us: u64) -> bool {
        self.arm.lock().unwrap().advance(to_us)
    }

    fn angle_deg(&self) -> f64 {
        90.0
    }

    fn sensed_deg(&self) -> f64 {
        90.0
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}

/// The same arm driven by a device through a session's ramp, and driven directly by the same
/// pulses, gives identical bits, however often it is read.
#[test]
fn an_arm_alone_is_the_arm_that_a_device_wears() {
    let (_, person) = person(0);
    let fresh = || IsometricElbow::new(person.rig_spec(Setting::exact(90.0)), 5).unwrap();
    let text = "title = \"ramp\"\nduration_s = 2.0\n\
        [wearer]\nmax_current_ma = 80.0\nmax_charge_uc = 5.0\nmax_rms_ma = 10.0\nrise_ms = 1\n\
        [[channel]]\nnumber = 1\nname = \"triceps\"\nlimit = 80.0\n\
        stage = { kind = \"current\", full_scale_ma = 100.0 }\n\
        train = { shape = \"biphasic-cathodic-first\", width_us = 35, frequency_hz = 50.0 }\n\
        [setpoints]\nkind = \"amplitude-ramp\"\nchannel = 1\nrate_hz = 50\n\
        points = [{ at_s = 0.0, value = 0.0 }, { at_s = 2.0, value = 80.0 }]\n";
    let file = SessionFile::parse("ramp.toml", text).unwrap();
    let mut port = DeviceName::Native.open(&file.session, 1).unwrap();
    let (arm, pulses) = (Arc::new(Mutex::new(fresh())), Arc::default());
    port.world().unwrap().body = Box::new(RecordingArm {
        arm: Arc::clone(&arm),
        pulses: Arc::clone(&pulses),
        loads: [Load::Ohms(1_000.0); CHANNELS],
    });
    let (outcome, port) = run(&file, port, None, |_: f64| ());
    assert!(outcome.error.is_none());
    let now_us = port.unwrap().world().unwrap().now_us();
    let mut alone = fresh();
    for pulse in pulses.lock().unwrap().iter() {
        alone.advance(pulse.t_us);
        alone.pulse(pulse);
    }
    alone.advance(now_us);
    let worn = arm.lock().unwrap();
    assert!(alone.extension_nm() > 0.05, "{}", alone.extension_nm());
    assert_eq!(*worn, alone);
}

/// Computed by hand from the printed polynomials, at 105° and 75° of flexion: Rankin & Neptune's
/// moment arm of the medial head goes from 19.4 to 20.4 and 19.8 mm, MuscleArms' from 19.2 to 17.9
/// and 20.7 mm. The sources differ in sign.
#[test]
fn the_angle_does_what_the_sources_say() {
    let (_, person) = person(0);
    let on = |arms, length| AngleDependence { arms, length };
    let percent = |depends, deg| 1e2 * relative_torque_change(&person, depends, deg).unwrap();
    let rankin = on(Some(Source::RankinNeptune), false);
    let other = on(Some(Source::MuscleArms), false);
    assert!((percent(rankin, 75.0) - 4.2).abs() < 1.0);
    assert!((percent(rankin, 105.0) - 1.9).abs() < 0.5);
    assert!((percent(other, 75.0) + 6.7).abs() < 0.2);
    assert!((percent(other, 105.0) - 7.9).abs() < 0.2);
    // Together they are the product, because every head has the same moment arm there, except for
    // how the heads share the torque of the length alone.
    let (length, both) = (on(None, true), on(Some(Source::MuscleArms), true));
    for deg in [75.0, 105.0] {
        let product = (1.0 + 1e-2 * percent(other, deg)) * (1.0 + 1e-2 * percent(length, deg));
        assert!((1.0 + 1e-2 * percent(both, deg) - product).abs() < 1e-3);
    }
    assert_eq!(percent(rankin, 90.0), 0.0);
}

/// Without an effect, a significant result is as frequent as the level; a larger effect is found
/// more often.
#[test]
fn a_study_of_two_finds_what_it_can() {
    let shares = [0.0, 0.02, 0.05, 0.1].map(|effect| effect_found(effect, 0.08, 0.05, 1));
    // 400 experiments: 0.05 ± 4 standard errors.
    assert!((shares[0] - 0.05).abs() < 0.044, "{shares:?}");
    assert!(
        shares.windows(2).all(|window| window[1] > window[0]),
        "{shares:?}"
    );
    let [least, more] = [0.06, 0.10].map(|noise| least_found(noise, 0.05, 1).unwrap());
    assert!(least < more);
    assert_eq!(is_significant(&[], 0.05), None);
}

/// Recovers chronaxie and rheobase of an elbow for which they are known, in spite of noise and
/// steps.
#[test]
fn the_bench_finds_the_law_that_it_has() {
    let (declared, _) = person(0);
    let (mut covered, mut of) = (0, 0);
    for index in 0..12 {
        let (_, person) = person(index);
        let thresholds = person.thresholds(&declared, 0).unwrap();
        assert!(
            thresholds
                .windows(2)
                .all(|window| window[0].current_ma >= window[1].current_ma)
        );
        let found = fit_law(&thresholds, declared.strength_duration.step_ma).unwrap();
        let truth = person.muscles[0].strength.chronaxie_us;
        let [low, high] = found.chronaxie_within;
        covered += usize::from(low <= truth && truth <= high);
        of += 1;
        assert!(
            (found.chronaxie_us / truth - 1.0).abs() < 0.35,
            "{found:?} for {truth}"
        );
    }
    // 95 % intervals: fewer than 9 of 12 by chance once in 500 times.
    assert!(covered >= 9, "{covered} of {of}");
}

#[test]
fn a_law_needs_thresholds() {
    let one = Threshold {
        width_us: 25,
        current_ma: 30.0,
    };
    assert_eq!(fit_law(&[one; 2], 0.5), None);
}

/// Nineteen tests; subjects do not depend on the number of draws; the report is repeatable.
#[test]
fn persons_do_not_depend_on_each_other() {
    let study = |draws| Study::new((Some(7), Some(draws)), DeviceName::Native).unwrap();
    let declared = study(2).declaration().clone();
    let tests = Test::all(&declared.protocol);
    assert_eq!(tests.len(), 19);
    let stimulations = tests.iter().map(|test| test.stimulation);
    let pulses = stimulations.map(|stimulation| {
        (
            stimulation,
            stimulation.reference_pulses(&declared.protocol),
        )
    });
    let pulses: Vec<_> = pulses.collect();
    let [few, many] = [2, 5].map(|draws| study(draws).compute_draw(1, &pulses).unwrap());
    assert_eq!(few.measured, many.measured);
    let told = || RunInfo {
        command: String::new(),
        cut_short: None,
        notes: Vec::new(),
    };
    let all: Vec<_> = (0..4)
        .map(|index| study(4).compute_draw(index, &pulses).unwrap())
        .collect();
    let [first, second] = [(); 2].map(|()| study(4).outcome(&all, told()).unwrap());
    assert_eq!(first, second);
    // Figures 3, 6 and 7, angles, muscles, equal pulses, strength and duration.
    let sheets = first.sheets.iter().map(|sheet| &*sheet.number);
    assert_eq!(
        sheets.collect::<Vec<_>>(),
        [
            "Figure 3",
            "Figure 6",
            "Figure 7",
            "Angles",
            "Muscles",
            "Equal pulses",
            "Strength and duration"
        ]
    );
    assert_eq!(first.shares.len(), declared.claims.len() + 2);
}

/// A distant neighbour is not stimulated; a neighbour as near as the triceps is, and reduces the
/// torque.
#[test]
fn neighbours_answer_by_their_distance() {
    let (declared, person) = person(0);
    let test = Test {
        nth: 0,
        stimulation: Stimulation::Width(35.0),
        included_deg: 90.0,
    };
    let pulses = test.stimulation.reference_pulses(&declared.protocol);
    let with = |part: f64| {
        let mut other = person.clone();
        for stimulation in &mut other.muscles {
            if matches!(stimulation.muscle, Muscle::Brachialis) {
                stimulation.reached[0] = part;
            }
        }
        let course = other.perform(&declared, test, &pulses).unwrap();
        let others: Vec<_> = course.unintended_muscles(&declared.judged).collect();
        (course.peak_nm(), others)
    };
    let (far_nm, far) = with(1e-3);
    let (near_nm, near) = with(1.0);
    assert!(!far.contains(&Muscle::Brachialis) && near.contains(&Muscle::Brachialis));
    assert!(near_nm < 0.9 * far_nm, "{near_nm} against {far_nm}");
}

/// The shipped wearers are results of the study.
#[test]
fn the_shipped_participants_are_the_studys() {
    let study = Study::new((None, None), DeviceName::Native).unwrap();
    let (pulses, _) = study.play_on_device().unwrap();
    for (place, name) in ["harris-1", "harris-2"].into_iter().enumerate() {
        let found = study.compute_draw(place as u64, &pulses).unwrap();
        let wearer = study.wearer(place, &found).unwrap();
        let shipped = host_core::wearer::builtin_wearer(name).unwrap();
        let shipped = host_core::wearer::Wearer::parse(name, shipped).unwrap();
        assert_eq!(shipped.to_toml(), wearer.to_toml());
    }
}
