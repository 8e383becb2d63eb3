//! Ranks of known values within weighted samples, and whether they are uniform.

use hal_sim::random::{Random, word};

/// Number of places at which the distribution of ranks is compared, evenly from 0 to 1.
const PLACES: usize = 39;
/// Number of simulated sets of uniform ranks.
const SETS: u64 = 4_000;
/// Part of the sets that stays within the band at all places.
const PART: f64 = 0.95;

/// Returns the rank of `truth` within weighted `values`, from 0 to 1; `part` is uniform in [0, 1) and
/// decides ties. It is uniform if the truth is one of the values, each with a chance in proportion to
/// its weight. `None` without weight.
#[must_use]
pub fn rank(truth: f64, values: &[(f64, f64)], part: f64) -> Option<f64> {
    let sum = |is: &dyn Fn(f64) -> bool| -> f64 {
        let own = values.iter().filter(|(value, _)| is(*value));
        own.map(|(_, weight)| weight).sum()
    };
    let total = sum(&|_| true);
    let (below, tied) = (sum(&|value| value < truth), sum(&|value| value == truth));
    (total > 0.0).then(|| (below + part * tied) / total)
}

/// Returns the places of [`deviations`], from 0 to 1.
pub fn places() -> impl Iterator<Item = f64> {
    (1..=PLACES).map(|place| place as f64 / (PLACES + 1) as f64)
}

/// Returns, at each place, by how many standard deviations more ranks lie below it than of uniform
/// ones.
#[must_use]
pub fn deviations(ranks: &[f64]) -> Vec<f64> {
    let count = ranks.len().max(1) as f64;
    let at = |place: f64| {
        let below = ranks.iter().filter(|rank| **rank <= place).count() as f64;
        (below / count - place) / (place * (1.0 - place) / count).sqrt()
    };
    places().map(at).collect()
}

/// Returns the deviation within which uniform ranks stay at all places in 95 % of simulated sets: a
/// simultaneous band for an empirical distribution (after Säilynoja, Bürkner and Vehtari, Statistics
/// and Computing 32, 2022, section 2.2).
#[must_use]
pub fn band(count: usize, seed: u64) -> f64 {
    let largest = |set: u64| {
        let mut random = Random::new(word(seed, set));
        let ranks: Vec<f64> = (0..count).map(|_| random.unit()).collect();
        largest(&deviations(&ranks))
    };
    let mut all: Vec<f64> = (0..SETS).map(largest).collect();
    all.sort_unstable_by(f64::total_cmp);
    let place = (PART * SETS as f64) as usize;
    all.get(place).copied().unwrap_or(f64::INFINITY)
}

/// Returns the largest absolute deviation.
#[must_use]
pub fn largest(deviations: &[f64]) -> f64 {
    deviations.iter().fold(0.0, |most, own| most.max(own.abs()))
}

#[cfg(test)]
mod tests {
    use super::super::weights::choose_by_weight;
    use super::*;
    use hal_sim::random::unit;

    /// The rank of one of a few weighted values, chosen by weight, is uniform, also if some are equal.
    #[test]
    fn ranks_of_the_chosen_are_uniform() {
        let count = 400;
        let of = |number: u64| {
            let value = |place: u64| (3.0 * unit(7, 10 * number + place)).round();
            let weight = |place: u64| 1.0 / (1.0 + 9.0 * unit(9, 10 * number + place));
            let values: Vec<(f64, f64)> =
                (0..6).map(|place| (value(place), weight(place))).collect();
            let truth = choose_by_weight(&values, unit(8, number)).unwrap();
            rank(*truth, &values, unit(10, number)).unwrap()
        };
        let ranks: Vec<f64> = (0..count).map(of).collect();
        let limit = band(ranks.len(), 3);
        assert!(largest(&deviations(&ranks)) < limit);
        // Ranks of samples that are too narrow leave the band.
        let narrow: Vec<f64> = ranks
            .iter()
            .map(|rank| (0.5 + 1.4 * (rank - 0.5)).clamp(0.0, 1.0))
            .collect();
        assert!(largest(&deviations(&narrow)) > limit);
    }

    #[test]
    fn the_band_of_one_place_is_that_of_a_normal() {
        // Over 39 places that move together, the limit lies between that of one and that of 39
        // independent normal deviates.
        let limit = band(200, 1);
        assert!((1.96..3.3).contains(&limit), "{limit}");
    }

    #[test]
    fn a_rank_needs_weight() {
        assert_eq!(rank(1.0, &[(0.5, 0.0)], 0.5), None);
        assert_eq!(rank(1.0, &[(0.5, 2.0), (2.0, 2.0)], 0.5), Some(0.5));
    }
}
