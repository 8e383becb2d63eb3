//! A multibody hand as the body of a session: parsing, writing, and invalid hands.

use hal_sim::body::hand::field::{Pad, Shape};
use hal_sim::body::hand::spec::{SMALL_M, SkinSpec};
use hal_sim::body::hand::{FittedHand, HandSpec, Rule};
use hal_sim::random::Random;
use host_core::run::{DeviceName, SessionFile, run};
use host_core::session::{BodySpec, Session, hand_body};

const PLAYED: &str = r#"title = "A hand"
duration_s = 0.6

[[channel]]
number = 1
name = "flexor A"
stage = { kind = "voltage", full_scale_v = 60.0, load_ohm = 2000 }
limit = 26.0
train = { shape = "monophasic-cathodic", width_us = 200, ground_us = 1000, frequency_hz = 50.0 }

[[channel]]
number = 4
name = "another muscle"
stage = { kind = "current", full_scale_ma = 100.0 }
limit = 10.0
train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 50.0 }

[wearer]
max_current_ma = 60.0
max_charge_uc = 12.0
rise_ms = 100

[setpoints]
kind = "amplitudes"
values = [{ channel = 1, value = 25.0 }]
rate_hz = 50

"#;

const HAND: &str = r#"[body]
kind = "hand"
flexor_a = 1
flexor_b = 2
extensor = 3
forearm_m = 0.25
around_m = 0.25
pads_mm = [[120, 5], [160, 0], [130, 105]]
threshold_factor = 800
"#;

fn parsed(body: &str) -> Session {
    Session::parse("hand.toml", &format!("{PLAYED}{body}"))
        .unwrap_or_else(|e| panic!("{}", e.lines()))
}

fn hand_of(session: &Session) -> &FittedHand {
    match &session.body {
        Some(BodySpec::Hand(hand)) => hand,
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_a_file_leaves_out_is_nominal() {
    let session = parsed(HAND);
    let spec = HandSpec {
        forearm_m: 0.25,
        ..HandSpec::nominal(1.0, 0.25, 0)
    };
    let at = |x_m, y_m| HandSpec::round_pad(x_m, y_m);
    let expected = FittedHand {
        spec,
        points: [at(0.12, 0.005), at(0.16, 0.0), at(0.13, 0.105)],
        factor: 800.0,
        shift_m: [0.0; 2],
        channels: [0, 1, 2],
        simulated_units: None,
    };
    assert_eq!(hand_of(&session), &expected);
    // Writing this hand and reading it back gives the same hand.
    assert_eq!(hand_of(&parsed(&hand_body(&expected).unwrap())), &expected);
}

/// Returns a hand with random values, none of them round.
fn drawn(random: &mut Random) -> FittedHand {
    let mut within = |low: f64, high: f64| {
        low + (high - low) * (random.below(1 << 53) as f64 / (1_u64 << 53) as f64)
    };
    let mut spec = HandSpec::nominal(1.0, within(0.24, 0.3), 0);
    spec.forearm_m = within(0.23, 0.28);
    spec.tissue.fat_m = within(0.002, 0.008);
    spec.skin = SkinSpec {
        farad_per_cm2: within(10e-9, 50e-9),
        ohm_cm2: within(2e3, 2e4),
        series_ohm: within(100.0, 500.0),
        half_a_per_cm2: within(1e-3, 1e-2),
    };
    spec.coupling = [within(0.1, 10.0), within(0.1, 10.0), within(0.1, 10.0)];
    spec.scatter = within(0.1, 2.0);
    spec.return_factor = within(0.5, 27.0);
    spec.limiter_a = within(0.01, 0.03);
    spec.membrane.leak_s = within(1e-4, 3.5e-4);
    spec.membrane.absolute_s = within(2.5e-3, 3e-3);
    spec.threshold_spread = within(0.1, 0.3);
    spec.shift_m_per_deg = within(0.0, 0.02) / 90.0;
    spec.flexor_nm = within(0.2, 1.0);
    spec.motion.inertia_kg_m2 = within(3e-5, 5e-5);
    spec.motion.delay_s = within(0.01, 0.05);
    spec.motion.fatigue_time_s = within(10.0, 40.0);
    let places = [[0.1, -0.02], [0.15, 0.01], [0.12, 0.09]];
    let places = places.map(|[x, y]| [x + within(0.0, 0.01), y + within(0.0, 0.01)]);
    let factor = within(1e-3, 1e5);
    let shift_m = [within(-2e-3, 2e-3), within(-2e-3, 2e-3)];
    let seed = random.below(u64::MAX);
    let shape = match seed % 2 {
        0 => HandSpec::round_pad(0.0, 0.0).shape,
        _ => Shape::Rectangle {
            along_m: SMALL_M[0],
            around_m: SMALL_M[1],
        },
    };
    spec.seed = seed;
    spec.rule = [Rule::Potential, Rule::Curvature, Rule::Field][(seed % 3) as usize];
    spec.sums = !seed.is_multiple_of(5);
    FittedHand {
        spec,
        points: places.map(|[x_m, y_m]| Pad { x_m, y_m, shape }),
        factor,
        shift_m,
        channels: [2, 0, 9],
        simulated_units: None,
    }
}

#[test]
fn a_hand_that_is_written_is_read_to_the_bit() {
    let mut random = Random::new(16);
    for _ in 0..200 {
        let hand = drawn(&mut random);
        let text = hand_body(&hand).unwrap();
        let title = "title = \"A hand\"\nduration_s = 1.0\n";
        let volts = PLAYED.split("[[channel]]").nth(1).unwrap();
        let rest = "[setpoints]\nkind = \"keep-alive\"\nrate_hz = 50\n";
        let wearer = "[wearer]\nmax_current_ma = 60.0\nmax_charge_uc = 12.0\n";
        let text = format!("{title}[[channel]]{volts}{wearer}{rest}{text}");
        let session =
            Session::parse("hand.toml", &text).unwrap_or_else(|e| panic!("{}\n{text}", e.lines()));
        assert_eq!(hand_of(&session), &hand, "{text}");
    }
}

#[test]
fn what_no_file_names_is_refused() {
    let named = || hand_of(&parsed(HAND)).clone();
    let mut hand = named();
    hand.spec.limiter_a = f64::INFINITY;
    let message = hand_body(&hand).unwrap_err().to_string();
    assert!(
        message.starts_with("E568") && message.contains("limiter_ma"),
        "{message}"
    );
    let mut hand = named();
    hand.points[1].shape = Shape::Round { diameter_m: 0.03 };
    assert!(
        hand_body(&hand)
            .unwrap_err()
            .to_string()
            .contains("electrodes")
    );
    let mut hand = named();
    hand.spec.seed = 1 << 63;
    assert!(hand_body(&hand).unwrap_err().to_string().contains("seed"));
}

/// All mistakes of a body are reported at once, each with its number.
#[test]
fn mistakes_of_a_hand_are_told_together() {
    let wrong = |edits: &[(&str, &str)]| {
        let mut text = HAND.to_owned();
        for (find, replace) in edits {
            assert!(text.contains(find), "{find}");
            text = text.replacen(find, replace, 1);
        }
        let e = Session::parse("hand.toml", &format!("{PLAYED}{text}")).unwrap_err();
        let numbers: Vec<u16> = e.errors().map(|e| e.problem().number()).collect();
        (numbers, e.lines())
    };
    // A overlaps B, the extensor's electrode lies off the forearm, and a current stage drives B.
    let (numbers, lines) = wrong(&[
        ("[120, 5]", "[150, 5]"),
        ("[130, 105]", "[130, 140]"),
        ("flexor_b = 2", "flexor_b = 4"),
    ]);
    assert_eq!(numbers.len(), 3, "{lines}");
    for (number, words) in [
        (482, "channel 4, which has a current stage"),
        (481, "of the extensor lies outside the forearm"),
        (481, "of A and of B overlap"),
    ] {
        assert!(
            numbers.contains(&number) && lines.contains(words),
            "{lines}"
        );
    }
    let (numbers, lines) = wrong(&[("[160, 0]", "[240, 0]")]);
    assert_eq!(numbers, [481], "{lines}");
    assert!(lines.contains("of B and of the return overlap"), "{lines}");
    let (numbers, lines) = wrong(&[("[160, 0]", "[160, 0, 1]")]);
    assert_eq!(numbers, [403], "{lines}");
    let (numbers, lines) = wrong(&[("[160, 0], ", "")]);
    assert_eq!(numbers, [407], "{lines}");
    let (numbers, lines) = wrong(&[("= 800", "= 0\nrule = \"slope\"\nleak_us = 1\nseed = 0.5")]);
    assert_eq!(numbers, [407, 408, 407, 405], "{lines}");
    let (numbers, lines) = wrong(&[("around_m = 0.25\n", "")]);
    assert_eq!(numbers, [404], "{lines}");
    let (numbers, lines) = wrong(&[("= 800", "= 800\nseed = 99999999999999999999")]);
    assert_eq!(numbers, [407], "{lines}");
    // A field that only another body has.
    let (numbers, lines) = wrong(&[("= 800", "= 800\nparticipant = \"P\"")]);
    assert_eq!(numbers, [402], "{lines}");
}

/// The session runs, its index finger bends, and every circuit is solved.
#[test]
fn a_session_with_a_hand_runs() {
    let text = format!("{PLAYED}{}", HAND.replace("= 800", "= 300"));
    let file = SessionFile::parse("hand.toml", &text).unwrap();
    let port = DeviceName::Native.open(&file.session, 1).unwrap();
    let (outcome, _) = run(&file, port, None, |_| ());
    assert!(outcome.error.is_none(), "{:?}", outcome.error);
    let angles = outcome
        .trial
        .samples
        .iter()
        .filter_map(|sample| sample.true_deg);
    let most = angles.fold(f64::NEG_INFINITY, f64::max);
    assert!(most > 8.0, "{most}");
}
