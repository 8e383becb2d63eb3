//! Checks that experiment 4's sessions show the medoid of participant P's accepted wearers.

use hal_sim::body::hand::FittedHand;
use host_core::session::{BodySpec, Session, hand_body};
use std::path::{Path, PathBuf};
use studies::hamana2022::conditioning::{
    AcceptedForearm, BEHAVIOUR, Declaration, Mechanism, Posterior, Prior, Table, behaviour, medoid,
    weighted_quantile,
};
use studies::hamana2022::{Participants, Population};

/// Wearers that together have less than this weight are left out of the search for the medoid.
const LEAST: f64 = 1e-4;

/// The wearer that is shown, with how all accepted wearers behave.
struct Shown {
    hand: FittedHand,
    /// Thresholds of A, B and the extensor's point, V.
    threshold_v: [f64; 3],
    most_v: [f64; 3],
    ratio: f64,
    behaviour: Behaviour,
    /// Behaviour and weight of every accepted wearer.
    all: Vec<(Behaviour, f64)>,
}

type Behaviour = [f64; BEHAVIOUR.len()];

impl Shown {
    /// Returns the weighted 5 %, 50 % and 95 % quantile of a quantity over all accepted wearers.
    fn spread(&self, quantity: usize) -> [f64; 3] {
        let values: Vec<(f64, f64)> = self
            .all
            .iter()
            .map(|(behaviour, weight)| (behaviour[quantity], *weight))
            .collect();
        [0.05, 0.5, 0.95].map(|part| weighted_quantile(&values, part).unwrap())
    }
}

/// Returns the medoid of participant P's accepted wearers in the session of table 7.
fn shown() -> Shown {
    let declaration = Declaration::load_embedded().unwrap();
    let population = Population::load_embedded().unwrap();
    let participants = Participants::load(Some("P")).unwrap().all;
    let posterior = Posterior::load_embedded().unwrap();
    let accepted = posterior.of("P", false).filter(|own| own.weight > LEAST);
    let wearer = |accepted: &AcceptedForearm| {
        let prior = Prior {
            declaration: &declaration,
            population: &population,
            participant: &participants[0],
            mechanism: Mechanism::Default,
            seed: accepted.drawn.0,
        };
        let wearer = prior.accepted_wearer(accepted, Table::Seven);
        wearer.unwrap().unwrap()
    };
    let wearers = accepted.filter_map(|accepted| {
        let wearer = wearer(accepted);
        let behaviour = behaviour(&wearer).unwrap()?;
        Some((accepted, wearer, behaviour))
    });
    let wearers: Vec<_> = wearers.collect();
    let all: Vec<(Behaviour, f64)> = wearers
        .iter()
        .map(|(accepted, _, behaviour)| (*behaviour, accepted.weight))
        .collect();
    let (accepted, wearer, behaviour) = &wearers[medoid(&all).unwrap()];
    println!("seed and forearm {:?}, weight {}", accepted.drawn, accepted.weight);
    let [a, b, e, _] = *wearer.hand.pads();
    let extensor_v = wearer.extensor_v.unwrap();
    let [threshold_a, threshold_b] = wearer.voltages.threshold_v;
    let [most_a, most_b] = wearer.voltages.most_v;
    Shown {
        hand: FittedHand {
            spec: wearer.hand.spec().clone(),
            points: [a, b, e],
            factor: wearer.hand.factor,
            shift_m: [0.0; 2],
            channels: [0, 1, 2],
            simulated_units: None,
        },
        threshold_v: [threshold_a, threshold_b, extensor_v[0]],
        most_v: [most_a, most_b, extensor_v[1]],
        ratio: wearer.voltages.ratio.unwrap(),
        behaviour: *behaviour,
        all,
    }
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

/// The three sessions have the medoid of P's accepted wearers, with the voltages that the searches
/// find on it.
#[test]
fn experiment_4_shows_the_medoid_of_p() {
    let shown = shown();
    for (place, name) in BEHAVIOUR.into_iter().enumerate() {
        let [low, middle, high] = shown.spread(place);
        let own = shown.behaviour[place];
        println!("{name}: {own:.2}; accepted wearers {middle:.2}, {low:.2} to {high:.2}");
    }
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
