//! Tests on ranks: Friedman, Wilcoxon's signed ranks, and Mann and Whitney's U.

use super::distribution::{chi_squared_p, normal_p};
use super::sample::{StatisticsError, check_count, check_equal_length, check_finite, check_rows};

/// Maximum number of values for which a p-value is computed exactly by counting. The counts, at
/// most 2^50, are exact in an `f64`.
const EXACT_TO: usize = 50;

/// How a p-value was computed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Method {
    /// Exactly, by counting over all possible assignments of the ranks, with ties taken into
    /// account.
    Exact,
    /// From the normal distribution, with corrections for ties and continuity.
    Normal,
}

/// Result of Friedman's test of several conditions.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Friedman {
    /// Test statistic χ²_r, corrected for ties.
    pub chi_squared: f64,
    /// Degrees of freedom: number of conditions − 1.
    pub df: usize,
    /// p-value by the χ² distribution, which is an approximation for few subjects.
    pub p: f64,
}

/// Compares three or more conditions (columns) that every subject (row) has gone through by
/// Friedman's test on ranks, corrected for ties (Friedman 1937; Conover 1999, eq. 5.8.5).
///
/// # Errors
/// Fewer than two subjects or three conditions, rows of unequal length, values that are not finite,
/// conditions tied in every row.
pub fn friedman(subjects: &[Vec<f64>]) -> Result<Friedman, StatisticsError> {
    check_rows(["subjects", "conditions"], subjects, 3)?;
    let (n, k) = (subjects.len() as f64, subjects[0].len());
    let mut sums = vec![0.0; k];
    let mut tied = 0.0;
    for row in subjects {
        let ranks = Ranks::of(row);
        tied += ranks.ties;
        for (sum, twice) in sums.iter_mut().zip(ranks.twice) {
            *sum += twice as f64 / 2.0;
        }
    }
    let df = k - 1;
    let k = k as f64;
    let spread = k * (k + 1.0) * n - tied / (k - 1.0);
    if spread <= 0.0 {
        return Err(StatisticsError::NoVariance { what: "conditions" });
    }
    let middle = n * (k + 1.0) / 2.0;
    let squares: f64 = sums.iter().map(|sum| (sum - middle).powi(2)).sum();
    let chi_squared = 12.0 * squares / spread;
    Ok(Friedman {
        chi_squared,
        df,
        p: chi_squared_p(chi_squared, df as f64)?,
    })
}

/// Result of Wilcoxon's signed-rank test, two-sided.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Wilcoxon {
    /// Test statistic: the smaller of the rank sums of positive and negative differences.
    pub statistic: f64,
    /// Sum of the ranks of the positive differences first − second.
    pub positive: f64,
    /// Number of pairs that differ; pairs without a difference are dropped.
    pub n: usize,
    /// Two-sided p-value.
    pub p: f64,
    /// How the p-value was computed: exactly for up to 50 differences, otherwise from the normal
    /// distribution.
    pub method: Method,
}

/// Compares paired samples by Wilcoxon's signed-rank test, two-sided. Differences of zero are
/// dropped (Wilcoxon 1945). For up to 50 differences the p-value is exact, with mid-ranks for ties
/// (Streitberg and Röhmel 1986). For more it comes from the normal distribution (Conover 1999, eq.
/// 5.7.5, with a continuity correction of ½).
///
/// # Errors
/// No pair, unequal lengths, values that are not finite, no difference other than zero.
pub fn wilcoxon(first: &[f64], second: &[f64]) -> Result<Wilcoxon, StatisticsError> {
    check_count("pairs", first.len(), 1)?;
    check_equal_length("second values of the pairs", second.len(), first.len())?;
    check_finite("first values of the pairs", first)?;
    check_finite("second values of the pairs", second)?;
    let differences = first.iter().zip(second).map(|(a, b)| a - b);
    let differences: Vec<f64> = differences.filter(|d| *d != 0.0).collect();
    if differences.is_empty() {
        return Err(StatisticsError::NoVariance { what: "pairs" });
    }
    check_finite("differences", &differences)?;
    let n = differences.len();
    let magnitudes: Vec<f64> = differences.iter().map(|d| d.abs()).collect();
    let ranks = Ranks::of(&magnitudes);
    let signed = ranks.twice.iter().zip(&differences);
    let above: usize = signed.filter(|(_, d)| **d > 0.0).map(|(r, _)| r).sum();
    let total = n * (n + 1);
    let smaller = above.min(total - above);
    let (p, method) = if n <= EXACT_TO {
        let mut ways = vec![0.0; total + 1];
        ways[0] = 1.0;
        for &rank in &ranks.twice {
            for sum in (rank..=total).rev() {
                ways[sum] += ways[sum - rank];
            }
        }
        (two_sided(&ways, smaller), Method::Exact)
    } else {
        let n = n as f64;
        let variance = n * (n + 1.0) * (2.0 * n + 1.0) / 24.0 - ranks.ties / 48.0;
        let distance = (total - 2 * smaller) as f64 / 4.0;
        (continuous_p(distance, variance), Method::Normal)
    };
    Ok(Wilcoxon {
        statistic: smaller as f64 / 2.0,
        positive: above as f64 / 2.0,
        n,
        p,
        method,
    })
}

/// Result of Mann and Whitney's U test, two-sided.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MannWhitney {
    /// Test statistic U, 0…n₁·n₂: number of pairs in which the value of the first sample is larger,
    /// with ties counted half. Divided by n₁·n₂, it is the probability of superiority.
    pub u: f64,
    /// Two-sided p-value.
    pub p: f64,
    /// How the p-value was computed: exactly for up to 50 values in both samples together,
    /// otherwise from the normal distribution.
    pub method: Method,
}

/// Compares two independent samples by Mann and Whitney's U test, two-sided (Mann and Whitney
/// 1947). For up to 50 values in both samples together, p is exact: twice the smaller tail, with
/// mid-ranks for ties (Streitberg and Röhmel 1986). For more values it comes from the normal
/// distribution (Conover 1999, eq. 5.1.5, with a continuity correction of ½).
///
/// # Errors
/// An empty sample, values that are not finite, all values equal.
pub fn mann_whitney(first: &[f64], second: &[f64]) -> Result<MannWhitney, StatisticsError> {
    check_count("first sample", first.len(), 1)?;
    check_count("second sample", second.len(), 1)?;
    let pooled = [first, second].concat();
    check_finite("samples", &pooled)?;
    if pooled.iter().all(|value| *value == pooled[0]) {
        return Err(StatisticsError::NoVariance { what: "samples" });
    }
    let ranks = Ranks::of(&pooled);
    let (n1, n2, n) = (first.len(), second.len(), pooled.len());
    let sum: usize = ranks.twice[..n1].iter().sum();
    let twice_u = sum - n1 * (n1 + 1);
    let (p, method) = if n <= EXACT_TO {
        // Counts the ways to choose this many values with this sum of doubled ranks.
        let most = n * (n + 1);
        let mut ways = vec![vec![0.0; most + 1]; n1 + 1];
        ways[0][0] = 1.0;
        for &rank in &ranks.twice {
            for chosen in (1..=n1).rev() {
                let (fewer, more) = ways.split_at_mut(chosen);
                let from = fewer[chosen - 1].iter();
                for (to, from) in more[0][rank..].iter_mut().zip(from) {
                    *to += from;
                }
            }
        }
        (two_sided(&ways[n1], sum), Method::Exact)
    } else {
        let (sizes, n) = ((n1 * n2) as f64, n as f64);
        let variance = sizes / 12.0 * (n + 1.0 - ranks.ties / (n * (n - 1.0)));
        let distance = (twice_u as f64 - sizes).abs() / 2.0;
        (continuous_p(distance, variance), Method::Normal)
    };
    Ok(MannWhitney {
        u: twice_u as f64 / 2.0,
        p,
        method,
    })
}

/// Returns the two-sided p-value of the outcome with index `at`: twice the smaller tail, at most
/// one. `ways` is the distribution, as the number of ways in which each outcome arises.
fn two_sided(ways: &[f64], at: usize) -> f64 {
    let total: f64 = ways.iter().sum();
    let below: f64 = ways[..=at].iter().sum();
    let above: f64 = ways[at..].iter().sum();
    (2.0 * below.min(above) / total).min(1.0)
}

/// Returns the two-sided p-value of a statistic that has this distance from its mean, by the normal
/// distribution with a continuity correction of half a rank.
fn continuous_p(distance: f64, variance: f64) -> f64 {
    normal_p((distance - 0.5).max(0.0) / variance.sqrt())
}

/// Ranks of values, counted from 1; equal values have the mean of their ranks.
struct Ranks {
    /// Twice the rank of each value, which is always a whole number.
    twice: Vec<usize>,
    /// Sum Σ(t³ − t) over all groups of t equal values, for corrections for ties.
    ties: f64,
}

impl Ranks {
    fn of(values: &[f64]) -> Self {
        let mut order: Vec<usize> = (0..values.len()).collect();
        order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
        let mut ranks = Self {
            twice: vec![0; values.len()],
            ties: 0.0,
        };
        let mut before = 0;
        for group in order.chunk_by(|a, b| values[*a] == values[*b]) {
            for index in group {
                ranks.twice[*index] = 2 * before + group.len() + 1;
            }
            let size = group.len() as f64;
            ranks.ties += size.powi(3) - size;
            before += group.len();
        }
        ranks
    }
}
