//! What a sample must be before anything is computed from it.

use thiserror::Error;

/// Why a sample gives no answer. `what` names the argument.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Error)]
pub enum StatisticsError {
    /// Fewer values, subjects or conditions than the method needs.
    #[error("{what}: {given} given, at least {least} needed")]
    TooFew {
        /// What there are too few of.
        what: &'static str,
        /// How many there are.
        given: usize,
        /// How many there must be.
        least: usize,
    },
    /// Lengths that must be equal are not.
    #[error("{what}: {given} where {expected} are expected")]
    UnequalLengths {
        /// What is counted.
        what: &'static str,
        /// The length found.
        given: usize,
        /// The length of the first.
        expected: usize,
    },
    /// A value is infinite, not a number, or so large that its cube may overflow.
    #[error("{what}: value number {index} (from 0) is not finite, or beyond 1e60")]
    NotFinite {
        /// The argument.
        what: &'static str,
        /// Which value, in the order given.
        index: usize,
    },
    /// All values are equal but for rounding: there is nothing to compare with.
    #[error("{what} do not vary")]
    NoVariance {
        /// What does not vary.
        what: &'static str,
    },
    /// A parameter is outside its range.
    #[error("{what} is outside {range}")]
    OutOfRange {
        /// The parameter.
        what: &'static str,
        /// Where it may lie.
        range: &'static str,
    },
}

use StatisticsError::{NoVariance, NotFinite, TooFew, UnequalLengths};

/// At least `least` of `what`.
pub(super) fn enough(
    what: &'static str,
    given: usize,
    least: usize,
) -> Result<(), StatisticsError> {
    if given < least {
        return Err(TooFew { what, given, least });
    }
    Ok(())
}

/// As many of `what` as there are of the first.
pub(super) fn equal(
    what: &'static str,
    given: usize,
    expected: usize,
) -> Result<(), StatisticsError> {
    if given != expected {
        return Err(UnequalLengths {
            what,
            given,
            expected,
        });
    }
    Ok(())
}

/// Values beyond this in magnitude are refused with those that are not finite:
/// sums of their cubes stay far below the largest number.
const MOST: f64 = 1e60;

/// Every value finite.
pub(super) fn finite<'a>(
    what: &'static str,
    values: impl IntoIterator<Item = &'a f64>,
) -> Result<(), StatisticsError> {
    let mut values = values.into_iter();
    match values.position(|value| value.is_nan() || value.abs() > MOST) {
        Some(index) => Err(NotFinite { what, index }),
        None => Ok(()),
    }
}

/// At least two rows of equal length of at least `least`, all finite.
pub(super) fn rows(
    names: [&'static str; 2],
    rows: &[Vec<f64>],
    least: usize,
) -> Result<(), StatisticsError> {
    enough(names[0], rows.len(), 2)?;
    enough(names[1], rows[0].len(), least)?;
    for row in rows {
        equal(names[1], row.len(), rows[0].len())?;
    }
    finite(names[0], rows.iter().flatten())
}

/// A sum of squares that is more than what rounding leaves of constant values of
/// this magnitude, 16 ε of the largest for each of `count`, and more than what
/// powers of it can be computed from.
pub(super) fn varies(
    what: &'static str,
    sum_squares: f64,
    largest: f64,
    count: usize,
) -> Result<(), StatisticsError> {
    let rounding = 16.0 * f64::EPSILON * largest;
    if sum_squares <= (count as f64 * rounding * rounding).max(MOST.powi(-2)) {
        return Err(NoVariance { what });
    }
    Ok(())
}

/// The largest magnitude, 0 of nothing.
pub(super) fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, |most, v| v.abs().max(most))
}

/// Σx/n of at least one value.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Σ(x − mean)².
pub(super) fn sum_squares(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean).powi(2)).sum()
}
