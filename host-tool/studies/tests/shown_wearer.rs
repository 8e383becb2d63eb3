//! Checks that the wearer of experiment 4's sessions and of the README's picture is the medoid of the
//! wearers of P that the posterior accepts, and that the declaration says how typical it is.

use super::participants::AcceptedP;
use hal_sim::body::hand::FittedHand;
use hal_sim::body::{Body, Load};
use host_core::session::{BodySpec, Session, hand_body};
use std::path::{Path, PathBuf};
use studies::hamana2022::Wearer;
use studies::hamana2022::conditioning::BEHAVIOUR;

/// Sessions with this wearer.
const SESSIONS: [&str; 4] = [
    "hamana_exp4_one_point_a",
    "hamana_exp4_one_point_b",
    "hamana_exp4_two_point",
    "ten_channels_and_hand",
];
/// Current that the device counts on in a voltage stage, A, and the load with which it judges
/// voltages, Ω.
const DEVICE: (f64, f64) = (0.020, 2_000.0);

/// Returns the wearer's hand on channels 1 to 3, as a session file describes it.
fn fitted(wearer: &Wearer) -> FittedHand {
    let [a, b, e, _] = *wearer.hand.pads();
    FittedHand {
        spec: wearer.hand.spec().clone(),
        points: [a, b, e],
        factor: wearer.hand.factor,
        shift_m: [0.0; 2],
        channels: [0, 1, 2],
        simulated_units: None,
    }
}

fn path(folder: &str, name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../{folder}/{name}.toml"))
}

/// Returns a session's text, with a new body if `FLEXOR_OVERWRITE` is set.
fn renewed(path: &Path, body: &str) -> String {
    let text = std::fs::read_to_string(path).unwrap();
    if std::env::var_os("FLEXOR_OVERWRITE").is_none() {
        return text;
    }
    let (before, _) = text.split_once("[body]\n").unwrap();
    let text = format!("{before}{body}");
    std::fs::write(path, &text).unwrap();
    text
}

/// The sessions have the medoid's forearm and voltages, which the device can apply to its loads.
#[test]
fn experiment_4_shows_the_medoid_of_p() {
    let accepted = AcceptedP::load();
    let (drawn, wearer) = &accepted.wearers[accepted.medoid];
    let voltages = &wearer.voltages;
    let [extensor_v, most_extensor_v] = wearer.extensor_v.unwrap();
    let [a_v, b_v] = voltages.threshold_v;
    let [most_a_v, most_b_v] = voltages.most_v;
    let threshold_v = [a_v, b_v, extensor_v];
    let most_v = [most_a_v, most_b_v, most_extensor_v];
    let ratio = voltages.ratio.unwrap();
    println!("{drawn:?}: {threshold_v:?} to {most_v:?} V, r_th {ratio}");
    let fitted = fitted(wearer);
    let moving = fitted.to_moving_hand(0).unwrap();
    for (load, most_v) in moving.loads().iter().zip(most_v) {
        println!("{load:?}");
        let through_v = match load {
            Load::Ohms(ohm) => DEVICE.0 * ohm.min(DEVICE.1),
            Load::Open => 0.0,
        };
        assert!(most_v <= through_v, "{most_v} V, {through_v} V");
    }
    let body = hand_body(&fitted).unwrap();
    for name in SESSIONS {
        let text = renewed(&path("sessions", name), &body);
        let session = Session::parse(name, &text).unwrap();
        let Some(BodySpec::Hand(hand)) = &session.body else {
            panic!("{name}: no hand");
        };
        assert_eq!(**hand, fitted, "{name}");
        let joint = session.joint.as_ref().unwrap();
        for point in joint.flexors.iter().chain([&joint.extensor]) {
            let channel = usize::from(point.channel);
            let is_part = joint.flexors.len() == 2 && channel < 2;
            let low_v = match is_part {
                true => ratio * most_v[channel],
                false => threshold_v[channel],
            };
            let mv = |v: f64| (1e3 * v).round() as u32; // at most 40 V
            assert_eq!(point.threshold.get(), mv(low_v), "{name} {channel}");
            assert_eq!(point.max.get(), mv(most_v[channel]), "{name} {channel}");
        }
    }
}

/// The declaration says how far the medoid's finger moves and how far those of the other accepted
/// wearers do.
#[test]
fn the_declaration_says_how_typical_the_wearer_is() {
    let accepted = AcceptedP::load();
    let text = std::fs::read_to_string(path("experiments", "hamana-4")).unwrap();
    let place = |name: &str| BEHAVIOUR.iter().position(|own| *own == name).unwrap();
    for (name, says) in [
        ("flexion by A, deg", "A alone bends it by"),
        ("flexion by B, deg", "B alone by"),
        ("flexion by two points, deg", "both by"),
    ] {
        let (own, [low, middle, high]) = accepted.typical(place(name));
        let words = format!("{says} {own:.0}° ({middle:.0}°, {low:.0} to {high:.0}°)");
        assert!(text.contains(&words), "hamana-4.toml does not say: {words}");
    }
}
