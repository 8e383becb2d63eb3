//! Tests of two paired samples, effect sizes, and corrections for multiple comparisons.

use super::distribution::student_t_p;
use super::sample::{
    StatisticsError, check_count, check_equal_length, check_finite, check_varies, largest, mean,
    sum_squares,
};

/// Result of Student's paired t-test, two-sided.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PairedT {
    /// Mean of the differences first − second, in the samples' unit.
    pub mean_difference: f64,
    /// Test statistic t: mean difference divided by its standard error.
    pub t: f64,
    /// Degrees of freedom: number of pairs − 1.
    pub df: usize,
    /// Two-sided p-value, from Student's t distribution.
    pub p: f64,
}

/// Tests the differences of pairs against zero with Student's t-test, two-sided (Student 1908).
///
/// # Errors
/// Fewer than two pairs, unequal lengths, values that are not finite, differences that do not vary.
pub fn paired_t(first: &[f64], second: &[f64]) -> Result<PairedT, StatisticsError> {
    let (mean_difference, deviation, n) = differences(first, second)?;
    let t = mean_difference / (deviation / (n as f64).sqrt());
    Ok(PairedT {
        mean_difference,
        t,
        df: n - 1,
        p: student_t_p(t, (n - 1) as f64)?,
    })
}

/// Returns Cohen's d of paired samples, named d_z: mean of first − second, divided by the standard
/// deviation of the differences (Cohen 1988, eq. 2.3.5; Lakens 2013, eq. 6).
///
/// # Errors
/// The errors of [`paired_t`].
pub fn cohens_d_paired(first: &[f64], second: &[f64]) -> Result<f64, StatisticsError> {
    let (mean, deviation, _) = differences(first, second)?;
    Ok(mean / deviation)
}

/// Returns the mean and the standard deviation of the differences first − second, and the number of
/// pairs.
fn differences(first: &[f64], second: &[f64]) -> Result<(f64, f64, usize), StatisticsError> {
    check_count("pairs", first.len(), 2)?;
    check_equal_length("second values of the pairs", second.len(), first.len())?;
    check_finite("first values of the pairs", first)?;
    check_finite("second values of the pairs", second)?;
    let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| a - b).collect();
    let (squares, n) = (sum_squares(&differences), first.len());
    check_varies(
        "differences",
        squares,
        largest(first.iter().chain(second)),
        n,
    )?;
    Ok((mean(&differences), (squares / (n - 1) as f64).sqrt(), n))
}

/// Returns Cohen's d of two independent samples, named d_s: mean of first − mean of second, divided
/// by the pooled standard deviation (Cohen 1988, eq. 2.5.1 and 2.5.2; Lakens 2013, eq. 1).
///
/// # Errors
/// A sample of fewer than two, values that are not finite, samples that do not vary.
pub fn cohens_d_pooled(first: &[f64], second: &[f64]) -> Result<f64, StatisticsError> {
    check_count("first sample", first.len(), 2)?;
    check_count("second sample", second.len(), 2)?;
    check_finite("first sample", first)?;
    check_finite("second sample", second)?;
    let squares = sum_squares(first) + sum_squares(second);
    let n = first.len() + second.len();
    check_varies("samples", squares, largest(first.iter().chain(second)), n)?;
    Ok((mean(first) - mean(second)) / (squares / (n - 2) as f64).sqrt())
}

/// Adjusts the p-values of one family of comparisons by Bonferroni's method (Bonferroni, as in Dunn
/// 1961). Each p-value is multiplied by the number of comparisons, and is at most one.
///
/// # Errors
/// No p-value, or one outside [0, 1].
pub fn bonferroni(p: &[f64]) -> Result<Vec<f64>, StatisticsError> {
    check_probabilities(p)?;
    Ok(p.iter()
        .map(|value| (value * p.len() as f64).min(1.0))
        .collect())
}

/// Adjusts the p-values of one family of comparisons by Holm's step-down method (Holm 1979). The
/// results are in the order of `p`. Compare each of them with the significance level of the whole
/// family.
///
/// # Errors
/// No p-value, or one outside [0, 1].
pub fn holm(p: &[f64]) -> Result<Vec<f64>, StatisticsError> {
    check_probabilities(p)?;
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let mut adjusted = vec![0.0; p.len()];
    let mut most = 0.0_f64;
    for (rank, index) in order.into_iter().enumerate() {
        most = most.max((p.len() - rank) as f64 * p[index]).min(1.0);
        adjusted[index] = most;
    }
    Ok(adjusted)
}

/// Checks that there is at least one p-value and that all are in [0, 1].
fn check_probabilities(p: &[f64]) -> Result<(), StatisticsError> {
    check_count("p-values", p.len(), 1)?;
    check_finite("p-values", p)?;
    match p.iter().all(|p| (0.0..=1.0).contains(p)) {
        true => Ok(()),
        false => Err(StatisticsError::OutOfRange {
            what: "a p-value",
            range: "[0, 1]",
        }),
    }
}
