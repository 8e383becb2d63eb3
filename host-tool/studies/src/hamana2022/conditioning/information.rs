//! Mutual information between the mechanism and the outcome of a measurement.

use hal_sim::random::{Random, word};
use std::collections::BTreeMap;

/// Number of bins of an outcome, each with the same share of all outcomes; one more is for outcomes
/// without a value.
const BINS: usize = 8;
/// Number of bootstrap samples and of permutations.
const SAMPLES: u64 = 100;

/// Outcome of one forearm under one mechanism: index of the mechanism, value on the scale of the
/// measurement's noise, and weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightedOutcome {
    pub mechanism: usize,
    /// Number of the forearm, which is the same under every mechanism.
    pub forearm: usize,
    pub value: Option<f64>,
    pub weight: f64,
}

/// Mutual information, bits, with the mean of permuted mechanisms subtracted, and its 95 % interval
/// (bootstrap over forearms). Mechanisms are permuted within each forearm, whose outcomes have most
/// random numbers in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Information {
    pub bits: f64,
    pub low: f64,
    pub high: f64,
    /// Mean information of permuted mechanisms, which was subtracted, bits.
    pub bias: f64,
}

/// Returns the information that an outcome with noise of standard deviation `noise` gives about the
/// mechanism, of which each of `mechanisms` is equally likely beforehand; `None` if one of them has
/// no outcome.
#[must_use]
pub fn mutual_information(
    outcomes: &[WeightedOutcome],
    mechanisms: usize,
    (noise, seed): (f64, u64),
) -> Option<Information> {
    let edges = edges(outcomes);
    let masses: Vec<[f64; BINS + 1]> = outcomes
        .iter()
        .map(|outcome| masses(outcome.value, &edges, noise))
        .collect();
    let all: Vec<usize> = (0..outcomes.len()).collect();
    let labels: Vec<usize> = outcomes.iter().map(|outcome| outcome.mechanism).collect();
    let of = |chosen: &[usize], labels: &[usize]| {
        information(outcomes, &masses, (chosen, labels), mechanisms)
    };
    let raw = of(&all, &labels)?;
    let mut forearms: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (place, outcome) in outcomes.iter().enumerate() {
        forearms.entry(outcome.forearm).or_default().push(place);
    }
    let forearms: Vec<Vec<usize>> = forearms.into_values().collect();
    let mut permuted = Vec::new();
    let mut resampled = Vec::new();
    for sample in 0..SAMPLES {
        let mut random = Random::new(word(seed, sample));
        let mut shuffled = labels.clone();
        for own in &forearms {
            let mut mixed: Vec<usize> = own.iter().map(|&place| labels[place]).collect();
            random.shuffle(&mut mixed);
            for (&place, label) in own.iter().zip(mixed) {
                shuffled[place] = label;
            }
        }
        permuted.extend(of(&all, &shuffled));
        let count = forearms.len() as u64;
        let chosen = forearms
            .iter()
            .flat_map(|_| &forearms[random.below(count) as usize])
            .copied();
        let chosen: Vec<usize> = chosen.collect();
        let chosen_labels: Vec<usize> = chosen.iter().map(|&place| labels[place]).collect();
        resampled.extend(of(&chosen, &chosen_labels));
    }
    let bias = permuted.iter().sum::<f64>() / permuted.len().max(1) as f64;
    // The bootstrap distribution is centred on the raw value, whose own bias it repeats.
    let shift = resampled.iter().sum::<f64>() / resampled.len().max(1) as f64 - raw;
    resampled.sort_by(f64::total_cmp);
    let at = |part: f64| {
        let place = (part * resampled.len() as f64) as usize;
        resampled
            .get(place.min(resampled.len().saturating_sub(1)))
            .copied()
    };
    let bits = |value: f64| (value - bias).max(0.0);
    Some(Information {
        bits: bits(raw),
        low: bits(at(0.025)? - shift),
        high: bits(at(0.975)? - shift),
        bias,
    })
}

/// Returns the inner edges of the bins: weighted quantiles of all values.
fn edges(outcomes: &[WeightedOutcome]) -> Vec<f64> {
    let values = outcomes.iter();
    let values: Vec<(f64, f64)> = values
        .filter_map(|outcome| Some((outcome.value?, outcome.weight)))
        .collect();
    let at =
        |number: usize| super::weights::weighted_quantile(&values, number as f64 / BINS as f64);
    (1..BINS).filter_map(at).collect()
}

/// Returns the probability of each bin for an outcome with noise.
fn masses(value: Option<f64>, edges: &[f64], noise: f64) -> [f64; BINS + 1] {
    let mut masses = [0.0; BINS + 1];
    let Some(value) = value else {
        masses[BINS] = 1.0;
        return masses;
    };
    let mut below = 0.0;
    for (mass, edge) in masses.iter_mut().zip(edges) {
        let until = 0.5 * libm::erfc((value - edge) / (noise * std::f64::consts::SQRT_2));
        *mass = until - below;
        below = until;
    }
    if let Some(last) = masses.get_mut(edges.len()) {
        *last = 1.0 - below;
    }
    masses
}

fn information(
    outcomes: &[WeightedOutcome],
    masses: &[[f64; BINS + 1]],
    (chosen, labels): (&[usize], &[usize]),
    mechanisms: usize,
) -> Option<f64> {
    let mut given = vec![[0.0; BINS + 1]; mechanisms];
    let mut totals = vec![0.0; mechanisms];
    for (&place, &label) in chosen.iter().zip(labels) {
        let weight = outcomes[place].weight;
        totals[label] += weight;
        for (sum, mass) in given[label].iter_mut().zip(masses[place]) {
            *sum += weight * mass;
        }
    }
    if totals.iter().any(|total| *total <= 0.0) {
        return None;
    }
    for (row, total) in given.iter_mut().zip(&totals) {
        row.iter_mut().for_each(|mass| *mass /= total);
    }
    let count = mechanisms as f64;
    let bits = |bin: usize| {
        let mean = given.iter().map(|row| row[bin]).sum::<f64>() / count;
        let terms = given.iter().map(|row| row[bin]).filter(|mass| *mass > 0.0);
        terms
            .map(|mass| mass / count * libm::log2(mass / mean))
            .sum::<f64>()
    };
    Some((0..=BINS).map(bits).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcomes(value: impl Fn(usize, u64) -> f64) -> Vec<WeightedOutcome> {
        let all = (0..4).flat_map(|mechanism| (0..200).map(move |number| (mechanism, number)));
        all.map(|(mechanism, number)| WeightedOutcome {
            mechanism,
            forearm: number as usize,
            value: Some(value(mechanism, number)),
            weight: 1.0,
        })
        .collect()
    }

    /// An outcome that names the mechanism gives log2 of their number, less the mean of permuted
    /// mechanisms; one that is the same for all gives nothing. Noise is small beside the distance of
    /// the values, so that none crosses the edge of a bin.
    #[test]
    fn what_decides_gives_all_and_chance_gives_nothing() {
        let decides = outcomes(|mechanism, number| mechanism as f64 + 1e-4 * number as f64);
        let information = mutual_information(&decides, 4, (1e-6, 1)).unwrap();
        let known = information.bits + information.bias;
        assert!(
            (known - 2.0).abs() < 0.02 && information.bias < 0.03,
            "{information:?}"
        );
        let chance = outcomes(|_, number| number as f64 / 200.0);
        let information = mutual_information(&chance, 4, (1e-3, 1)).unwrap();
        assert!(information.bits < 0.02, "{information:?}");
        assert!(information.low <= information.bits && information.bits <= information.high);
    }

    #[test]
    fn a_mechanism_without_outcomes_has_no_information() {
        let three = outcomes(|_, number| number as f64);
        assert_eq!(mutual_information(&three, 5, (0.1, 1)), None);
    }
}
