//! Confidence intervals: of a share, and of any statistic by resampling.

use super::descriptive::quantile_of_sorted;
use super::distribution::{normal_cdf, normal_quantile};
use super::sample::{StatisticsError, check_count, check_finite, check_varies, largest, mean};
use hal_sim::random::Random;

/// Value of a statistic with its confidence interval.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Interval {
    /// Value of the statistic for the sample itself.
    pub value: f64,
    /// Lower end of the confidence interval.
    pub low: f64,
    /// Upper end of the confidence interval.
    pub high: f64,
}

/// Share of successful trials with Wilson's confidence interval.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Share {
    /// Number of successes divided by the number of trials.
    pub share: f64,
    /// Lower end of the confidence interval, in [0, share].
    pub low: f64,
    /// Upper end of the confidence interval, in [share, 1].
    pub high: f64,
}

/// Returns the share of `successes` among `trials` with Wilson's score interval (Wilson 1927).
/// Brown, Cai and DasGupta (2001, eq. 4) recommend it for any share and number of trials. `level`
/// is the confidence level, such as 0.95. `successes` may be fractional: a trial that succeeded in
/// one of two cases adds ½.
///
/// # Errors
/// No trial, successes below 0 or more than trials, a level outside (0, 1).
pub fn wilson_share(successes: f64, trials: u64, level: f64) -> Result<Share, StatisticsError> {
    check_count("trials", usize::try_from(trials).unwrap_or(usize::MAX), 1)?;
    if !(0.0..=trials as f64).contains(&successes) {
        return Err(StatisticsError::OutOfRange {
            what: "the number of successes",
            range: "0 to the number of trials",
        });
    }
    let z = two_sided_quantile(level)?;
    let (n, share) = (trials as f64, successes / trials as f64);
    let part = z * z / n;
    let centre = (share + part / 2.0) / (1.0 + part);
    let half = (share * (1.0 - share) * part + part * part / 4.0).sqrt() / (1.0 + part);
    Ok(Share {
        share,
        low: (centre - half).clamp(0.0, share),
        high: (centre + half).clamp(share, 1.0),
    })
}

/// Returns the one-sided upper confidence bound of a share (Clopper and Pearson 1934). It is the
/// largest share at which `successes` or fewer among `trials` still have the probability 1 −
/// `level`. Without any success the bound is 1 − (1 − `level`)^(1/n), which is about 3/n at 0.95.
///
/// # Errors
/// No trial, more successes than trials, a level outside (0, 1).
pub fn share_upper_bound(successes: u64, trials: u64, level: f64) -> Result<f64, StatisticsError> {
    check_count("trials", usize::try_from(trials).unwrap_or(usize::MAX), 1)?;
    two_sided_quantile(level)?;
    if successes > trials {
        return Err(StatisticsError::OutOfRange {
            what: "the number of successes",
            range: "0 to the number of trials",
        });
    }
    if successes == trials {
        return Ok(1.0);
    }
    let (mut low, mut high) = (successes as f64 / trials as f64, 1.0);
    // Each step halves the interval, down to the last bit.
    for _ in 0..64 {
        let share = 0.5 * (low + high);
        if binomial_cdf(successes, trials, share) > 1.0 - level {
            low = share;
        } else {
            high = share;
        }
    }
    Ok(high)
}

/// Returns the binomial probability of at most `successes` successes in `trials` trials that each
/// succeed with the probability `share`, in (0, 1).
fn binomial_cdf(successes: u64, trials: u64, share: f64) -> f64 {
    let odds = libm::log(share) - libm::log1p(-share);
    let mut term = trials as f64 * libm::log1p(-share);
    let mut sum = libm::exp(term);
    for k in 0..successes {
        term += odds + libm::log((trials - k) as f64 / (k + 1) as f64);
        sum += libm::exp(term);
    }
    sum
}

/// Returns the z for which a standard normal value lies in ±z with the probability `level`.
fn two_sided_quantile(level: f64) -> Result<f64, StatisticsError> {
    if level > 0.0 && level < 1.0 {
        return Ok(-normal_quantile((1.0 - level) / 2.0));
    }
    Err(StatisticsError::OutOfRange {
        what: "the confidence level",
        range: "(0, 1)",
    })
}

/// Returns the bias-corrected and accelerated bootstrap interval of `statistic` (Efron and
/// Tibshirani 1993, eq. 14.9, 14.10, 14.14 and 14.15). It draws `resamples` samples with
/// replacement; the random numbers depend on `seed` only, so the same arguments give the same
/// result. An element of the sample may be a pair. Resamples whose statistic equals that of the
/// sample count half. Quantiles are interpolated linearly between neighbours. Use at least 2,000
/// resamples for a level of 95 %.
///
/// # Errors
/// Fewer than two elements or 100 resamples, a level outside (0, 1), a statistic that is not
/// finite, that does not vary, or that lies beyond all resamples.
pub fn bootstrap_bca<T: Clone>(
    sample: &[T],
    statistic: impl Fn(&[T]) -> f64,
    resamples: usize,
    level: f64,
    seed: u64,
) -> Result<Interval, StatisticsError> {
    check_count("sample", sample.len(), 2)?;
    check_count("resamples", resamples, 100)?;
    let z = two_sided_quantile(level)?;
    let value = statistic(sample);
    check_finite("statistic", [&value])?;
    let mut random = Random::new(seed);
    let mut draw = |_| {
        let pick = |_| sample[random.below(sample.len() as u64) as usize].clone();
        let drawn: Vec<T> = (0..sample.len()).map(pick).collect();
        statistic(&drawn)
    };
    let mut drawn: Vec<f64> = (0..resamples).map(&mut draw).collect();
    check_finite("statistic of a resample", &drawn)?;
    drawn.sort_by(f64::total_cmp);
    let below = drawn.partition_point(|drawn| *drawn < value);
    let not_above = drawn.partition_point(|drawn| *drawn <= value);
    if not_above == 0 || below == resamples {
        return Err(StatisticsError::OutOfRange {
            what: "statistic",
            range: "the range of its resamples",
        });
    }
    let bias = normal_quantile((below + not_above) as f64 / (2 * resamples) as f64);
    let acceleration = acceleration(sample, statistic)?;
    let end = |z: f64| {
        let moved = bias + z;
        let part = normal_cdf(bias + moved / (1.0 - acceleration * moved));
        quantile_of_sorted(&drawn, part)
    };
    Ok(Interval {
        value,
        low: end(-z),
        high: end(z),
    })
}

/// Returns the acceleration: how fast the standard error changes with the statistic. It is computed
/// from samples that lack one element each (jackknife).
fn acceleration<T: Clone>(
    sample: &[T],
    statistic: impl Fn(&[T]) -> f64,
) -> Result<f64, StatisticsError> {
    let without = |left: usize| {
        let (before, after) = (&sample[..left], &sample[left + 1..]);
        statistic(&[before, after].concat())
    };
    let values: Vec<f64> = (0..sample.len()).map(without).collect();
    check_finite("statistic of a jackknife sample", &values)?;
    let middle = mean(&values);
    let power = |n: i32| values.iter().map(|v| (middle - v).powi(n)).sum::<f64>();
    let squares = power(2);
    check_varies(
        "statistics of the jackknife samples",
        squares,
        largest(&values),
        values.len(),
    )?;
    Ok(power(3) / (6.0 * libm::pow(squares, 1.5)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks sums of exact binomials, bisected in Python 3, and values by hand for no and for all
    /// successes.
    #[test]
    fn bounds_are_clopper_and_pearsons() {
        for (k, n, bound) in [
            (0, 2_000, 1.0 - libm::pow(0.05_f64, 1.0 / 2_000.0)),
            (0, 1, 0.95),
            (1, 10, 0.394_163_3),
            (5, 100, 0.102_253_4),
            (10, 10, 1.0),
        ] {
            let ours = share_upper_bound(k, n, 0.95).unwrap();
            assert!((ours - bound).abs() < 1e-6, "{k} of {n}: {ours}");
        }
        assert!(share_upper_bound(2, 1, 0.95).is_err());
        assert!(share_upper_bound(0, 0, 0.95).is_err());
    }
}
