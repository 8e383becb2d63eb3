//! Weights of simulated participants: effective sample size and weighted quantiles.

/// Summary of a set of weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeightSummary {
    /// Number of weights above 0.
    pub positive: usize,
    /// Effective sample size (Σw)² / Σw² (Kish 1965); 0 without weights.
    pub effective: f64,
    /// Largest weight as a fraction of their sum; 0 without weights.
    pub largest: f64,
    /// Sum of the weights.
    pub sum: f64,
}

impl WeightSummary {
    /// Summarises `weights`, which are 0 or above.
    #[must_use]
    pub fn of(weights: &[f64]) -> Self {
        let sum: f64 = weights.iter().sum();
        let squares: f64 = weights.iter().map(|weight| weight * weight).sum();
        let largest = weights.iter().copied().fold(0.0, f64::max);
        let part = |value: f64, of: f64| if of > 0.0 { value / of } else { 0.0 };
        Self {
            positive: weights.iter().filter(|weight| **weight > 0.0).count(),
            effective: part(sum * sum, squares),
            largest: part(largest, sum),
            sum,
        }
    }
}

/// Returns the smallest value that at least the fraction `part` of the weight does not exceed;
/// `None` without weight. `values` are pairs of value and weight.
#[must_use]
pub fn weighted_quantile(values: &[(f64, f64)], part: f64) -> Option<f64> {
    let mut sorted: Vec<(f64, f64)> = values.iter().copied().filter(|pair| pair.1 > 0.0).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = sorted.iter().map(|pair| pair.1).sum();
    let mut below = 0.0;
    for (value, weight) in &sorted {
        below += weight;
        if below >= part * total {
            return Some(*value);
        }
    }
    sorted.last().map(|pair| pair.0)
}

/// Returns the item at the fraction `part` of the weight, 0 to 1, in the order of `items`, which are
/// pairs of item and weight; `None` without items.
#[must_use]
pub fn choose_by_weight<T>(items: &[(T, f64)], part: f64) -> Option<&T> {
    let wanted = part * items.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut below = 0.0;
    let reached = items.iter().find(|(_, weight)| {
        below += weight;
        below > wanted
    });
    reached.or(items.last()).map(|(item, _)| item)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_weights_count_themselves() {
        let summary = WeightSummary::of(&[0.5, 0.5, 0.0, 0.5]);
        assert_eq!((summary.positive, summary.effective), (3, 3.0));
        assert!((summary.largest - 1.0 / 3.0).abs() < 1e-15);
        assert_eq!(WeightSummary::of(&[]).effective, 0.0);
    }

    #[test]
    fn quantiles_follow_the_weight() {
        let values = [(3.0, 1.0), (1.0, 8.0), (2.0, 1.0), (9.0, 0.0)];
        assert_eq!(weighted_quantile(&values, 0.5), Some(1.0));
        assert_eq!(weighted_quantile(&values, 0.85), Some(2.0));
        assert_eq!(weighted_quantile(&values, 1.0), Some(3.0));
        assert_eq!(weighted_quantile(&[(1.0, 0.0)], 0.5), None);
    }
}
