//! Means, percentiles and confidence intervals of paired differences.

use hal_sim::body::random_finger::Draws;
use host_core::statistics;

/// Number of bootstrap resamples of a confidence interval.
const RESAMPLES: usize = 4000;

/// Returns [`statistics::mean`], or NaN for an empty sample. NaN is printed as such and sorts last.
pub fn mean(values: &[f64]) -> f64 {
    statistics::mean(values).unwrap_or(f64::NAN)
}

/// Returns [`statistics::quantile`], or NaN for an empty sample.
pub fn percentile(values: &[f64], part: f64) -> f64 {
    statistics::quantile(values, part).unwrap_or(f64::NAN)
}

/// A mean with both ends of its 95 % confidence interval.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Interval {
    pub mean: f64,
    /// Lower end of the confidence interval.
    pub low: f64,
    /// Upper end of the confidence interval.
    pub high: f64,
}

/// Returns the mean of the paired differences `ours` - `theirs`, with its 95 % percentile bootstrap
/// interval over the pairs (Efron & Tibshirani 1993, ch. 13). The resamples are the same in every
/// run.
pub fn paired(ours: &[f64], theirs: &[f64]) -> Interval {
    let differences: Vec<f64> = ours.iter().zip(theirs).map(|(a, b)| a - b).collect();
    let n = differences.len();
    let mut draws = Draws::new(0, 0, 6);
    let means: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let pick = |_| differences[(draws.uniform(0.0, n as f64) as usize).min(n - 1)];
            (0..n).map(pick).sum::<f64>() / n.max(1) as f64
        })
        .collect();
    Interval {
        mean: mean(&differences),
        low: percentile(&means, 0.025),
        high: percentile(&means, 0.975),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_lie_between_neighbours() {
        let values = [3.0, 1.0, 2.0, 5.0, 4.0];
        assert_eq!(percentile(&values, 0.5), 3.0);
        assert!((percentile(&values, 0.95) - 4.8).abs() < 1e-12);
        assert_eq!(mean(&values), 3.0);
    }

    #[test]
    fn an_interval_is_that_of_students_t_for_even_differences() {
        // 0, 1, … 99: standard error 2.901, t = 1.984.
        let ours: Vec<f64> = (0..100).map(f64::from).collect();
        let found = paired(&ours, &[0.0; 100]);
        assert_eq!(found.mean, 49.5);
        assert!((found.low - (49.5 - 5.76)).abs() < 0.4, "{found:?}");
        assert!((found.high - (49.5 + 5.76)).abs() < 0.4, "{found:?}");
    }
}
