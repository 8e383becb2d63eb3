//! Sessions that name a wearer file: values that they take from it, values that they may tighten,
//! and refusals.

use firmware::safety::{StageSpec, WearerSpec};
use firmware::units::Amplitude;
use host_core::session::{Session, SessionError};
use host_core::wearer::builtin_wearer;

use crate::session_files::load;
use crate::wearer_files::FULL;

/// A minimal session that plays the muscle of the built-in wearer K05.
const LEAST: &str = r#"
title = "Least"
duration_s = 1.0
[wearer]
file = "../wearers/K05.toml"
[[channel]]
number = 1
name = "extensors"
stage = { kind = "current", full_scale_ma = 50.0 }
train = { shape = "biphasic-cathodic-first", width_us = 400, frequency_hz = 30.0 }
muscle = {}
[setpoints]
kind = "amplitudes"
values = [{ channel = 1, value = 12.0 }]
rate_hz = 50
"#;

fn parse(text: &str) -> Result<Session, SessionError> {
    Session::parse("it.toml", text)
}

fn valid_session(text: &str) -> Session {
    parse(text).unwrap_or_else(|e| panic!("{}", e.lines()))
}

fn edited(text: &str, edits: &[(&str, &str)]) -> String {
    let edit = |text: String, (find, replace): &(&str, &str)| {
        assert!(text.contains(find), "{find}");
        text.replacen(find, replace, 1)
    };
    edits.iter().fold(text.to_owned(), edit)
}

fn numbers(e: &SessionError) -> Vec<u16> {
    e.errors().map(|e| e.problem().number()).collect()
}

/// Returns numbers and lines of the errors of `text` with the wearer file `wearer`.
fn mistakes(text: &str, wearer: &str) -> (Vec<u16>, String) {
    match Session::parse_with_wearers("it.toml", text, &|_| Ok(wearer.to_owned())) {
        Ok(_) => (Vec::new(), String::new()),
        Err(e) => (numbers(&e), e.lines()),
    }
}

#[test]
fn what_a_session_does_not_say_is_the_files() {
    let session = valid_session(LEAST);
    let channel = &session.channels[0];
    assert_eq!(channel.spec.limit, Amplitude::new(15_000));
    assert_eq!(channel.spec.area_mm2, 2_500);
    let limits = WearerSpec {
        host_timeout_ms: 40,
        fall_ms: 50,
        ..WearerSpec::default()
    };
    assert_eq!(session.wearer, limits);
    let muscle = channel.muscle.as_ref().unwrap();
    assert_eq!(
        (muscle.force.a_mn_per_s, muscle.force.k_micro),
        (130_800, 12_000)
    );
    assert_eq!(muscle.recruitment.motor_threshold, Amplitude::new(10_000));
    assert_eq!(muscle.recruitment.reference, Amplitude::new(15_000));
    assert_eq!(muscle.recruitment.limit, channel.spec.limit);
    let worn = session.worn.unwrap();
    assert_eq!(
        (&*worn.file, &*worn.wearer.name),
        ("../wearers/K05.toml", "K05")
    );
    assert_eq!(Some(&*worn.text), builtin_wearer("K05"));
}

/// The device receives the same bytes whether the numbers are typed or come from the file.
#[test]
fn a_file_and_its_numbers_configure_alike() {
    let typed = edited(
        LEAST,
        &[
            (
                "file = \"../wearers/K05.toml\"",
                "host_timeout_ms = 40\nfall_ms = 50\nreturn_area_mm2 = 2500",
            ),
            (
                "name = \"extensors\"",
                "name = \"extensors\"\nlimit = 15.0\narea_mm2 = 2500",
            ),
            (
                "muscle = {}",
                "muscle = { a_n_per_s = 130.8, k = 0.012, tau_c_ms = 11.5, tau1_ms = 5.0, \
                 tau2_ms = 124.1, motor_threshold = 10.0, reference = 15.0, slope_per_unit = SLOPE }",
            ),
        ],
    );
    let slope = valid_session(LEAST).channels[0]
        .muscle
        .as_ref()
        .unwrap()
        .recruitment
        .slope_micro;
    let typed = typed.replace("SLOPE", &format!("{}", f64::from(slope) / 1e6));
    assert_eq!(
        valid_session(&typed).setup_requests(),
        valid_session(LEAST).setup_requests()
    );
    assert!(valid_session(&typed).worn.is_none());
}

#[test]
fn a_session_may_tighten() {
    let text = edited(
        LEAST,
        &[
            (
                "K05.toml\"",
                "K05.toml\"\nname = \"K05\"\nhost_timeout_ms = 30\nrise_ms = 700\nhand_stop_required = true\nmax_session_s = 60",
            ),
            (
                "name = \"extensors\"",
                "name = \"extensors\"\nlimit = 13.5\narea_mm2 = 1000",
            ),
            (
                "muscle = {}",
                "muscle = { tau2_ms = 100.0, report = false }",
            ),
        ],
    );
    let session = valid_session(&text);
    assert_eq!(session.wearer.host_timeout_ms, 30);
    assert_eq!(
        (session.wearer.rise_ms, session.wearer.max_session_s),
        (700, 60)
    );
    assert!(session.wearer.hand_stop_required);
    let channel = &session.channels[0];
    assert_eq!(channel.spec.limit, Amplitude::new(13_500));
    assert_eq!(channel.spec.area_mm2, 1_000);
    let muscle = channel.muscle.as_ref().unwrap();
    assert_eq!(
        (muscle.force.tau1_us, muscle.force.tau2_us),
        (5_000, 100_000)
    );
}

/// Contradictions to the wearer file: text, replacement, error number, and part of the message.
#[rustfmt::skip]
const REFUSED: [(&str, &str, u16, &str); 22] = [
    ("name = \"extensors\"", "name = \"extensors\"\nlimit = 15.5", 659, "`channel.limit` is 15.5, but the wearer file allows at most 15 mA"),
    ("name = \"extensors\"", "name = \"extensors\"\nstart = 0.1", 659, "`channel.start` is 0.1, but the wearer file allows at most 0 mA"),
    ("name = \"extensors\"", "name = \"extensors\"\narea_mm2 = 2501", 659, "at most 2500 mm²"),
    ("K05.toml\"", "K05.toml\"\nhost_timeout_ms = 41", 659, "is 41, but the wearer file allows at most 40 ms"),
    ("K05.toml\"", "K05.toml\"\nfall_ms = 51", 659, "at most 50 ms"),
    ("K05.toml\"", "K05.toml\"\nrise_ms = 499", 659, "at least 500 ms"),
    ("K05.toml\"", "K05.toml\"\nreturn_area_mm2 = 2600", 659, "at most 2500 mm²"),
    ("K05.toml\"", "K05.toml\"\nname = \"K06\"", 660, "`wearer.name` is \"K06\", but the wearer file belongs to K05"),
    ("[setpoints]", "[study]\npseudonym = \"K06\"\n[setpoints]", 660, "`study.pseudonym` is \"K06\""),
    ("[setpoints]", "[[channel]]\nnumber = 2\nname = \"b\"\nlimit = 1.0\nstage = { kind = \"current\", full_scale_ma = 50.0 }\ntrain = { shape = \"biphasic-cathodic-first\", width_us = 400, frequency_hz = 30.0 }\n[setpoints]", 657, "`channel.number` is 2"),
    ("kind = \"current\", full_scale_ma = 50.0", "kind = \"voltage\", full_scale_v = 50.0, load_ohm = 2000", 658, "a current stage"),
    ("width_us = 400", "width_us = 200", 658, "is 200, but channel 1's thresholds in the wearer file hold only for 400 µs"),
    ("frequency_hz = 30.0", "frequency_hz = 41.0", 658, "hold only for 20 to 40 Hz"),
    ("frequency_hz = 30.0", "period_us = 50001", 658, "`channel.train.period_us` is 50001"),
    ("muscle = {}", "muscle = {}\nforce = { max_frequency_hz = 60.0 }", 658, "`channel.force.max_frequency_hz`"),
    ("K05.toml", "K99.toml", 650, "no built-in wearer has this name"),
    ("file = \"../wearers/K05.toml\"", "name = \"K05\"", 661, "`wearer.name` needs `wearer.file`"),
    ("file = \"../wearers/K05.toml\"", "haptic_range = true", 661, "`wearer.haptic_range`"),
    ("file = \"../wearers/K05.toml\"", "", 404, "`channel.limit` is missing"),
    ("value = 12.0", "value = 15.5", 453, "15 mA"),
    ("width_us = 400", "width_us = 501", 407, "10 to 500"),
    ("rate_hz = 50", "rate_hz = 20", 462, "host silence of 40 ms"),
];

#[test]
fn what_is_looser_or_elsewhere_is_refused_by_name() {
    for (find, replace, number, words) in REFUSED {
        let text = edited(LEAST, &[(find, replace)]);
        let Err(e) = parse(&text) else {
            panic!("{replace} is taken");
        };
        assert!(numbers(&e).contains(&number), "{replace}: {}", e.lines());
        assert!(e.lines().contains(words), "{replace}: {}", e.lines());
    }
}

/// Mistakes of the wearer file are reported with their own place, together with those of the
/// session.
#[test]
fn mistakes_of_the_file_and_of_the_session_are_told_at_once() {
    let bad = edited(
        FULL,
        &[
            ("\nlimit = 15\n", "\nlimit = 9\n"),
            ("fall_ms = 40", "fal_ms = 40"),
        ],
    );
    let text = edited(LEAST, &[("duration_s = 1.0", "duration_s = 0.0")]);
    let (numbers, lines) = mistakes(&text, &bad);
    assert_eq!(
        numbers.iter().filter(|number| **number == 653).count(),
        2,
        "{lines}"
    );
    assert!(numbers.contains(&402) && numbers.contains(&407), "{lines}");
    assert!(lines.contains("../wearers/K05.toml:"), "{lines}");
    assert!(lines.contains(" it.toml:"), "{lines}");
    let (numbers, lines) = mistakes(LEAST, "schema = 9");
    assert_eq!(numbers, [651], "{lines}");
}

/// The file's curve converts thresholds to another width; the limit never exceeds the known one.
#[test]
fn another_width_is_converted_by_the_files_curve_and_noted() {
    let at = |width: u16, wearer: &str| {
        let text = edited(
            LEAST,
            &[
                ("width_us = 400", &format!("width_us = {width}")),
                ("value = 12.0", "value = 0.0"),
            ],
        );
        Session::parse_with_wearers("it.toml", &text, &|_| Ok(wearer.to_owned()))
    };
    let factor = |us: f64| (1.0 + 215.385 / us) / (1.0 + 215.385 / 400.0);
    let bare = edited(
        FULL,
        &[(
            ", upper = [{ width_us = 100, value = 25 }, { width_us = 400, value = 15 }]",
            "",
        )],
    );
    for (width, wearer) in [(500, &bare), (300, &bare)] {
        let session = at(width, wearer).unwrap_or_else(|e| panic!("{}", e.lines()));
        let channel = &session.channels[0];
        let muscle = channel.muscle.as_ref().unwrap();
        let times = factor(f64::from(width));
        let threshold = muscle.recruitment.motor_threshold.get();
        assert_eq!(threshold, (10_000.0 * times).round() as u32);
        let limit = (15_000.0 * times.min(1.0)).floor() as u32;
        assert_eq!(channel.spec.limit.get(), limit, "at {width} µs");
        // The muscle at its converted threshold is recruited as at the original one.
        let octaves = |span: u32, slope: u32| f64::from(span) * f64::from(slope);
        let here = octaves(
            muscle.recruitment.reference.get() - threshold,
            muscle.recruitment.slope_micro,
        );
        assert!(
            (here / octaves(5_000, 240_000) - 1.0).abs() < 1e-4,
            "{here}"
        );
        let is_conversion_note = |text: &String| text.contains("strength–duration");
        assert!(
            session.notes.iter().any(is_conversion_note),
            "{:?}",
            session.notes
        );
    }
    // The upper limits of the curve allow more: linear between their points.
    let upper = at(250, FULL).unwrap_or_else(|e| panic!("{}", e.lines()));
    let most = (15_000.0 * factor(250.0)).round() as u32; // end of the muscle's recruitment curve
    assert_eq!(upper.channels[0].spec.limit.get(), most.min(20_000));
    // The pulse is so short that the threshold reaches the limit.
    let e = at(100, &bare).unwrap_err();
    assert_eq!(numbers(&e), [658]);
    assert!(
        e.lines().contains("is not below the wearer's limit"),
        "{}",
        e.lines()
    );
}

/// Points of a joint without amplitudes use the operator's range, or that from threshold to limit.
#[test]
fn points_are_the_files_from_least_to_most() {
    let session = load("hamana_exp4_two_point_wearer.toml");
    let joint = session.joint.unwrap();
    let points = joint.flexors.iter().chain([&joint.extensor]);
    let ranges: Vec<_> = points.map(|p| (p.threshold.get(), p.max.get())).collect();
    assert_eq!(
        ranges,
        [(20_000, 28_000), (25_000, 36_000), (14_000, 26_000)]
    );
}

/// A joint begins below the operator's range if the file says so.
#[test]
fn a_joint_begins_at_the_joint_threshold_of_the_file() {
    let file = builtin_wearer("P").unwrap();
    let least = "minimum = 20\n";
    assert!(file.contains(least));
    let file = file.replacen(least, "minimum = 20\njoint_threshold = 18.7\n", 1);
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../sessions/hamana_exp4_two_point_wearer.toml"
    );
    let text = std::fs::read_to_string(path).unwrap();
    let session = Session::parse_with_wearers("it.toml", &text, &|_| Ok(file.clone())).unwrap();
    let thresholds = session.joint.unwrap().flexors;
    let thresholds: Vec<u32> = thresholds.iter().map(|p| p.threshold.get()).collect();
    assert_eq!(thresholds, [18_700, 25_000]);
}

/// Tests of the haptic range: text, replacement, and number of errors.
#[rustfmt::skip]
const HAPTIC: [(&str, &str, usize); 6] = [
    ("value = 12.0", "value = 0.0", 0),
    ("value = 12.0", "value = 10.0", 0),
    ("value = 12.0", "value = 9.999", 1),
    ("rate_hz = 50", "rate_hz = 50\nbounds = [{ channel = 1, least = 0.0, most = 15.0 }]", 0),
    ("rate_hz = 50", "rate_hz = 50\nbounds = [{ channel = 1, least = 9.0, most = 15.0 }]", 1),
    ("muscle = {}", "muscle = { motor_threshold = 9.0 }", 1),
];

#[test]
fn the_haptic_range_is_kept_where_a_session_asks() {
    let text = edited(LEAST, &[("K05.toml\"", "K05.toml\"\nhaptic_range = true")]);
    valid_session(&text);
    for (find, replace, count) in HAPTIC {
        let (numbers, lines) = mistakes(
            &edited(&text, &[(find, replace)]),
            builtin_wearer("K05").unwrap(),
        );
        assert_eq!(numbers, vec![662; count], "{replace}: {lines}");
        assert!(count == 0 || lines.contains("10 to 15 mA"), "{lines}");
    }
    // For a wearer who accepts more, the limit is 1.5 I_MT, and a larger one is refused.
    let brave = edited(
        builtin_wearer("K05").unwrap(),
        &[
            ("limit = 15", "limit = 18"),
            ("reference = 15", "reference = 18"),
        ],
    );
    let session = Session::parse_with_wearers("it.toml", &text, &|_| Ok(brave.clone())).unwrap();
    assert_eq!(session.channels[0].spec.limit, Amplitude::new(15_000));
    let beyond = edited(
        &text,
        &[("name = \"extensors\"", "name = \"extensors\"\nlimit = 16.0")],
    );
    assert_eq!(mistakes(&beyond, &brave).0, [662]);
    let free = edited(&beyond, &[("haptic_range = true", "haptic_range = false")]);
    assert_eq!(mistakes(&free, &brave).0, [0; 0]);
}

/// The load with which voltages are judged must not exceed that of the file.
#[test]
fn a_load_that_lets_more_through_is_refused() {
    let text = edited(
        LEAST,
        &[
            ("number = 1", "number = 2"),
            (
                "kind = \"current\", full_scale_ma = 50.0",
                "kind = \"voltage\", full_scale_v = 50.0, load_ohm = 2500",
            ),
            (
                "width_us = 400, frequency_hz = 30.0",
                "width_us = 200, frequency_hz = 50.0",
            ),
            ("muscle = {}\n", ""),
            ("channel = 1, value = 12.0", "channel = 2, value = 20.0"),
            ("rate_hz = 50", "rate_hz = 60"),
        ],
    );
    assert_eq!(
        mistakes(&text, FULL).0,
        [0; 0],
        "{}",
        mistakes(&text, FULL).1
    );
    let loose = edited(&text, &[("load_ohm = 2500", "load_ohm = 2600")]);
    let (numbers, lines) = mistakes(&loose, FULL);
    assert_eq!(numbers, [659], "{lines}");
    let session = Session::parse_with_wearers("it.toml", &text, &|_| Ok(FULL.to_owned())).unwrap();
    let is_voltage = matches!(session.channels[0].spec.stage, StageSpec::Voltage { .. });
    assert!(is_voltage && session.wearer.hand_stop_required);
}

/// Sessions that name a wearer file, and the equivalent typed numbers: the device receives the same
/// configuration from both.
#[rustfmt::skip]
const TYPED: [(&str, &[(&str, &str)]); 3] = [
    ("harris_wall/1_pre_wall.toml", HARRIS),
    ("harris_wall/3_pre_wall_co_contraction.toml", HARRIS),
    ("hamana_exp4_two_point_wearer.toml", &[
        ("kind = \"finger\"\n", "kind = \"finger\"\nparticipant = \"P\"\n"),
        ("file = \"../wearers/P.toml\"\nname = \"P\"", "max_current_ma = 20.0\nmax_charge_uc = 5.0\nmax_rms_ma = 10.0\nrise_ms = 200\nfall_ms = 50\nhost_timeout_ms = 100"),
        ("name = \"flexor A\"", "name = \"flexor A\"\nlimit = 28.0\nstart = 28.0\narea_mm2 = 300"),
        ("name = \"flexor B\"", "name = \"flexor B\"\nlimit = 36.0\nstart = 36.0\narea_mm2 = 300"),
        ("name = \"extensor\"", "name = \"extensor\"\nlimit = 26.0\nstart = 26.0\narea_mm2 = 300"),
        ("{ channel = 1 }", "{ channel = 1, threshold = 20.0, max = 28.0 }"),
        ("{ channel = 2 }", "{ channel = 2, threshold = 25.0, max = 36.0 }"),
        ("{ channel = 3 }", "{ channel = 3, threshold = 14.0, max = 26.0 }"),
    ]),
];
const HARRIS: &[(&str, &str)] = &[
    (
        "file = \"../../wearers/harris-1.toml\"",
        "max_current_ma = 80.0\nmax_charge_uc = 5.0\nmax_rms_ma = 10.0\nrise_ms = 1\nfall_ms = 50\nhost_timeout_ms = 100",
    ),
    ("name = \"triceps\"", "name = \"triceps\"\nlimit = 80.0"),
    ("name = \"biceps\"", "name = \"biceps\"\nlimit = 40.0"),
    ("at_deg = 90.0", "at_deg = 90.0\nmax = 80.0"),
    (
        "depth_deg = 9.0",
        "depth_deg = 9.0, begin = 20.0, end = 80.0",
    ),
];

#[test]
fn sessions_that_name_a_file_are_what_they_were() {
    for (file, edits) in TYPED {
        let antagonist = ("{ channel = 2 }", "{ channel = 2, amplitude = 40.0 }");
        let mut edits = edits.to_vec();
        edits.extend(file.contains("co_contraction").then_some(antagonist));
        let path = format!("{}/../sessions/{file}", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(path).unwrap();
        let (named, typed) = (load(file), valid_session(&edited(&text, &edits)));
        assert!(named.worn.is_some() && typed.worn.is_none());
        assert_eq!(named.setup_requests(), typed.setup_requests(), "{file}");
        // Also as a built-in session, which has no folder.
        assert_eq!(
            valid_session(&text).setup_requests(),
            typed.setup_requests(),
            "{file}"
        );
        let worn = Session {
            worn: named.worn.clone(),
            ..typed
        };
        assert_eq!(named, worn, "{file}");
    }
}

/// With a variable width, the limit is that of the longest pulse; a range of amplitudes holds at
/// one width only.
#[test]
fn a_live_width_is_limited_as_its_longest_pulse_is() {
    let bare = edited(
        FULL,
        &[(
            ", upper = [{ width_us = 100, value = 25 }, { width_us = 400, value = 15 }]",
            "",
        )],
    );
    let text = |width: &str| {
        edited(
            LEAST,
            &[
                ("muscle = {}\n", ""),
                ("width_us = 400", &format!("width_us = {width}")),
            ],
        )
    };
    let limit = |width: &str, wearer: &str| {
        let read = Session::parse_with_wearers("it.toml", &text(width), &|_| Ok(wearer.to_owned()));
        read.map(|session| session.channels[0].spec.limit.get())
    };
    assert_eq!(
        limit("200, max_width_us = 400", builtin_wearer("K05").unwrap()).unwrap(),
        15_000
    );
    let e = limit("200, max_width_us = 500", builtin_wearer("K05").unwrap()).unwrap_err();
    assert_eq!(numbers(&e), [658]);
    assert!(
        e.lines().contains("`channel.train.max_width_us` is 500"),
        "{}",
        e.lines()
    );
    let lowered = 15_000.0 * (1.0 + 215.385 / 500.0) / (1.0 + 215.385 / 400.0);
    assert_eq!(
        limit("400, max_width_us = 500", &bare).unwrap(),
        lowered as u32
    );
    let haptic = edited(
        &text("200, max_width_us = 400"),
        &[("K05.toml\"", "K05.toml\"\nhaptic_range = true")],
    );
    assert_eq!(mistakes(&haptic, builtin_wearer("K05").unwrap()).0, [658]);
}

/// The haptic range applies to amplitudes over time and to lists of pulses.
#[test]
fn the_haptic_range_holds_over_time() {
    let text = edited(
        LEAST,
        &[
            ("K05.toml\"", "K05.toml\"\nhaptic_range = true"),
            ("frequency_hz = 30.0", "frequency_hz = 30.0, lists = true"),
        ],
    );
    let course = |kind: &str, points: &str| {
        let (head, _) = text.split_once("[setpoints]").unwrap();
        let text = format!(
            "{head}[setpoints]\nkind = \"{kind}\"\nrate_hz = 50\nchannel = 1\npoints = [{points}]\n"
        );
        mistakes(&text, builtin_wearer("K05").unwrap())
    };
    let good = "{ at_s = 0, value = 10.0 }, { at_s = 0.5, value = 15.0 }";
    let rest = "{ at_s = 0, value = 0.0 }, { at_s = 0.5, value = 15.0 }";
    let weak = "{ at_s = 0, value = 9.0 }, { at_s = 0.5, value = 15.0 }";
    for (kind, points, count) in [
        ("amplitude-ramp", good, 0),
        ("amplitude-ramp", rest, 1),
        ("amplitude-steps", rest, 0),
        ("amplitude-steps", weak, 1),
        ("amplitude-ramp", weak, 1),
    ] {
        let (numbers, lines) = course(kind, points);
        assert_eq!(numbers, vec![662; count], "{kind}, {points}: {lines}");
    }
    let list = "rate_hz = 50\n[[setpoints.list]]\nat_s = 0.2\nchannel = 1\npulses = [{ after_us = 0, value = VALUE }]";
    for (value, count) in [("12.0", 0), ("9.5", 1)] {
        let text = edited(&text, &[("rate_hz = 50", &list.replace("VALUE", value))]);
        let (numbers, lines) = mistakes(&text, builtin_wearer("K05").unwrap());
        assert_eq!(numbers, vec![662; count], "{value}: {lines}");
    }
}

/// A simulated finger is that of the file's participant unless the session names another; without
/// either, parsing fails.
#[test]
fn a_finger_is_the_files_participant() {
    const KNOWN: &str = include_str!("../../sessions/hamana_exp4_two_point_wearer.toml");
    let kind = "kind = \"finger\"\n";
    assert!(!KNOWN.contains("participant ="));
    let saying = |name: &str| {
        edited(
            KNOWN,
            &[(kind, &format!("{kind}participant = \"{name}\"\n"))],
        )
    };
    let session = valid_session(KNOWN);
    assert_eq!(session, valid_session(&saying("P")));
    assert_ne!(session.body, valid_session(&saying("Q")).body);
    const TYPED: &str = include_str!("../../sessions/hamana_exp4_two_point_finger.toml");
    let e = parse(&edited(TYPED, &[("participant = \"P\"\n", "")])).unwrap_err();
    assert_eq!(numbers(&e), [404], "{}", e.lines());
    assert!(e.lines().contains("participant"), "{}", e.lines());
    // A wearer who is not in table 7; a mistake in the file must not cause a second error about the
    // participant.
    let (found, lines) = mistakes(KNOWN, FULL);
    assert!(found.contains(&404), "{lines}");
    let (found, lines) = mistakes(KNOWN, "schema = 1\n");
    assert!(!lines.contains("participant"), "{found:?} {lines}");
}
