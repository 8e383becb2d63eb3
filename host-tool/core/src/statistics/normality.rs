//! Test of whether a sample may be normally distributed.

use super::distribution::{normal_cdf, normal_quantile};
use super::sample::{
    StatisticsError, check_count, check_finite, check_varies, largest, sum_squares,
};
use std::f64::consts::FRAC_1_SQRT_2;

/// Result of Shapiro and Wilk's test of normality.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ShapiroWilk {
    /// Statistic W, in (0, 1]. It is 1 if the sorted sample is spaced exactly as expected for a
    /// normal distribution.
    pub w: f64,
    /// p-value: probability of a W as low or lower for a normally distributed sample.
    pub p: f64,
}

/// Maximum number of values; Royston's approximations do not hold for more.
const MOST: usize = 5000;
/// Coefficients of the largest weight as a polynomial in 1/√n, from the constant term up (Royston
/// 1995).
const LARGEST: [f64; 6] = [0.0, 0.221157, -0.147981, -2.071190, 4.434685, -2.706056];
/// Coefficients of the second largest weight, in the same form.
const SECOND: [f64; 6] = [0.0, 0.042981, -0.293762, -1.752461, 5.682633, -3.582633];

/// Tests 3 to 5,000 values for normality with Shapiro and Wilk's test, using the weights and the
/// transformation of Royston 1995 (algorithm AS R94).
///
/// # Errors
/// Too few or too many values, values that are not finite or do not vary.
pub fn shapiro_wilk(sample: &[f64]) -> Result<ShapiroWilk, StatisticsError> {
    check_count("sample", sample.len(), 3)?;
    if sample.len() > MOST {
        return Err(StatisticsError::OutOfRange {
            what: "the number of values",
            range: "3 to 5000",
        });
    }
    check_finite("sample", sample)?;
    let squares = sum_squares(sample);
    check_varies("sample", squares, largest(sample), sample.len())?;
    let mut sorted = sample.to_vec();
    sorted.sort_by(f64::total_cmp);
    let weights = weights(sample.len());
    let spans = (0..weights.len()).map(|i| sorted[sorted.len() - 1 - i] - sorted[i]);
    let span: f64 = weights.iter().zip(spans).map(|(a, span)| a * span).sum();
    let w = (span * span / squares).min(1.0);
    let p = upper_tail(w, sample.len());
    Ok(ShapiroWilk { w, p })
}

/// Returns the weights of the larger half of the sorted values, that of the largest value first;
/// the smaller half has the same weights with negative sign.
fn weights(n: usize) -> Vec<f64> {
    if n == 3 {
        return vec![FRAC_1_SQRT_2];
    }
    let score = |i: usize| -normal_quantile((i as f64 + 0.625) / (n as f64 + 0.25));
    let scores: Vec<f64> = (0..n / 2).map(score).collect();
    let squares = 2.0 * scores.iter().map(|score| score * score).sum::<f64>();
    let least = 1.0 / (n as f64).sqrt();
    let own = |coefficients: &[f64; 6], score: f64| {
        polynomial(coefficients, least) + score / squares.sqrt()
    };
    let mut weights = vec![own(&LARGEST, scores[0])];
    if n > 5 {
        weights.push(own(&SECOND, scores[1]));
    }
    let apart = weights.len();
    let doubled_squares =
        |values: &[f64]| 2.0 * values.iter().map(|value| value * value).sum::<f64>();
    let scale = (squares - doubled_squares(&scores[..apart])) / (1.0 - doubled_squares(&weights));
    weights.extend(scores.iter().skip(apart).map(|score| score / scale.sqrt()));
    weights
}

/// Returns the probability of a W as low as `w` or lower for a normally distributed sample of `n`
/// values.
fn upper_tail(w: f64, n: usize) -> f64 {
    if n == 3 {
        // This p-value is exact (Shapiro and Wilk 1965).
        let tail = libm::asin(w.sqrt()) - libm::asin(0.75_f64.sqrt());
        return (6.0 / std::f64::consts::PI * tail).clamp(0.0, 1.0);
    }
    let short = libm::log(1.0 - w);
    let count = n as f64;
    let (value, mean, deviation) = if n <= 11 {
        let bound = 0.459 * count - 2.273;
        if short >= bound {
            return 0.0;
        }
        let mean = polynomial(&[0.5440, -0.39978, 0.025054, -6.714e-4], count);
        let deviation = polynomial(&[1.3822, -0.77857, 0.062767, -0.0020322], count);
        (-libm::log(bound - short), mean, libm::exp(deviation))
    } else {
        let x = libm::log(count);
        let mean = polynomial(&[-1.5861, -0.31082, -0.083751, 0.0038915], x);
        let deviation = polynomial(&[-0.4803, -0.082676, 0.0030302], x);
        (short, mean, libm::exp(deviation))
    };
    normal_cdf((mean - value) / deviation)
}

fn polynomial(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, a| sum * x + a)
}
