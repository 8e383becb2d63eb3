//! Tests of random forearms: the declaration is applied, and searches find the true values.

use hal_sim::body::hand::Hand;
use hal_sim::body::hand::digits::{INDEX, REST_DEG, VISIBLE_DEG};
use hal_sim::body::hand::spec::{A, B};
use studies::hamana2022::{
    Cell, DrawOutcome, KnownThresholds, Pattern, Points, Population, PreparedHand, Voltages,
    prepare,
};

/// Another seed than the judged one.
const SEED: u64 = 1_001;

#[test]
fn the_declaration_is_whole() {
    let population = Population::load_embedded().unwrap();
    assert_eq!(population.cells().len(), 3 * 4 * 3 + 5 + 2 * 4);
    assert_eq!(population.claims.len(), 8);
    for range in &population.ranges {
        assert!(
            range.low < range.high && !range.source.is_empty(),
            "{range:?}"
        );
    }
    let names: Vec<String> = population.cells().iter().map(Cell::name).collect();
    let mut distinct = names.clone();
    distinct.sort();
    distinct.dedup();
    assert_eq!(distinct.len(), names.len());
}

/// Returns a wearer for whom the searches find all voltages, and the wearer's random threshold, V.
fn found() -> (Hand, Voltages, f64) {
    let population = Population::load_embedded().unwrap();
    for index in 0..40 {
        let person = population.draw_person(SEED, index).unwrap();
        if let Ok(PreparedHand { hand, voltages, .. }) =
            prepare(&person.spec, KnownThresholds::from_person(&person)).unwrap()
        {
            return (hand, voltages, person.threshold_v);
        }
    }
    panic!("nobody of 40");
}

#[test]
fn searches_find_what_they_say() {
    let (mut hand, voltages, threshold_v) = found();
    let mut bent = |points, isolated, volts| {
        let pattern = Pattern { points, isolated };
        let response = hand.respond(&pattern.period(volts)).unwrap();
        response.angles_deg()[INDEX] - REST_DEG[INDEX]
    };
    // The random threshold lies within the step in which the search found it.
    let found_v = voltages.threshold_v[A];
    assert!(
        (found_v - 2.0..=found_v + 1e-9).contains(&(threshold_v - 1e-9)),
        "{voltages:?}"
    );
    for (point, (threshold, most)) in voltages
        .threshold_v
        .into_iter()
        .zip(voltages.most_v)
        .enumerate()
    {
        assert!(bent(Points::One(point), true, [threshold; 2]) >= VISIBLE_DEG);
        assert!(bent(Points::One(point), true, [threshold - 2.0; 2]) < VISIBLE_DEG);
        assert!(most >= threshold);
    }
    let usual = Pattern::default_two_point().points;
    let r = voltages.ratio.unwrap();
    assert!(bent(usual, false, voltages.most_v.map(|v| r * v)) >= VISIBLE_DEG);
    assert!(bent(usual, false, voltages.most_v.map(|v| (r - 0.1) * v)) < VISIBLE_DEG);
}

/// Ten milliseconds apart, two points equal the sum of each alone, conducted or isolated, because
/// nothing in circuit, skin or nerve remembers so long. They can therefore pull harder conducted
/// than isolated only by as much as one of the points alone does.
#[test]
fn half_a_period_apart_points_know_nothing_of_each_other() {
    let population = Population::load_embedded().unwrap();
    let mut judged = 0;
    for index in 0..12 {
        let person = population.draw_person(SEED, index).unwrap();
        let Ok(mut preparation) =
            prepare(&person.spec, KnownThresholds::from_person(&person)).unwrap()
        else {
            continue;
        };
        for isolated in [false, true] {
            let period = |points| Pattern { points, isolated }.period(preparation.voltages.most_v);
            let apart = Points::Two {
                first: A,
                after_us: 10_000,
            };
            let [a, b] = [A, B].map(|point| period(Points::One(point)));
            let both = preparation.hand.respond(&period(apart)).unwrap();
            let sum = preparation.hand.superposed(&a, (&b, 10_000)).unwrap();
            let of = [both, sum].map(|response| response.torques.flexors_nm[INDEX]);
            assert!(
                (of[0] / of[1] - 1.0).abs() < 0.01,
                "{index} {isolated}: {of:?}"
            );
            judged += 1;
        }
    }
    assert!(judged >= 10, "{judged}");
}

#[test]
fn the_same_seed_draws_the_same_wearers() {
    let population = Population::load_embedded().unwrap();
    let cell = &population.cells()[15];
    let all = |seed| -> Vec<DrawOutcome> {
        let drawn = (0..3).map(|i| population.draw(cell, seed, i).unwrap());
        drawn.collect()
    };
    assert_eq!(all(SEED), all(SEED));
    assert_ne!(all(SEED), all(SEED + 1));
}
