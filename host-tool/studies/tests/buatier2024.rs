//! Tests of lifts with stimulation that follows the joints: the device's setup and output, the
//! virtual object, a lift without noise, refusals.

use firmware::haptics::MotionPhase;
use host_core::session::Session;
use studies::buatier2024::{
    Condition, Curves, Device, LiftError, LiftWearer, Participant, Study, ToldToDevice, Trace,
    Worker, compare_whole_device, curves, draw_values, holds, nominal_values, participant,
};

/// Returns a nominal participant, except for these values.
fn person(study: &Study, changed: &[(&str, f64)]) -> LiftWearer {
    let mut values = nominal_values(study);
    for (field, value) in changed {
        let place = study.ranges.iter().position(|range| range.field == *field);
        values[place.unwrap()] = *value;
    }
    LiftWearer::new(study, values, 5).unwrap()
}

const TOLD: ToldToDevice = ToldToDevice {
    felt_ma: 6.0,
    most_ma: 20.0,
};

/// Compares the device's amplitudes with the formula of its coefficients, at every 0.1° of both
/// joints in both phases. The channels that pulse distinguish assist from resist.
#[test]
fn the_device_stimulates_what_the_condition_says() {
    let study = Study::load_embedded().unwrap();
    let found = curves(&study, 1.66, 57.7).unwrap();
    let mut worst = 0.0_f64;
    for condition in Condition::ALL {
        let mut device = Device::new(&study, &found, condition, &[TOLD; 8]).unwrap();
        assert_eq!(
            device
                .amplitudes([[60.0, 40.0]; 2])
                .map(|amplitudes| amplitudes.get()),
            [0; 8]
        );
        for (rate, phase) in [(0.05, MotionPhase::Lift), (-0.05, MotionPhase::Drop)] {
            let mut deg = 60.0;
            for _ in 0..400 {
                device.tick([deg; 2]);
                deg += rate;
            }
            assert_eq!(device.phase(0), Some(phase));
            let lifts = phase == MotionPhase::Lift;
            for tenth in 0..1_300 {
                let at = f64::from(tenth) * 0.1;
                let amplitudes = device.amplitudes([[at; 2]; 2]);
                for (channel, amplitude) in amplitudes.iter().enumerate() {
                    let own = channel % 4;
                    // Even channels flex. Assist: flexors while lifting; resist: extensors.
                    let is_on = match condition {
                        Condition::None => false,
                        Condition::Assist => lifts == own.is_multiple_of(2),
                        Condition::Resist => lifts != own.is_multiple_of(2),
                    };
                    let function = own / 2 * 2 + usize::from(!lifts);
                    let [low, high] = found.range_deg[own / 2];
                    let u = ((at - low) / (high - low)).clamp(0.0, 1.0);
                    let b = found.muscles[function]
                        .bernstein
                        .unwrap()
                        .map(|value| 1e-6 * f64::from(value));
                    let v = 1.0 - u;
                    let c = b[0] * v.powi(4)
                        + 4.0 * b[1] * u * v.powi(3)
                        + 6.0 * b[2] * u * u * v * v
                        + 4.0 * b[3] * u.powi(3) * v
                        + b[4] * u.powi(4);
                    let meant = if is_on { 6.0 + c * 14.0 } else { 0.0 };
                    let found = 1e-3 * f64::from(amplitude.get());
                    worst = worst.max((found - meant).abs());
                }
            }
        }
    }
    println!("farthest from the formula: {:.3} µA", 1e3 * worst);
    assert!(worst < 1.5e-3, "{worst} mA");
}

/// Without co-contraction, static optimisation leaves the posterior deltoid idle and the triceps
/// nearly so: the extensors carry no load.
#[test]
fn extensors_rest_without_co_contraction() {
    let mut study = Study::load_embedded().unwrap();
    study.model.co_contraction = 0.0;
    let found = curves(&study, 1.66, 57.7).unwrap();
    let peaks = found.muscles.each_ref().map(|curve| curve.peak);
    println!("largest k: {peaks:?}");
    assert!(peaks[0] > 0.1 && peaks[2] > 0.1, "{peaks:?}");
    assert!(peaks[1] < 0.05 && peaks[3] < 1e-6, "{peaks:?}");
    assert!(found.muscles[3].bernstein.is_none());
}

/// Without noise, bias or misjudged load, a practised participant places the object exactly; the
/// same seed gives the same lift.
#[test]
fn a_lift_without_noise_ends_at_the_target() {
    let study = Study::load_embedded().unwrap();
    let calm = [
        ("drive_noise", 0.0),
        ("aim_bias_m", 0.0),
        ("aim_scatter_m", 0.0),
        ("judged_load", 0.0),
    ];
    let person = person(&study, &calm);
    let found = participant(&study, &person, 2).unwrap();
    let none = found.condition_result(Condition::None).unwrap();
    println!("{none:?}");
    for error_m in none.error_m {
        assert!(error_m < 0.02, "{error_m}");
    }
    assert_eq!(none.stimulated_nm, [0.0; 2]);
    let resist = found.condition_result(Condition::Resist).unwrap();
    assert!(resist.stimulated_nm[0] > 0.2, "{resist:?}");
    let again = participant(&study, &person, 2).unwrap();
    assert_eq!(
        again.condition_result(Condition::Resist).unwrap().error_m,
        resist.error_m
    );
}

/// Pulses come at 60 Hz from the grasp on, none before a phase is known.
#[test]
fn pulses_come_sixty_times_a_second() {
    let study = Study::load_embedded().unwrap();
    let person = person(&study, &[]);
    let found = curves(&study, 1.66, 57.7).unwrap();
    let mut device = Device::new(&study, &found, Condition::Assist, &person.told).unwrap();
    let mut worker = Worker::new(&study, &person).unwrap();
    let mut trace = Trace::default();
    let lifted = worker
        .lift(
            &mut device,
            (0, 9),
            [0.0; 2],
            &mut learnt(),
            Some(&mut trace),
        )
        .unwrap();
    let pulses = trace.pulses.len() as f64;
    assert!(
        (pulses / lifted.duration_s - 60.0).abs() < 0.5,
        "{pulses} {}",
        lifted.duration_s
    );
    let (_, first) = trace.pulses[0];
    assert_eq!(first.map(|code| code.get()), [0; 8]);
    let most = trace
        .pulses
        .iter()
        .flat_map(|pulse| pulse.1)
        .map(|amplitude| amplitude.get())
        .max();
    assert!(most.unwrap() > 1000, "{most:?}");
}

fn learnt() -> [studies::buatier2024::LearntTorque; 2] {
    [studies::buatier2024::LearntTorque::NOTHING; 2]
}

/// Computed by hand: of three participants, the first has a lower cost without stimulation, the
/// second a higher one.
#[test]
fn claims_are_judged_by_their_sides() {
    let study = Study::load_embedded().unwrap();
    let person = person(&study, &[]);
    let found = participant(&study, &person, 2).unwrap();
    let with = |none: f64, resist: f64| -> Participant {
        let mut participant = found.clone();
        for own in &mut participant.conditions {
            match own.condition {
                Condition::None => own.power_w_per_kg = none,
                Condition::Resist => own.power_w_per_kg = resist,
                Condition::Assist => {}
            }
        }
        participant
    };
    let claim = study
        .claims
        .iter()
        .find(|claim| claim.id == "resist-costs-more")
        .unwrap();
    assert_eq!(holds(&study, &with(0.6, 0.7), claim), Some(true));
    assert_eq!(holds(&study, &with(0.7, 0.6), claim), Some(false));
    assert_eq!(holds(&study, &with(f64::NAN, 0.6), claim), None);
}

#[test]
fn all_mistakes_of_a_declaration_are_told_at_once() {
    let text = studies::buatier2024::DECLARED
        .replace("object_kg = 1.5", "object_kg = -1.5")
        .replace("repetitions = 9 ", "repetitions = 8 ")
        .replace("height = \"low\"", "height = \"lowest\"");
    let refused = Study::parse(&text).unwrap_err();
    assert!(matches!(refused, LiftError::Declaration(_)));
    let told = refused.to_string();
    for part in ["E760", "model.object_kg", "repetitions is 8", "`lowest`"] {
        assert!(told.contains(part), "{told}");
    }
}

/// The first draws do not depend on the number of draws, and lie within their ranges.
#[test]
fn draws_lie_within_their_ranges() {
    let study = Study::load_embedded().unwrap();
    for index in 0..200 {
        for (value, range) in draw_values(&study, 3, index).iter().zip(&study.ranges) {
            assert!((range.low..=range.high).contains(value), "{}", range.field);
        }
    }
}

/// The joints of the shipped sessions belong to the nominal wearer: their ranges, and each function
/// by five values that bracket the device's. `FLEXOR_OVERWRITE=1` writes them.
#[test]
fn shipped_sessions_have_the_functions_of_the_wearer_in_the_middle() {
    let study = Study::load_embedded().unwrap();
    let arm = person(&study, &[]).arms[0].clone();
    let found = curves(&study, arm.stature_m, arm.mass_kg).unwrap();
    for name in ["lift.toml", "lift_resist.toml"] {
        let path = format!("{}/../sessions/{name}", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap();
        let new = with_curves(&text, &found);
        if std::env::var_os("FLEXOR_OVERWRITE").is_some() {
            std::fs::write(&path, &new).unwrap();
        }
        assert_eq!(std::fs::read_to_string(&path).unwrap(), new, "{name}");
        let session = Session::parse(name, &new).unwrap();
        for joint in &session.modulations {
            let own = usize::from(joint.spec.joint) % 2;
            let muscles = || joint.spec.muscles();
            let [lift, drop] = [
                muscles()
                    .find_map(|modulated_spec| modulated_spec.lift)
                    .unwrap(),
                muscles()
                    .find_map(|modulated_spec| modulated_spec.drop)
                    .unwrap(),
            ];
            for (share, muscle) in [(lift, 2 * own), (drop, 2 * own + 1)] {
                // Half a millionth in each value changes a coefficient by at most eight.
                let wanted = found.muscles[muscle].bernstein.unwrap();
                let off = share.0.iter().zip(wanted).map(|(a, b)| (a - b).abs());
                assert!(off.max().unwrap() <= 8, "{name}: {share:?} {wanted:?}");
            }
        }
    }
}

/// Returns a session's text with these ranges and functions.
fn with_curves(text: &str, found: &Curves) -> String {
    let mut own = 0;
    let line = |line: &str| -> String {
        if line.starts_with("joint = ") {
            own = usize::from(line.contains("shoulder"));
        }
        let [low, high] = found.range_deg[own];
        let values = |muscle: usize| {
            let b = found.muscles[muscle].bernstein.unwrap();
            let values = [0.0, 0.25, 0.5, 0.75, 1.0].map(|u: f64| {
                let v = 1.0 - u;
                let terms = [v.powi(4), 4.0 * u * v.powi(3), 6.0 * u * u * v * v];
                let more = [4.0 * u.powi(3) * v, u.powi(4)];
                let terms = terms.into_iter().chain(more).zip(b);
                let sum: f64 = terms.map(|(term, b)| term * f64::from(b)).sum();
                format!("{:.6}", 1e-6 * sum)
            });
            values.join(", ")
        };
        match line.split_once(" = ").map(|(field, _)| field) {
            Some("lift") => format!("lift = [{}]", values(2 * own)),
            Some("drop") => format!("drop = [{}]", values(2 * own + 1)),
            Some("angle_min_deg") => format!("angle_min_deg = {low}"),
            Some("angle_max_deg") => format!("angle_max_deg = {high}"),
            _ => line.to_owned(),
        }
    };
    let lines: Vec<String> = text.lines().map(line).collect();
    lines.join("\n") + "\n"
}

/// The whole native device, through the link, with guard and scheduler, outputs every burst of a
/// lift as the fast simulation does, within one DAC code; an angle takes less than 3 ms to a burst.
#[test]
fn the_whole_device_lifts_as_the_fast_way_says() {
    let study = Study::load_embedded().unwrap();
    let person = person(&study, &[]);
    for condition in [Condition::Assist, Condition::Resist] {
        for height in 0..3 {
            let found = compare_whole_device(&study, &person, condition, (height, 9)).unwrap();
            println!("{condition:?} to height {height}: {found:?}");
            assert!(found.bursts > 400, "{found:?}");
            assert_eq!((found.same, found.alone), (found.bursts, 0), "{found:?}");
            assert!(found.lag_us < 3_000, "{found:?}");
        }
    }
}
