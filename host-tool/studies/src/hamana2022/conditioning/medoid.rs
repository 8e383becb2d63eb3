//! The most typical one of weighted wearers: the medoid of what a two-point session shows of them.

use crate::hamana2022::TwoPointsError;
use crate::hamana2022::pattern::Pattern;
use crate::hamana2022::voltages::{bent_deg, extended_deg};
use crate::hamana2022::wearers::Wearer;
use hal_sim::body::hand::spec::{A, B};

/// Names of the quantities of [`behaviour`], with their units.
pub const BEHAVIOUR: [&str; 11] = [
    "threshold of A, V",
    "threshold of B, V",
    "threshold of the extensor's point, V",
    "greatest voltage of A, V",
    "greatest voltage of B, V",
    "greatest voltage of the extensor's point, V",
    "r_th",
    "flexion by A, deg",
    "flexion by B, deg",
    "flexion by two points, deg",
    "extension, deg",
];

/// Returns what a session of table 7 shows of a wearer: thresholds and greatest voltages, the ratio
/// r_th, and how far the index finger moves from rest at the greatest voltages. `None` without r_th
/// or without an extensor's point.
///
/// # Errors
/// Fails if the circuit of the hand cannot be solved.
pub fn behaviour(wearer: &Wearer) -> Result<Option<[f64; BEHAVIOUR.len()]>, TwoPointsError> {
    let mut hand = wearer.hand.clone();
    let voltages = &wearer.voltages;
    let Some((r_th, extensor_v)) = voltages.ratio.zip(wearer.extensor_v) else {
        return Ok(None);
    };
    let mut bent = |pattern| bent_deg(&mut hand, pattern, voltages.most_v);
    let flexions = [
        bent(Pattern::isolated_point(A))?,
        bent(Pattern::isolated_point(B))?,
        bent(Pattern::default_two_point())?,
    ];
    let extension = extended_deg(&mut hand, extensor_v[1])?.0;
    let [a, b] = voltages.threshold_v;
    let [most_a, most_b] = voltages.most_v;
    let [by_a, by_b, by_two] = flexions;
    Ok(Some([
        a,
        b,
        extensor_v[0],
        most_a,
        most_b,
        extensor_v[1],
        r_th,
        by_a,
        by_b,
        by_two,
        extension,
    ]))
}

/// Returns the index of the medoid of `points` with weights: the point with the smallest mean distance
/// to all. Each coordinate counts by its weighted standard deviation; one that does not vary counts
/// nothing. `None` without points.
#[must_use]
pub fn medoid<const N: usize>(points: &[([f64; N], f64)]) -> Option<usize> {
    let total: f64 = points.iter().map(|(_, weight)| weight).sum();
    let mean = |value: &dyn Fn(&[f64; N]) -> f64| {
        let weighted = points.iter().map(|(point, weight)| weight * value(point));
        weighted.sum::<f64>() / total
    };
    let deviations: [f64; N] = std::array::from_fn(|place| {
        let middle = mean(&|point| point[place]);
        mean(&|point| (point[place] - middle).powi(2)).sqrt()
    });
    let distance = |a: &[f64; N], b: &[f64; N]| -> f64 {
        let squares = (0..N).filter(|place| deviations[*place] > 0.0);
        let squares = squares.map(|place| ((a[place] - b[place]) / deviations[place]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let distances = points
        .iter()
        .map(|(own, _)| mean(&|point| distance(own, point)));
    let nearest = distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
    nearest.map(|(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The medoid follows the weight, and a coordinate's unit does not matter.
    #[test]
    fn the_medoid_is_in_the_middle_of_the_weight() {
        let at = |x: f64, y: f64, weight: f64| ([x, 1e3 * y], weight);
        let points = [
            at(0.0, 0.0, 1.0),
            at(1.0, 1.0, 1.0),
            at(2.0, 2.0, 1.0),
            at(9.0, 5.0, 0.0),
        ];
        assert_eq!(medoid(&points), Some(1));
        let mut heavy = points;
        heavy[2].1 = 50.0;
        assert_eq!(medoid(&heavy), Some(2));
        assert_eq!(medoid::<2>(&[]), None);
    }
}
