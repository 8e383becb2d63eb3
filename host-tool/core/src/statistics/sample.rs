//! Requirements that a sample must meet before statistics are computed from it.

use thiserror::Error;

/// Reason why a statistic cannot be computed from a sample. The field `what` names the argument or
/// values concerned.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
pub enum StatisticsError {
    /// There are fewer values, subjects or conditions than the method needs.
    #[error("{what}: {given} given, at least {least} needed")]
    TooFew {
        /// Name of the argument with too few elements.
        what: &'static str,
        /// Number of elements given.
        given: usize,
        /// Number of elements needed.
        least: usize,
    },
    /// Two lengths differ that must be equal.
    #[error("{what}: {given} given, {expected} expected")]
    UnequalLengths {
        /// Name of the elements whose number differs.
        what: &'static str,
        /// Number of elements that were given.
        given: usize,
        /// Number of elements in the first argument or row.
        expected: usize,
    },
    /// A value is infinite, not a number, or so large that its cube may overflow.
    #[error("{what}: value {index} (counted from 0) is not finite or its magnitude exceeds 1e60")]
    NotFinite {
        /// Name of the argument.
        what: &'static str,
        /// Index of the value, in the order given, counted from 0.
        index: usize,
    },
    /// All values are equal except for rounding errors, so that the test has no variation to
    /// compare with.
    #[error("{what} do not vary")]
    NoVariance {
        /// Name of the values that do not vary.
        what: &'static str,
    },
    /// A parameter is outside its range.
    #[error("{what} is outside {range}")]
    OutOfRange {
        /// Name of the parameter.
        what: &'static str,
        /// Allowed range.
        range: &'static str,
    },
}

use StatisticsError::{NoVariance, NotFinite, TooFew, UnequalLengths};

/// Checks that `given` is at least `least`. `name` names the elements for the error.
pub(super) fn check_count(
    name: &'static str,
    given: usize,
    least: usize,
) -> Result<(), StatisticsError> {
    if given < least {
        return Err(TooFew {
            what: name,
            given,
            least,
        });
    }
    Ok(())
}

/// Checks that the number of elements, `given`, equals that of the first argument, `expected`.
/// `name` names the elements for the error.
pub(super) fn check_equal_length(
    name: &'static str,
    given: usize,
    expected: usize,
) -> Result<(), StatisticsError> {
    if given != expected {
        return Err(UnequalLengths {
            what: name,
            given,
            expected,
        });
    }
    Ok(())
}

/// Maximum magnitude of a value. Larger values are refused like infinite ones, so that sums of
/// their cubes do not overflow.
const MOST: f64 = 1e60;

/// Checks that every value is finite and at most [`MOST`] in magnitude.
pub(super) fn check_finite<'a>(
    name: &'static str,
    values: impl IntoIterator<Item = &'a f64>,
) -> Result<(), StatisticsError> {
    let mut values = values.into_iter();
    match values.position(|value| value.is_nan() || value.abs() > MOST) {
        Some(index) => Err(NotFinite { what: name, index }),
        None => Ok(()),
    }
}

/// Checks that there are at least two rows of equal length, that each has at least `least` values,
/// and that all values are finite. `names` are the names of rows and columns for the error.
pub(super) fn check_rows(
    names: [&'static str; 2],
    rows: &[Vec<f64>],
    least: usize,
) -> Result<(), StatisticsError> {
    check_count(names[0], rows.len(), 2)?;
    check_count(names[1], rows[0].len(), least)?;
    for row in rows {
        check_equal_length(names[1], row.len(), rows[0].len())?;
    }
    check_finite(names[0], rows.iter().flatten())
}

/// Checks that a sum of squares is larger than rounding errors alone would make it. These are 16 ε
/// of the largest magnitude for each of `count` values. The sum must also be large enough that
/// powers of it do not underflow.
pub(super) fn check_varies(
    name: &'static str,
    sum_squares: f64,
    largest: f64,
    count: usize,
) -> Result<(), StatisticsError> {
    let rounding = 16.0 * f64::EPSILON * largest;
    if sum_squares <= (count as f64 * rounding * rounding).max(MOST.powi(-2)) {
        return Err(NoVariance { what: name });
    }
    Ok(())
}

/// Returns the largest magnitude of the values; 0 for no values.
pub(super) fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |most, v| v.abs().max(most))
}

/// Returns the mean Σx/n; there must be at least one value.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the sum of squares Σ(x − mean)².
pub(super) fn sum_squares(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean).powi(2)).sum()
}
