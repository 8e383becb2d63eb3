//! Tests of the simulated participants of Hamana 2022: accepted forearms meet the printed voltages,
//! and what cannot be conditioned on is refused by name.

use std::collections::BTreeMap;
use studies::hamana2022::conditioning::{
    AcceptedForearm, BEHAVIOUR, DECLARED, Declaration, Mechanism, Posterior, PrintedVoltages,
    Prior, SHIPPED, Table, WeightSummary, behaviour, medoid, weighted_quantile,
};
use studies::hamana2022::{Participant, Participants, Population, Wearer};

/// Step of the searches, and with it the noise of one step, V.
const STEP_V: f64 = 2.0;
/// Number of accepted forearms of each participant that are built again.
const BUILT: usize = 3;

/// Accepted wearers with less weight are left out of the search for the medoid.
const LEAST: f64 = 1e-4;

struct Shipped {
    declaration: Declaration,
    population: Population,
    participants: Vec<Participant>,
    posterior: Posterior,
}

impl Shipped {
    fn load() -> Self {
        Self {
            declaration: Declaration::load_embedded().unwrap(),
            population: Population::load_embedded().unwrap(),
            participants: Participants::load(None).unwrap().all,
            posterior: Posterior::load_embedded().unwrap(),
        }
    }

    fn prior<'a>(&'a self, participant: &'a Participant, seed: u64) -> Prior<'a> {
        Prior {
            declaration: &self.declaration,
            population: &self.population,
            participant,
            mechanism: Mechanism::Default,
            seed,
        }
    }
}

/// The heaviest forearms of each participant, built again from seed and number, have the printed
/// voltages in all of their sessions, to one step of the search.
#[test]
fn accepted_forearms_have_the_printed_voltages() {
    let known = Shipped::load();
    for participant in &known.participants {
        let printed = PrintedVoltages::of(participant);
        let mut own: Vec<&AcceptedForearm> = known.posterior.of(&participant.name, false).collect();
        own.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        for accepted in own.into_iter().take(BUILT) {
            let prior = known.prior(participant, accepted.drawn.0);
            let tables = Table::UNSOLVED.into_iter().zip(printed.unsolved_v);
            let solved = printed.solved_v.map(|(_, most_v)| (Table::Seven, most_v));
            let tables = tables.filter_map(|(table, most_v)| Some((table, most_v?)));
            for (table, most_v) in tables.chain(solved) {
                let wearer = prior.accepted_wearer(accepted, table).unwrap().unwrap();
                let found = wearer.voltages;
                for (found, printed) in found.most_v.into_iter().zip(most_v) {
                    let apart = (found - printed).abs();
                    assert!(apart <= STEP_V + 1e-9, "{accepted:?} {table:?}: {found}");
                }
            }
            if let Some((threshold_v, _)) = printed.solved_v {
                let wearer = prior
                    .accepted_wearer(accepted, Table::Seven)
                    .unwrap()
                    .unwrap();
                let [a_v, b_v, e_v] = threshold_v;
                let [extensor_v, _] = wearer.extensor_v.unwrap();
                let [a, b] = wearer.voltages.threshold_v;
                for (found, printed) in [(a, a_v), (b, b_v), (extensor_v, e_v)] {
                    let apart = (found - printed).abs();
                    assert!(apart <= STEP_V + 1e-9, "{accepted:?}: {found} {printed}");
                }
            }
        }
    }
}

/// Wearers of P that the posterior accepts, with seed and number, what a session shows of them, and
/// weight.
pub struct AcceptedP {
    pub wearers: Vec<((u64, u64), Wearer)>,
    pub shown: Vec<([f64; BEHAVIOUR.len()], f64)>,
    /// Index of the medoid.
    pub medoid: usize,
}

impl AcceptedP {
    pub fn load() -> Self {
        let known = Shipped::load();
        let participant = known.participants.iter().find(|own| own.name == "P");
        let participant = participant.unwrap();
        let accepted = known
            .posterior
            .of("P", false)
            .filter(|own| own.weight > LEAST);
        let (mut wearers, mut shown) = (Vec::new(), Vec::new());
        for accepted in accepted {
            let prior = known.prior(participant, accepted.drawn.0);
            let wearer = prior.accepted_wearer(accepted, Table::Seven);
            let wearer = wearer.unwrap().unwrap();
            let Some(behaviour) = behaviour(&wearer).unwrap() else {
                continue;
            };
            wearers.push((accepted.drawn, wearer));
            shown.push((behaviour, accepted.weight));
        }
        let medoid = medoid(&shown).unwrap();
        Self {
            wearers,
            shown,
            medoid,
        }
    }

    /// Returns the value of the medoid and the weighted 5 %, 50 % and 95 % quantiles of quantity
    /// `place` of [`BEHAVIOUR`].
    pub fn typical(&self, place: usize) -> (f64, [f64; 3]) {
        let values: Vec<(f64, f64)> = self
            .shown
            .iter()
            .map(|(shown, weight)| (shown[place], *weight))
            .collect();
        let quantiles = [0.05, 0.5, 0.95].map(|part| weighted_quantile(&values, part).unwrap());
        (self.shown[self.medoid].0[place], quantiles)
    }
}

/// The medoid of P's accepted wearers behaves like most of them: each quantity lies within 90 % of their
/// weight.
#[test]
fn the_medoid_of_p_is_typical() {
    let accepted = AcceptedP::load();
    println!(
        "medoid: seed and number {:?}",
        accepted.wearers[accepted.medoid].0
    );
    for (place, name) in BEHAVIOUR.into_iter().enumerate() {
        let (own, [low, middle, high]) = accepted.typical(place);
        println!("{name}: {own:.2}; {middle:.2}, {low:.2} to {high:.2}");
        assert!((low..=high).contains(&own), "{name}: {own}");
    }
}

/// A forearm of the prior has voltages in a session of each table; below the ceiling, its greatest ones
/// in the session of table 7 are not the last ones of the search.
#[test]
fn forearms_of_the_prior_have_sessions_with_voltages() {
    let known = Shipped::load();
    let seed = known.declaration.seed;
    for participant in &known.participants {
        let prior = known.prior(participant, seed);
        let forearm = prior.complete_forearm(0, false).unwrap().unwrap();
        for table in Table::UNSOLVED.into_iter().chain([Table::Seven]) {
            let wearer = prior.accepted_wearer(&forearm, table).unwrap();
            wearer.unwrap_or_else(|why| panic!("{} {table:?}: {why}", participant.name));
        }
        assert_eq!(prior.complete_forearm(0, false).unwrap().unwrap(), forearm);
    }
    let prior = known.prior(&known.participants[0], seed);
    let below = prior.complete_forearm(0, true).unwrap().unwrap();
    let wearer = prior.accepted_wearer(&below, Table::Seven).unwrap();
    let most_v = wearer.unwrap().voltages.most_v;
    assert!(most_v.iter().all(|most_v| *most_v < 40.0), "{most_v:?}");
}

/// The shipped file is small, its weights add up to 1, and a forearm of another seed or number would
/// be another one.
#[test]
fn the_shipped_posterior_is_whole() {
    assert!(SHIPPED.len() <= 1_000_000, "{}", SHIPPED.len());
    let known = Shipped::load();
    for participant in &known.participants {
        let mut weights: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
        for accepted in known.posterior.of(&participant.name, false) {
            weights
                .entry(accepted.drawn.0)
                .or_default()
                .push(accepted.weight);
        }
        assert!(!weights.is_empty(), "{}", participant.name);
        for weights in weights.into_values() {
            let sum = WeightSummary::of(&weights).sum;
            assert!((sum - 1.0).abs() < 1e-3, "{}: {sum}", participant.name);
        }
    }
}

/// A forearm is chosen in proportion to its weight, and by seed and draw alone.
#[test]
fn forearms_are_chosen_by_weight() {
    let known = Shipped::load();
    let heaviest = known.posterior.of("P", false);
    let heaviest = heaviest
        .max_by(|a, b| a.weight.total_cmp(&b.weight))
        .unwrap();
    let total: f64 = known.posterior.of("P", false).map(|own| own.weight).sum();
    let draws = 4_000_u32;
    let choose = |draw: u32| {
        known
            .posterior
            .choose(("P", false), (7, draw.into()))
            .unwrap()
    };
    let chosen = (0..draws).filter(|draw| choose(*draw) == heaviest).count();
    let expected = f64::from(draws) * heaviest.weight / total;
    let error = expected.sqrt();
    assert!(
        (chosen as f64 - expected).abs() < 4.0 * error,
        "{chosen} {expected}"
    );
    assert_eq!(known.posterior.choose(("nobody", false), (7, 0)), None);
}

/// A tolerance of 0, an empty range and a missing number of sessions are refused, all at once.
#[test]
fn wrong_declarations_are_refused() {
    let refused = |changes: &[(&str, &str)]| {
        let changed = changes
            .iter()
            .fold(DECLARED.to_owned(), |text, (find, replace)| {
                assert!(text.contains(find), "{find}");
                text.replacen(find, replace, 1)
            });
        Declaration::parse(&changed).unwrap_err().to_string()
    };
    let error = refused(&[
        ("noise_steps = 1", "noise_steps = 0"),
        ("tried = 0.5", "tried = 0.0"),
        ("low = 0.33", "low = 3.3"),
        ("draws = 1500", "draws = 0"),
    ]);
    for named in [
        "E621",
        "noise_steps is 0",
        "tried is 0",
        "scatter has no values from 3.3 to 1",
        "draws is 0",
    ] {
        assert!(error.contains(named), "{named}: {error}");
    }
    assert!(refused(&[("draws = 1500", "drows = 1500")]).contains("drows"));
}

/// Printed numbers that no forearm can have are named as a pair, and one beyond the searches by
/// itself.
#[test]
fn conflicting_numbers_are_named() {
    let known = Shipped::load();
    let of = |solved_v, unsolved_v| {
        let printed = PrintedVoltages {
            unsolved_v,
            solved_v,
        };
        printed.conflicts("X", &known.declaration)
    };
    let none = [None; 2];
    assert_eq!(of(Some(([24.0, 28.0, 14.0], [28.0, 36.0])), none), [""; 0]);
    let conflicts = of(Some(([24.0, 28.0, 14.0], [16.0, 36.0])), none);
    assert_eq!(conflicts.len(), 1);
    let named = [
        "greatest voltage of A, 16 V",
        "its threshold, 24 V",
        "table 7",
    ];
    assert!(
        named.iter().all(|text| conflicts[0].contains(text)),
        "{conflicts:?}"
    );
    let conflicts = of(None, [None, Some([60.0, 30.0])]);
    assert!(
        conflicts[0].contains("table 3") && conflicts[0].contains("60 V"),
        "{conflicts:?}"
    );
    for participant in &known.participants {
        let printed = PrintedVoltages::of(participant);
        assert_eq!(
            printed.conflicts(&participant.name, &known.declaration),
            [""; 0]
        );
    }
}
