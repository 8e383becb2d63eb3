//! Checks which draw of the population is the wearer of experiment 4's sessions, and that the
//! sessions agree.

use hal_sim::body::hand::digits::{INDEX, REST_DEG, VISIBLE_DEG};
use hal_sim::body::hand::{FittedHand, Hand};
use hal_sim::body::{Body, Load};
use host_core::session::{BodySpec, Session, hand_body};
use std::path::{Path, PathBuf};
use studies::hamana2022::{KnownThresholds, Pattern, Population, prepare, search_extensor};

/// Seed and index, as in the sessions' comment.
const SEED: u64 = 2022;
const SHOWN: u64 = 4;
/// The highest angle of the paper's sine, °.
const TOP_DEG: f64 = 85.0;
/// Largest current of a voltage stage, A, and the load with which its voltages are judged, Ω.
const DEVICE: (f64, f64) = (0.020, 2_000.0);
const STEP_V: f64 = 2.0;
/// Voltage at which the population's searches end, V.
const END_V: f64 = 44.0;

/// A random wearer whom the device can arm.
struct Armed {
    hand: FittedHand,
    /// Thresholds of A, B and the extensor's point, V.
    threshold_v: [f64; 3],
    most_v: [f64; 3],
    ratio: f64,
    /// Angle with two points at their largest voltages, rested, °.
    reach_deg: f64,
}

fn index_deg(hand: &mut Hand, [a, b, _]: [f64; 3], part: f64) -> f64 {
    let period = Pattern::default_two_point().period([part * a, part * b]);
    hand.respond(&period).unwrap().angles_deg()[INDEX]
}

/// Returns draw `index`, if every search finds a voltage within the device's limits.
fn armed(population: &Population, index: u64) -> Option<Armed> {
    let person = population.draw_person(SEED, index).unwrap();
    let prepared = prepare(&person.spec, KnownThresholds::from_person(&person)).unwrap();
    let mut prepared = prepared.ok()?;
    let extensor_v = search_extensor(&mut prepared.hand, END_V).unwrap()?;
    let (found, mut hand) = (prepared.voltages, prepared.hand);
    let [a, b, e, _] = *hand.pads();
    let fitted = FittedHand {
        spec: hand.spec().clone(),
        points: [a, b, e],
        factor: hand.factor,
        shift_m: [0.0; 2],
        channels: [0, 1, 2],
        simulated_units: None,
    };
    let loads = *fitted.to_moving_hand(0).unwrap().loads();
    let through = |point: usize| match loads[point] {
        Load::Ohms(ohm) => (DEVICE.0 * ohm.min(DEVICE.1) / STEP_V).floor() * STEP_V,
        Load::Open => 0.0,
    };
    let threshold_v = [found.threshold_v[0], found.threshold_v[1], extensor_v[0]];
    let most_v = [found.most_v[0], found.most_v[1], extensor_v[1]];
    let most_v: [f64; 3] = std::array::from_fn(|index| most_v[index].min(through(index)));
    if (0..3).any(|index| most_v[index] <= threshold_v[index]) {
        return None;
    }
    let is_visible = |hand: &mut Hand, tenths: u32| {
        let bent = index_deg(hand, most_v, f64::from(tenths) / 10.0) - REST_DEG[INDEX];
        bent >= VISIBLE_DEG
    };
    let tenths = (1..=10).find(|tenths| is_visible(&mut hand, *tenths))?;
    Some(Armed {
        hand: fitted,
        threshold_v,
        most_v,
        ratio: f64::from(tenths) / 10.0,
        reach_deg: index_deg(&mut hand, most_v, 1.0),
    })
}

fn path(method: &str) -> PathBuf {
    let name = format!("../sessions/hamana_exp4_{method}.toml");
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
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

/// No earlier draw qualifies, and the three sessions have this wearer and these voltages.
#[test]
fn experiment_4_shows_the_first_wearer_who_can_follow_the_sine() {
    let population = Population::load_embedded().unwrap();
    for index in 0..SHOWN {
        let reach = armed(&population, index).map(|armed| armed.reach_deg);
        assert!(reach.is_none_or(|deg| deg < TOP_DEG), "{index}: {reach:?}");
    }
    let shown = armed(&population, SHOWN).unwrap();
    assert!(shown.reach_deg >= TOP_DEG, "{}", shown.reach_deg);
    let body = hand_body(&shown.hand).unwrap();
    for method in ["one_point_a", "one_point_b", "two_point"] {
        let text = renewed(&path(method), &body);
        let session = Session::parse(method, &text).unwrap();
        let Some(BodySpec::Hand(hand)) = &session.body else {
            panic!("{method}: no hand");
        };
        assert_eq!(**hand, shown.hand, "{method}");
        let joint = session.joint.as_ref().unwrap();
        for point in joint.flexors.iter().chain([&joint.extensor]) {
            let channel = usize::from(point.channel);
            let most_v = shown.most_v[channel];
            let is_part = method == "two_point" && channel < 2;
            let low_v = match is_part {
                true => shown.ratio * most_v,
                false => shown.threshold_v[channel],
            };
            let mv = |v: f64| (1e3 * v).round() as u32; // at most 40 V
            assert_eq!(point.threshold.get(), mv(low_v), "{method} {channel}");
            assert_eq!(point.max.get(), mv(most_v), "{method} {channel}");
        }
    }
}
