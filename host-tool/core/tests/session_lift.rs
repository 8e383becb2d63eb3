//! Sessions in which stimulation follows joint angles: parsing, refusals and playing.

use firmware::haptics::{Form, Modulation, MotionPhase};
use firmware::link::Request;
use firmware::units::{Angle, Micros};
use host_core::link::SimulatedPort;
use host_core::record::{Sample, read_samples, write_samples};
use host_core::run::{Outcome, SessionFile, run};
use host_core::session::{Course, Session};

use crate::link_native::native_world;
use crate::session_files::load;

const BOOT: Micros = Micros::new(u32::MAX - 2_000_000);
const EXAMPLE: &str = include_str!("../../sessions/lift.toml");

/// Returns the example with round shares in its first joint, and these edits.
fn edited_example(edits: &[(&str, &str)]) -> String {
    let edit = |text: String, (find, replace): &(&str, &str)| {
        assert!(text.contains(find), "{find}");
        text.replacen(find, replace, 1)
    };
    let mut text = EXAMPLE.to_owned();
    for (name, share) in [
        ("lift", "0.20, 0.46, 0.62, 0.55, 0.34"),
        ("drop", "0.30, 0.42, 0.40, 0.28, 0.12"),
    ] {
        let from = text.find(&format!("{name} = [")).unwrap();
        let to = from + text[from..].find(']').unwrap();
        text.replace_range(from..to, &format!("{name} = [{share}"));
    }
    edits.iter().fold(text, edit)
}

/// Returns numbers and lines of the errors in the example with these edits.
fn mistakes(edits: &[(&str, &str)]) -> (Vec<u16>, String) {
    match Session::parse("it.toml", &edited_example(edits)) {
        Ok(_) => (Vec::new(), String::new()),
        Err(e) => {
            let numbers = e.errors().map(|e| e.problem().number());
            (numbers.collect(), e.lines())
        }
    }
}

#[test]
fn the_examples_say_four_joints_and_eight_channels() {
    for (name, is_assist) in [("lift.toml", true), ("lift_resist.toml", false)] {
        let session = load(name);
        assert_eq!(session.channels.len(), 8);
        let requests = session.setup_requests();
        let joints = requests.iter().filter_map(|request| match request {
            Request::Modulation(spec) => Some(*spec),
            _ => None,
        });
        let joints: Vec<_> = joints.collect();
        let numbers: Vec<_> = joints
            .iter()
            .map(|modulation_spec| (modulation_spec.joint, modulation_spec.phase_joint))
            .collect();
        assert_eq!(numbers, [(0, 0), (1, 0), (2, 2), (3, 2)]);
        let mut channels: Vec<u8> = Vec::new();
        for spec in &joints {
            let [flexor, extensor] = [&spec.flexor, &spec.extensor];
            // To assist, the muscle that moves the joint is stimulated; to resist, its antagonist,
            // with the antagonist's share.
            let (lifts, drops) = match is_assist {
                true => (flexor, extensor),
                false => (extensor, flexor),
            };
            assert!(lifts.lift.is_some() && lifts.drop.is_none());
            assert!(drops.drop.is_some() && drops.lift.is_none());
            assert!(matches!(flexor.form, Form::AboveThreshold { .. }));
            channels.extend(spec.muscles().map(|modulated_spec| modulated_spec.channel));
        }
        assert_eq!(channels, [0, 1, 2, 3, 4, 5, 6, 7]);
        for channel in &session.channels {
            let train = &channel.spec.train;
            assert_eq!((train.width_us, train.period_us), (350, 16_667));
        }
        assert!(matches!(&session.setpoints.course, Course::Held(points) if points.len() == 5));
    }
    let share = |name| load(name).modulations[0].spec;
    let (assist, resist) = (share("lift.toml"), share("lift_resist.toml"));
    assert_eq!(assist.flexor.lift, resist.extensor.lift);
}

#[test]
fn every_mistake_is_named_where_it_is() {
    #[rustfmt::skip]
    type Edits = &'static [(&'static str, &'static str)];
    let cases: [(Edits, &[u16], &str); 16] = [
        (
            &[("lift = [0.20, 0.46, 0.62", "lift = [0.20, 0.46, 1.0")],
            &[750],
            "modulation.lift",
        ),
        (
            &[("lift = [0.20, 0.46, 0.62", "lift = [0.20, 0.0, 0.62")],
            &[750],
            "is -0.177956 at 54.92°",
        ),
        (
            &[(
                "lift = [0.20, 0.46, 0.62, 0.55, 0.34]",
                "lift = [0.20, 0.46, 0.62, 0.55]",
            )],
            &[407],
            "five numbers",
        ),
        (
            &[("lift = [0.20, 0.46, 0.62", "lift = [0.20, 0.46, 1.62")],
            &[407],
            "modulation.lift",
        ),
        // 0.62 of `base` exceeds 20 mA at one angle.
        (
            &[("base = 16,", "base = 29,")],
            &[758],
            "channel 1's limit of 20 mA",
        ),
        (
            &[("channel = 2, base", "channel = 1, base")],
            &[420],
            "modulation.extensor.channel",
        ),
        (
            &[("channel = 3, base", "channel = 2, base")],
            &[420],
            "modulation.flexor.channel",
        ),
        (
            &[("channel = 3, base", "channel = 9, base")],
            &[421],
            "modulation.flexor.channel",
        ),
        (
            &[("joint = \"right-elbow\"", "joint = \"left-elbow\"")],
            &[757, 752],
            "joint = \"right-elbow\"",
        ),
        (
            &[("threshold = 6 }", "threshold = 16 }")],
            &[407],
            "modulation.flexor.threshold",
        ),
        (
            &[("angle_max_deg = 114", "angle_max_deg = 10")],
            &[407],
            "modulation.angle_max_deg",
        ),
        (
            &[("{ at_s = 0.5, deg = 61 }", "{ at_s = 0.5, deg = 126 }")],
            &[407],
            "46 to 114, the joint's range",
        ),
        (
            &[("{ at_s = 0.5, deg = 61 }", "{ at_s = 0.0, deg = 61 }")],
            &[410],
            "modulation.angles.at_s",
        ),
        (
            &[("longest_hold_s = 10", "longest_hold_s = 5")],
            &[753],
            "setpoints.points.held",
        ),
        (
            &[(
                "{ at_s = 6.6, held = true },\n    { at_s = 7.2, held = false },",
                "",
            )],
            &[],
            "",
        ),
        (
            &[
                ("kind = \"held\"", "kind = \"keep-alive\""),
                ("points = [", "#"),
                (
                    "    { at_s = 0.0, held = false },\n    { at_s = 0.3, held = true },\n    { at_s = 5.8, held = false },\n    { at_s = 6.6, held = true },\n    { at_s = 7.2, held = false },\n]",
                    "",
                ),
            ],
            &[756],
            "setpoints.kind",
        ),
    ];
    for (edits, expected, part) in cases {
        let (numbers, lines) = mistakes(edits);
        assert_eq!(numbers, expected, "{edits:?}\n{lines}");
        assert!(lines.contains(part), "{part}\n{lines}");
    }
    // Modulation together with another measured joint, and without the fields that it needs.
    let (numbers, _) = mistakes(&[("[setpoints]", "[wall]\nat_deg = 1\n[setpoints]")]);
    assert!(numbers.contains(&751), "{numbers:?}");
    // Four mistakes at once.
    let (numbers, lines) = mistakes(&[
        ("base = 15,", "base = 31,"),
        ("drop = [0.30, 0.42", "drop = [0.30, 0.99"),
        ("longest_hold_s = 10", "longest_hold_s = 5"),
        ("channel = 8, base", "channel = 7, base"),
    ]);
    assert_eq!(numbers, [750, 758, 420, 753], "{lines}");
    // A joint with an invalid share that also requests too large an amplitude.
    let (numbers, lines) = mistakes(&[
        ("base = 16,", "base = 33,"),
        ("drop = [0.30, 0.42", "drop = [0.30, 0.99"),
    ]);
    assert_eq!(numbers, [750, 758], "{lines}");
    assert!(lines.contains("channel 1's limit of 20 mA"), "{lines}");
    // The same share exceeds 1, and the limit at that angle.
    let (numbers, lines) = mistakes(&[
        ("base = 16,", "base = 20,"),
        ("lift = [0.20, 0.46, 0.62", "lift = [0.20, 0.46, 1.0"),
    ]);
    assert_eq!(numbers, [750, 758], "{lines}");
}

fn play(text: &str) -> Outcome {
    let file = SessionFile::parse("lift.toml", text).unwrap();
    let outcome = run(&file, SimulatedPort::new(native_world(BOOT)), None, |_| ()).0;
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    assert_eq!(outcome.refused, 0, "{:?}", outcome.trial.events);
    outcome
}

/// Returns whether a channel, from 1, has an amplitude.
fn plays(sample: &Sample, channel: usize) -> bool {
    sample.amplitudes[channel - 1].is_some()
}

#[test]
fn a_run_follows_the_joints_while_an_object_is_held() {
    let trial = play(EXAMPLE).trial;
    let at = |t_s: f64| trial.samples.iter().find(|s| s.t_s >= t_s).unwrap();
    // Not grasped; grasped but at rest; lifting; dropping; released; grasped again; released again.
    let none = |sample: Sample| sample.amplitudes.iter().all(Option::is_none);
    assert!(none(at(0.25)) && none(at(0.5)));
    assert_eq!((at(0.25).held, at(0.5).held), (Some(0.0), Some(1.0)));
    let (lifted, dropped) = (at(2.0), at(4.5));
    assert_eq!(lifted.phase, [Some(1.0); 4]);
    assert_eq!(dropped.phase, [Some(-1.0); 4]);
    for (flexor, extensor) in [(1, 2), (3, 4), (5, 6), (7, 8)] {
        assert!(plays(&lifted, flexor) && !plays(&lifted, extensor));
        assert!(!plays(&dropped, flexor) && plays(&dropped, extensor));
    }
    assert!(none(at(5.85)) && none(at(7.3)) && !none(at(7.1)));
    assert_eq!(at(7.3).held, Some(0.0));
    // At the top the elbows rest and keep their phase, and the amplitude is that of this angle.
    let session = load("lift.toml");
    let elbow = &session.modulations[0];
    let joint = Modulation::new(&elbow.spec).unwrap();
    let top = Angle::from_centideg(elbow.angle_at(3_000_000));
    let [(_, wanted), _] = joint.amplitudes(top, Some(MotionPhase::Lift));
    let rests = at(3.3);
    assert_eq!(rests.joint_deg[0], Some(98.0));
    assert_eq!(rests.amplitudes[0], Some(f64::from(wanted.get()) / 1e3));
    // The record can be read back completely.
    let path = std::env::temp_dir().join(format!("flexor-lift-{}.csv", std::process::id()));
    let mut out = Vec::new();
    write_samples(&mut out, &trial.channels, &trial.samples).unwrap();
    let header = String::from_utf8_lossy(&out)
        .lines()
        .next()
        .unwrap()
        .to_owned();
    assert!(
        header.ends_with(
            ",held,angle_left_elbow_deg,angle_left_shoulder_deg,angle_right_elbow_deg,\
         angle_right_shoulder_deg,phase_left_elbow,phase_left_shoulder,phase_right_elbow,\
         phase_right_shoulder"
        ),
        "{header}"
    );
    std::fs::write(&path, out).unwrap();
    let again = read_samples(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(again, trial.samples);
}

#[test]
fn a_phase_that_nobody_has_moved_to_stimulates_nothing() {
    let still = "{ at_s = 0, deg = 61 },\n";
    let mut text = EXAMPLE.replace("duration_s = 9.0", "duration_s = 3.0");
    for start in [
        "    { at_s = 0, deg = 61 },\n",
        "    { at_s = 0, deg = 64 },\n",
    ] {
        let from = text.find(start).unwrap();
        let to = from + text[from..].find(']').unwrap();
        text.replace_range(from..to, &format!("    {still}"));
    }
    let outcome = play(&text);
    assert_eq!(outcome.trial.pulses, Some(0));
    let why = outcome.trial.silent.unwrap();
    assert!(why.contains("no elbow had moved"), "{why}");
}
