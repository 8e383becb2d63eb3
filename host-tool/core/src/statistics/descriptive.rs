//! Mean, standard deviation and quantiles of a sample. All of them are `None` for an empty sample.

use std::borrow::Borrow;

/// Returns the arithmetic mean Σx/n; `None` for an empty sample.
#[must_use]
pub fn mean(values: impl IntoIterator<Item = impl Borrow<f64>>) -> Option<f64> {
    let add = |(sum, count): (f64, u64), value: f64| (sum + value, count + 1);
    let values = values.into_iter().map(|value| *value.borrow());
    let (sum, count) = values.fold((0.0, 0), add);
    (count > 0).then(|| sum / count as f64)
}

/// Estimates the standard deviation of the population from a sample, √(Σ(x − x̄)²/(n − 1)). Returns
/// 0 for a single value, and `None` for an empty sample.
#[must_use]
pub fn standard_deviation(values: &[f64]) -> Option<f64> {
    let mean = mean(values)?;
    let square = values.iter().map(|value| (value - mean).powi(2));
    Some((square.sum::<f64>() / (values.len() as f64 - 1.0).max(1.0)).sqrt())
}

/// Returns the value that a share `part` (0…1) of all values does not exceed. Interpolates linearly
/// between neighbouring values (Hyndman and Fan 1996, definition 7). `None` for an empty sample.
#[must_use]
pub fn quantile(values: impl IntoIterator<Item = impl Borrow<f64>>, part: f64) -> Option<f64> {
    let sorted = Sorted::of(values)?;
    Some(sorted.quantile(part))
}

/// Returns the median, which is the mean of the two middle values for an even number of values;
/// `None` for an empty sample.
#[must_use]
pub fn median(values: impl IntoIterator<Item = impl Borrow<f64>>) -> Option<f64> {
    quantile(values, 0.5)
}

/// Sample of at least one value, sorted in ascending order once, so that several quantiles can be
/// read from it.
#[derive(Clone, PartialEq, Debug)]
pub struct Sorted(Vec<f64>);

impl Sorted {
    /// Sorts the values in ascending order, NaN last; `None` if there are none.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = impl Borrow<f64>>) -> Option<Self> {
        let values = values.into_iter().map(|value| *value.borrow());
        let mut sorted: Vec<f64> = values.collect();
        sorted.sort_unstable_by(f64::total_cmp);
        (!sorted.is_empty()).then_some(Self(sorted))
    }

    /// Returns the value that a share `part` (0…1) of the sample does not exceed, as [`quantile`]
    /// does.
    #[must_use]
    pub fn quantile(&self, part: f64) -> f64 {
        quantile_of_sorted(&self.0, part)
    }
}

/// Returns the [`quantile`] of a sample that is already sorted in ascending order and has at least
/// one value.
pub(super) fn quantile_of_sorted(sorted: &[f64], part: f64) -> f64 {
    let last = sorted.len() - 1;
    let place = part.clamp(0.0, 1.0) * last as f64;
    let below = place as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

/// Summary of a sample: its median, and the range from its 5th to its 95th percentile.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Spread {
    /// Median, in the unit of the values.
    pub median: f64,
    /// 5th percentile, in the unit of the values.
    pub low: f64,
    /// 95th percentile, in the unit of the values.
    pub high: f64,
    /// Number of values.
    pub n: usize,
}

impl Spread {
    /// Computes the spread of values in any order; `None` if there are none.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = impl Borrow<f64>>) -> Option<Self> {
        let sorted = Sorted::of(values)?;
        Some(Self {
            median: sorted.quantile(0.5),
            low: sorted.quantile(0.05),
            high: sorted.quantile(0.95),
            n: sorted.0.len(),
        })
    }

    /// Returns the 5th and the 95th percentile.
    #[must_use]
    pub const fn range(&self) -> [f64; 2] {
        [self.low, self.high]
    }
}

/// Returns the smallest and the largest value; `None` if none is finite.
pub fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values
        .filter(|value| value.is_finite())
        .fold(None, |range, value| match range {
            None => Some((value, value)),
            Some((low, high)) => Some((value.min(low), value.max(high))),
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_sample_has_no_statistics() {
        let none: [f64; 0] = [];
        assert_eq!(mean(none), None);
        assert_eq!(standard_deviation(&none), None);
        assert_eq!(median(none), None);
        assert_eq!(Spread::of(none), None);
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        let values = [4.0, 1.0, 2.0];
        assert_eq!(median(values), Some(2.0));
        assert_eq!(quantile(values, 0.75), Some(3.0));
        assert_eq!(quantile(values, 1.0), Some(4.0));
        assert_eq!(quantile([7.0], 0.3), Some(7.0));
        let spread = Spread::of((0..=100).map(f64::from)).unwrap();
        assert_eq!([spread.low, spread.median, spread.high], [5.0, 50.0, 95.0]);
    }

    #[test]
    fn mean_and_standard_deviation_are_of_the_sample() {
        assert_eq!(mean([1.0, 3.0]), Some(2.0));
        assert_eq!(standard_deviation(&[1.0, 3.0]), Some(2.0_f64.sqrt()));
        assert_eq!(standard_deviation(&[5.0]), Some(0.0));
    }
}
