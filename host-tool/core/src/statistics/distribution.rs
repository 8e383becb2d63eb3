//! p-values of the distributions, from statrs' incomplete beta and gamma functions and libm's erfc.
//! All are computed as tails, so none is a difference from one.

use super::sample::StatisticsError;
use statrs::distribution::{ContinuousCDF, Normal};
use statrs::function::{beta::beta_reg, gamma::gamma_ur};
use std::f64::consts::SQRT_2;

/// Maximum degrees of freedom. Above it, statrs subtracts two nearly equal logarithms of its gamma
/// function, which leaves fewer than ten correct digits.
const MOST_FREEDOM: f64 = 5000.0;

fn check_degrees_of_freedom(df: f64) -> Result<(), StatisticsError> {
    if df > 0.0 && df <= MOST_FREEDOM {
        return Ok(());
    }
    Err(StatisticsError::OutOfRange {
        what: "the number of degrees of freedom",
        range: "(0, 5000]",
    })
}

/// Returns the two-sided p-value of a statistic `t` with Student's t distribution (Abramowitz and
/// Stegun 1964, 26.7.1 and 26.5.27). `df` are the degrees of freedom, in (0, 5000].
///
/// # Errors
/// A statistic whose square is not finite, degrees of freedom outside their range.
pub fn student_t_p(t: f64, df: f64) -> Result<f64, StatisticsError> {
    fisher_f_p(t * t, 1.0, df)
}

/// Returns the p-value of a statistic `f`: the upper tail of Fisher's F distribution (Abramowitz
/// and Stegun 1964, 26.6.2). `effect` and `error` are the degrees of freedom, each in (0, 5000] and
/// not necessarily whole.
///
/// # Errors
/// A statistic that is not finite or below zero, degrees of freedom outside their range.
pub fn fisher_f_p(f: f64, effect: f64, error: f64) -> Result<f64, StatisticsError> {
    check_not_negative(f)?;
    check_degrees_of_freedom(effect)?;
    check_degrees_of_freedom(error)?;
    let sum = error + effect * f;
    let p = beta_reg(error / 2.0, effect / 2.0, error / sum);
    // Near one the other tail is exact, because its argument is small.
    if p <= 0.5 {
        return Ok(p);
    }
    Ok(1.0 - beta_reg(effect / 2.0, error / 2.0, effect * f / sum))
}

/// Returns the p-value of a statistic: the upper tail of the χ² distribution (Abramowitz and Stegun
/// 1964, 26.4.19). `df` are the degrees of freedom, in (0, 5000].
///
/// # Errors
/// A statistic that is not finite or below zero, degrees of freedom outside their range.
pub fn chi_squared_p(chi_squared: f64, df: f64) -> Result<f64, StatisticsError> {
    check_not_negative(chi_squared)?;
    check_degrees_of_freedom(df)?;
    // statrs refuses zero.
    if chi_squared == 0.0 {
        return Ok(1.0);
    }
    Ok(gamma_ur(df / 2.0, chi_squared / 2.0))
}

fn check_not_negative(value: f64) -> Result<(), StatisticsError> {
    if value >= 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(StatisticsError::OutOfRange {
        what: "the statistic",
        range: "[0, ∞)",
    })
}

/// Returns the two-sided p-value P(|Z| > z) of the standard normal distribution, for z ≥ 0. It does
/// not use erfc of statrs, which is correct to only ten digits.
pub(super) fn normal_p(z: f64) -> f64 {
    libm::erfc(z / SQRT_2)
}

/// Returns the cumulative probability P(Z ≤ z) of the standard normal distribution.
pub(super) fn normal_cdf(z: f64) -> f64 {
    0.5 * libm::erfc(-z / SQRT_2)
}

/// Returns the quantile of the standard normal distribution: the z with P(Z ≤ z) = `p`, for `p` in
/// (0, 1).
pub(super) fn normal_quantile(p: f64) -> f64 {
    Normal::standard().inverse_cdf(p)
}
