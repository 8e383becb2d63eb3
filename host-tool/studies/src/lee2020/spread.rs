//! Summarises values of many draws: means, medians, and rows of a result.

use crate::laboratory::Row;
use host_core::statistics::{mean, quantile, standard_deviation};

/// Returns the mean and the sample standard deviation; `None` if there are no values.
pub(super) fn mean_sd(values: &[f64]) -> Option<(f64, f64)> {
    Some((mean(values)?, standard_deviation(values)?))
}

/// Returns the median of the finite values.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile_of_finite(values, 0.5)
}

/// Returns a quantile of the finite values; `part` is from 0 to 1.
pub(super) fn quantile_of_finite(values: impl IntoIterator<Item = f64>, part: f64) -> Option<f64> {
    quantile(values.into_iter().filter(|value| value.is_finite()), part)
}

/// Returns a row with median, 5th and 95th percentile beside the paper's value.
pub(super) fn row(
    (id, quantity, unit): (&str, &str, &str),
    paper: Option<f64>,
    values: Vec<f64>,
) -> Row {
    let n = values.len();
    let row = Row::from_numbers(id.to_owned(), quantity.to_owned(), unit, paper, values);
    // Counts all values, including those that are not finite.
    Row { n, ..row }
}

/// Formats a number for a table cell with this many decimals, or a dash.
pub(super) fn cell(number: Option<f64>, decimals: usize) -> String {
    number.map_or_else(|| "-".to_owned(), |value| format!("{value:.decimals$}"))
}

/// Returns slope and R² of a linear regression of y on x; `None` for fewer than three points.
pub(super) fn regression(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = points.len() as f64;
    if points.len() < 3 {
        return None;
    }
    let mean = |coordinate: fn(&(f64, f64)) -> f64| points.iter().map(coordinate).sum::<f64>() / n;
    let (x, y) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let sum = |term: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(term).sum::<f64>();
    let (xx, yy) = (
        sum(&|pair| (pair.0 - x).powi(2)),
        sum(&|pair| (pair.1 - y).powi(2)),
    );
    let xy = sum(&|pair| (pair.0 - x) * (pair.1 - y));
    Some((xy / xx, xy * xy / (xx * yy)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_is_its_own_regression() {
        let points: Vec<_> = (0..9)
            .map(|i| (f64::from(i), 3.0 - 0.5 * f64::from(i)))
            .collect();
        let (slope, r2) = regression(&points).unwrap();
        assert!((slope + 0.5).abs() < 1e-12 && (r2 - 1.0).abs() < 1e-12);
        assert_eq!(regression(&points[..2]), None);
    }

    #[test]
    fn quantiles_leave_out_what_is_no_number() {
        assert_eq!(median([1.0, f64::NAN, 3.0]), Some(2.0));
        assert_eq!(mean_sd(&[1.0, 3.0]), Some((2.0, 2.0_f64.sqrt())));
        assert_eq!(cell(None, 2), "-");
    }
}
