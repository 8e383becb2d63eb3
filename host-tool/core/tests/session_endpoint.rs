//! Sessions with forces at the hand: parsing, refusals and playing.

use firmware::control::PostureSpec;
use firmware::limb::{Limb, LimbSpec};
use firmware::link::Request;
use firmware::units::{Angle, Micros};
use hal_sim::body::{Body, CHANNELS, Load, Pulse};
use hal_sim::native::native;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::limb::Exact;
use host_core::link::SimulatedPort;
use host_core::record::{Samples, read_samples, write_samples};
use host_core::run::{Outcome, SessionFile, run};
use host_core::session::{Course, Session, SessionError};
use host_core::wearer::{Wearer, builtin_wearer};

use crate::link_native::native_world;
use crate::session_files::load;

const BOOT: Micros = Micros::new(u32::MAX - 2_000_000);
const EXAMPLE: &str = include_str!("../../sessions/endpoint_force.toml");
const FIXED: &str =
    "posture_deg = { gh_flexion = 45, gh_abduction = 30, gh_rotation = 20, el_flexion = 80 }\n";

fn edited(text: &str, edits: &[(&str, &str)]) -> String {
    let edit = |text: String, (find, replace): &(&str, &str)| {
        assert!(text.contains(find), "{find}");
        text.replacen(find, replace, 1)
    };
    edits.iter().fold(text.to_owned(), edit)
}

/// Returns numbers and lines of the errors in the example session and its wearer, each with these
/// edits.
fn mistakes(edits: &[(&str, &str)], of_wearer: &[(&str, &str)]) -> (Vec<u16>, String) {
    let wearer = edited(builtin_wearer("arm-1").unwrap(), of_wearer);
    let text = edited(EXAMPLE, edits);
    match Session::parse_with_wearers("it.toml", &text, &|_| Ok(wearer.clone())) {
        Ok(_) => (Vec::new(), String::new()),
        Err(e) => (numbers(&e), e.lines()),
    }
}

fn numbers(e: &SessionError) -> Vec<u16> {
    e.errors().map(|e| e.problem().number()).collect()
}

#[test]
fn the_example_says_an_arm_and_its_nine_lines() {
    let session = load("endpoint_force.toml");
    let limb = session.limb.as_ref().unwrap();
    assert_eq!((limb.spec.recruit_ms, limb.lines.len()), (5, 9));
    let PostureSpec::Fixed(angles) = limb.spec.posture else {
        panic!("{limb:?}");
    };
    assert_eq!(angles, [0, 0, 0, 4_500, 3_000, 2_000, 8_000, 0, 0]);
    // Equals the nominal arm of the device's own benchmarks, to the µm.
    let nominal = firmware::bench::limb::nominal_limb();
    assert_eq!(limb.spec.offsets_um, nominal.offsets_um);
    assert_eq!(limb.spec.ranges_mdeg, nominal.ranges_mdeg);
    assert_eq!(limb.lines, nominal.lines);
    let requests = session.setup_requests();
    let lines = requests
        .iter()
        .filter(|request| matches!(request, Request::Line(_)));
    assert_eq!(lines.count(), 9);
    let Course::Wrench(course) = &session.setpoints.course else {
        panic!("{:?}", session.setpoints.course);
    };
    assert_eq!(course.at(500_000), [-1_000, 1_500, 1_250]);
    assert_eq!(course.at(9_000_000), [0; 3]);
}

#[test]
fn a_wearer_s_arm_is_written_as_it_is_read() {
    let wearer = Wearer::parse("arm-1", builtin_wearer("arm-1").unwrap()).unwrap();
    let again = Wearer::parse("again", &wearer.to_toml()).unwrap();
    assert_eq!(again, wearer);
    assert_eq!(wearer.limb.unwrap().lines.len(), 9);
}

#[test]
fn every_mistake_of_the_session_is_named() {
    // The force is too large: the message contains a force that is possible.
    let too_strong = [(
        "force_n = [-2.0, 3.0, 2.5] },\n    { at_s = 2.0",
        "force_n = [-20, 30, 25] },\n    { at_s = 2.0",
    )];
    let (numbers, lines) = mistakes(&too_strong, &[]);
    // Reported for the point itself, and for the next one, which starts from it.
    assert_eq!(numbers, [475, 475], "{lines}");
    assert!(lines.contains("% of it, [-"), "{lines}");
    let nearest = lines.split("% of it, [").nth(1).unwrap();
    let nearest = nearest.split(']').next().unwrap();
    let made = format!("force_n = [{nearest}] }},\n    {{ at_s = 2.0");
    assert_eq!(mistakes(&[(too_strong[0].0, &made)], &[]).0, [0; 0]);
    // Forces that exceed any hand, that exceed the number format, and a missing force.
    let third = "force_n = [2.0, -2.0, 1.0] },\n    { at_s = 4.0";
    for force in [
        "[2.0, -1000.5, 1.0]",
        "[2, -21e999, 1]",
        "[218446744073709551616, 0, 0]",
    ] {
        let wrong = format!("force_n = {force} }},\n    {{ at_s = 4.0");
        let (numbers, lines) = mistakes(&[(third, &wrong)], &[]);
        assert_eq!(numbers, [407], "{lines}");
        assert!(lines.contains("-1000 to 1000"), "{lines}");
    }
    let none = "force_n = [] },\n    { at_s = 4.0";
    let (numbers, lines) = mistakes(&[(third, none)], &[]);
    assert_eq!(numbers, [407], "{lines}");
    assert!(lines.contains("three numbers"), "{lines}");
    // Two mistakes at once, each with its place.
    let two = [
        ("rate_hz = 200", "rate_hz = 90"),
        ("el_flexion = 80", "el_flexion = 131"),
    ];
    let (numbers, lines) = mistakes(&two, &[]);
    assert_eq!(numbers, [407, 407], "{lines}");
    assert!(
        lines.contains("setpoints.posture_deg.el_flexion"),
        "{lines}"
    );
    assert!(lines.contains("0 to 130, this wearer's range"), "{lines}");
    assert!(
        lines.contains("200 or 20 Hz for a force at the hand"),
        "{lines}"
    );
    let pair = [("[2.0, -2.0, 1.0]", "[2.0, -2.0]")];
    assert_eq!(mistakes(&pair, &[]).0, [407]);
    let edits = [(FIXED, &*format!("{FIXED}stale_after_ms = 50\n"))];
    assert_eq!(mistakes(&edits, &[]).0, [409]);
    let no_file = [("file = \"../wearers/arm-1.toml\"", "rise_ms = 50")];
    let (numbers, lines) = mistakes(&no_file, &[]);
    assert!(numbers.contains(&477), "{lines}");
    let joint = "[joint]\nangle_min_deg = 0\n[setpoints]";
    assert!(mistakes(&[("[setpoints]", joint)], &[]).0.contains(&479));
}

#[test]
fn every_mistake_of_the_wearer_s_arm_is_named() {
    let mut seen = String::new();
    let arm = |of_wearer: &[(&str, &str)]| {
        let text = edited(builtin_wearer("arm-1").unwrap(), of_wearer);
        match Wearer::parse("arm-1.toml", &text) {
            Ok(_) => (Vec::new(), String::new()),
            Err(e) => (numbers(&e), e.lines()),
        }
    };
    let edits = [
        ("to_el_mm = [0, 0, -300]", "to_el_mm = [0, 0, -3]"),
        ("gh_abduction_deg = [0, 80]", "gh_abduction_deg = [0, 81]"),
        ("el_bend_deg = [-10, 10]", "el_bend_deg = [10, -10]"),
        ("gain_n_per_unit = 9", "gain_n_per_unit = 0"),
        ("channel = 4\njoint", "channel = 3\njoint"),
    ];
    let empty = [
        ("to_sc_mm = [-40, 20, 0]", "to_sc_mm = []"),
        ("sc_protraction_deg = [-30, 30]", "sc_protraction_deg = []"),
        ("at_mm = [-15, 0, -50] }", "at_mm = [] }"),
    ];
    for edit in edits.into_iter().chain(empty) {
        let (numbers, lines) = arm(&[edit]);
        let expected = if edit.0.starts_with("channel") {
            420
        } else {
            407
        };
        assert_eq!(numbers, [expected], "{lines}");
        seen += &lines;
    }
    let (numbers, lines) = arm(&edits);
    assert_eq!(numbers.len(), edits.len(), "{lines}");
    // The biceps cannot turn the elbow from the forearm alone.
    let alone = (
        "{ segment = \"upper-arm\", at_mm = [-30, 0, -130] }",
        "{ segment = \"forearm\", at_mm = [-30, 0, -130] }",
    );
    let (numbers, lines) = arm(&[alone]);
    assert_eq!(numbers, [407], "{lines}");
    assert!(
        lines.contains("from a segment before its `joint`"),
        "{lines}"
    );
    for part in [
        "a bone of at least 10 mm",
        "highest angle, within ±80",
        "limb.line",
    ] {
        assert!(seen.contains(part), "{part}: {seen}");
    }
}

/// The biceps alone cannot push the hand down.
#[test]
fn where_no_muscle_helps_it_is_said() {
    let from = EXAMPLE.find("\n[[channel]]\nnumber = 2").unwrap();
    let to = EXAMPLE.find("\n[setpoints]").unwrap();
    let single_channel = format!("{}{}", &EXAMPLE[..from], &EXAMPLE[to..]);
    let refusal = |force: &str| {
        let points = single_channel.find("points =").unwrap();
        let text = format!(
            "{}points = [{{ at_s = 0, force_n = {force} }}]\n",
            &single_channel[..points]
        );
        match Session::parse("it.toml", &text) {
            Ok(_) => (Vec::new(), String::new()),
            Err(e) => (numbers(&e), e.lines()),
        }
    };
    assert_eq!(refusal("[0, 0, 5]").0, [0; 0]);
    let (numbers, lines) = refusal("[0, 0, -5]");
    assert_eq!(numbers, [476]);
    assert!(
        lines.contains("no muscle of the session pulls in this direction in this posture"),
        "{lines}"
    );
}

fn play(text: &str, world: World) -> Outcome {
    let file = SessionFile::parse("endpoint.toml", text).unwrap();
    run(&file, SimulatedPort::new(world), None, |_| ()).0
}

#[test]
fn a_run_records_what_was_wanted_and_given() {
    let text = edited(EXAMPLE, &[("duration_s = 6.0", "duration_s = 2.0")]);
    let outcome = play(&text, native_world(BOOT));
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    assert_eq!(outcome.refused, 0, "{:?}", outcome.trial.events);
    let trial = outcome.trial;
    let held = trial.samples.iter().find(|s| s.t_s > 1.5).unwrap();
    assert_eq!(held.hand_n, [Some(-2.0), Some(3.0), Some(2.5)]);
    assert_eq!((held.hand_made, held.limiting), (Some(1.0), false));
    let playing = held.amplitudes.iter().flatten().count();
    assert!((2..=3).contains(&playing), "{held:?}");
    // The record can be read back completely.
    let path = std::env::temp_dir().join(format!("flexor-hand-{}.csv", std::process::id()));
    let mut out = Vec::new();
    write_samples(&mut out, &trial.channels, &trial.samples).unwrap();
    std::fs::write(&path, out).unwrap();
    let again = read_samples(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(again, trial.samples);
}

/// A biceps from the girdle acts on shoulder and elbow. The device considers it only at the joint
/// that its line names, so its output equals that with a biceps from the upper arm; least squares
/// on the host uses the torques at both joints.
#[test]
fn a_line_over_two_joints_is_played_at_the_one_it_names() {
    let via = "{ segment = \"upper-arm\", at_mm = [-30, 0, -130] }";
    let vias = format!("{{ segment = \"girdle\", at_mm = [20, 130, 10] }},\n    {via}");
    let wearer = edited(builtin_wearer("arm-1").unwrap(), &[(via, &vias)]);
    let text = edited(EXAMPLE, &[("duration_s = 6.0", "duration_s = 4.0")]);
    let files = [builtin_wearer("arm-1").unwrap(), &wearer].map(|wearer| {
        SessionFile::parse_with_wearers("it.toml", &text, &|_| Ok(wearer.to_owned())).unwrap()
    });
    let [one, two] = files.each_ref().map(|file| {
        let limb = file.session.limb.as_ref().unwrap();
        let PostureSpec::Fixed(angles) = limb.spec.posture else {
            panic!("{limb:?}");
        };
        let spec = LimbSpec {
            offsets_um: limb.spec.offsets_um,
            ranges_mdeg: limb.spec.ranges_mdeg,
            lines: limb.lines.clone(),
        };
        let arm = Limb::<Exact>::new(&spec).unwrap();
        let posture = angles.map(Angle::from_centideg);
        let pose = arm.skeleton().pose(&arm.radians(&posture).unwrap());
        arm.lines()[0]
            .torques(&pose)
            .map(|vector| vector.to_array().map(|Exact(m)| m))
    });
    assert_eq!((one[1], one[2]), ([0.0; 3], two[2]));
    let shoulder_m = two[1].iter().map(|m| m * m).sum::<f64>().sqrt();
    assert!(shoulder_m > 0.01, "{two:?}");
    let [one, two] = files.map(|file| {
        let port = SimulatedPort::new(native_world(BOOT));
        let outcome = run(&file, port, None, |_| ()).0;
        assert_eq!((outcome.error.is_none(), outcome.refused), (true, 0));
        outcome.trial.samples
    });
    let biceps = |samples: &Samples| -> Vec<Option<f64>> {
        samples.iter().map(|sample| sample.amplitudes[0]).collect()
    };
    let playing = biceps(&two)
        .iter()
        .flatten()
        .filter(|bicep| **bicep > 0.0)
        .count();
    assert!(playing > 50, "{playing}");
    assert_eq!(biceps(&one), biceps(&two));
}

/// An arm that leaves the wearer's range for some time.
struct MovingArm {
    now_us: u64,
    away_us: std::ops::Range<u64>,
    lost_us: u64,
    loads: [Load; CHANNELS],
}

impl Body for MovingArm {
    fn pulse(&mut self, _: &Pulse) {}
    fn advance(&mut self, to_us: u64) -> bool {
        self.now_us = self.now_us.max(to_us);
        true
    }
    fn angle_deg(&self) -> f64 {
        0.0
    }
    fn sensed_deg(&self) -> f64 {
        0.0
    }
    fn posture_deg(&self) -> Option<[f64; 9]> {
        let is_away = self.away_us.contains(&self.now_us);
        let elbow = if is_away { 135.0 } else { 80.0 };
        (self.now_us < self.lost_us).then_some([0.0, 0.0, 0.0, 45.0, 30.0, 20.0, elbow, 0.0, 0.0])
    }
    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }
    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}

fn moving(away_us: std::ops::Range<u64>, lost_us: u64) -> World {
    // World time begins at the boot time of the device.
    let boot_us = u64::from(BOOT.get());
    let body = MovingArm {
        now_us: 0,
        away_us: boot_us + away_us.start..boot_us + away_us.end,
        lost_us: boot_us.saturating_add(lost_us),
        loads: [Load::NOMINAL; CHANNELS],
    };
    World::new(
        Box::new(native(BOOT)),
        Box::new(body),
        BOOT,
        Faults::default(),
        1,
    )
}

#[test]
fn a_measured_posture_is_streamed_and_heeded() {
    for rate in ["rate_hz = 200", "rate_hz = 20"] {
        let edits = [
            ("duration_s = 6.0", "duration_s = 1.5"),
            (FIXED, ""),
            ("rate_hz = 200", rate),
        ];
        let text = edited(EXAMPLE, &edits);
        let outcome = play(&text, moving(0..0, u64::MAX));
        assert!(outcome.error.is_none(), "{:?}", outcome.error);
        assert_eq!(outcome.refused, 0, "{:?}", outcome.trial.events);
        let last = outcome.trial.samples.iter().find(|s| s.t_s > 1.4).unwrap();
        assert!(last.amplitudes.iter().flatten().count() >= 2, "{last:?}");
        // Without a simulated arm nothing measures the posture.
        let none = play(&text, native_world(BOOT)).error.unwrap().to_string();
        assert!(none.starts_with("E550"), "{none}");
    }
}

#[test]
fn a_posture_that_is_lost_ends_it() {
    let edits = [("duration_s = 6.0", "duration_s = 2.0"), (FIXED, "")];
    let text = edited(EXAMPLE, &edits);
    let outcome = play(&text, moving(0..0, 1_000_000));
    let error = outcome.error.unwrap().to_string();
    assert!(error.contains("SensorStale"), "{error}");
}

/// While the elbow is out of its range there is no output, and the host's forces are refused with
/// the reason.
#[test]
fn out_of_its_range_an_arm_gets_nothing() {
    let edits = [
        ("duration_s = 6.0", "duration_s = 1.5"),
        (FIXED, "stale_after_ms = 60\n"),
    ];
    let text = edited(EXAMPLE, &edits);
    let outcome = play(&text, moving(1_000_000..1_100_000, u64::MAX));
    let refused = outcome
        .trial
        .events
        .iter()
        .find(|(_, text)| text.contains("el_flexion"));
    let (_, message) = refused.unwrap_or_else(|| panic!("{:?}", outcome.trial.events));
    assert!(message.contains("allowed: 0 to 130000"), "{message}");
    let away = outcome
        .trial
        .samples
        .iter()
        .filter(|s| s.hand_made == Some(0.0));
    let away: Vec<_> = away.collect();
    assert!(away.len() > 5, "{}", away.len());
    let quiet = away
        .iter()
        .filter(|s| s.amplitudes.iter().all(Option::is_none));
    assert!(quiet.count() >= away.len() - 3);
    assert!(away.iter().all(|s| s.limiting));
}
