//! Delay between two signals by cross-correlation.

use std::ops::Range;

/// Longest lag that is searched for, s. In a record shorter than four times this lag, a quarter of
/// the record is the limit.
const LONGEST_S: f64 = 2.0;

/// Returns the delay of `measured` behind `target`, s; negative if `measured` leads. Both signals
/// are resampled at the mean step of `t_s` (increasing, s). For each shift, the correlation
/// coefficient of the overlapping parts is computed. A parabola through the largest coefficient and
/// its neighbours refines the result. Returns `None` for fewer than 16 samples, a constant signal,
/// or no maximum within ±2 s (or a quarter of the record).
pub fn lag_s(t_s: &[f64], target: &[f64], measured: &[f64]) -> Option<f64> {
    let (first, last) = (*t_s.first()?, *t_s.last()?);
    let n = t_s.len();
    if n < 16 || last <= first {
        return None;
    }
    let step = (last - first) / (n - 1) as f64;
    let target = resample(t_s, target, first, step);
    let measured = resample(t_s, measured, first, step);
    let longest = ((LONGEST_S / step) as usize).min(n / 4);
    let pair = Pair::new(&target, &measured, longest);
    let best = pair.best_shift()?;
    let (before, peak) = (pair.score(best.checked_sub(1)?)?, pair.score(best)?);
    let after = pair.score(Some(best + 1).filter(|after| *after <= 2 * longest)?)?;
    let curvature = before - 2.0 * peak + after;
    let refined = if curvature < 0.0 {
        0.5 * (before - after) / curvature
    } else {
        0.0
    };
    Some((best as f64 - longest as f64 + refined) * step)
}

/// Interpolates `values` linearly at `first + i·step`, and returns as many values as were given.
fn resample(t_s: &[f64], values: &[f64], first: f64, step: f64) -> Vec<f64> {
    let mut right = 1;
    (0..t_s.len())
        .map(|i| {
            let t = first + i as f64 * step;
            while right + 1 < t_s.len() && t_s[right] < t {
                right += 1;
            }
            let (t0, t1) = (t_s[right - 1], t_s[right]);
            let share = if t1 > t0 {
                ((t - t0) / (t1 - t0)).clamp(0.0, 1.0)
            } else {
                1.0
            };
            values[right - 1] + share * (values[right] - values[right - 1])
        })
        .collect()
}

/// Target and measured signal, which are compared at different shifts against each other.
struct Pair<'a> {
    signals: [&'a [f64]; 2],
    /// Largest shift in either direction, samples. Shifts are numbered from 0, and number `longest`
    /// means that the signals are not shifted.
    longest: usize,
    /// Both signals minus their means.
    centred: [Vec<f64>; 2],
    /// For each signal, the sums of its first n centred values and of their squares, for every n
    /// from 0.
    sums: [Vec<(f64, f64)>; 2],
}

/// Largest difference between a score that is computed from running sums and the exact score.
/// Rounding changes a sum of n products by n·2⁻⁵³ of the sum of their magnitudes. For centred
/// signals, that sum is at most 1/[`LEAST_SHARE`] times the number by which the score is divided.
/// For up to a million samples, the difference is therefore below 1e-6.
const MARGIN: f64 = 1e-6;

/// Smallest share of a signal's variation that must lie within the overlap, so that its score can
/// be computed from running sums.
const LEAST_SHARE: f64 = 1e-3;

impl<'a> Pair<'a> {
    fn new(target: &'a [f64], measured: &'a [f64], longest: usize) -> Self {
        let signals = [target, measured];
        let centred = signals.map(|signal| {
            let mean = signal.iter().sum::<f64>() / signal.len() as f64;
            signal.iter().map(|value| value - mean).collect::<Vec<_>>()
        });
        let sums = [0, 1].map(|which: usize| {
            let mut sum = (0.0, 0.0);
            let add = |value: &f64| {
                sum = (sum.0 + value, sum.1 + value * value);
                sum
            };
            std::iter::once((0.0, 0.0))
                .chain(centred[which].iter().map(add))
                .collect()
        });
        Self {
            signals,
            longest,
            centred,
            sums,
        }
    }

    /// Returns the ranges of samples of the target and of the measured signal that overlap at
    /// `shift`.
    fn overlap(&self, shift: usize) -> [Range<usize>; 2] {
        let n = self.signals[0].len();
        match shift.checked_sub(self.longest) {
            Some(late) => [0..n - late, late..n],
            None => {
                let early = self.longest - shift;
                [early..n, 0..n - early]
            }
        }
    }

    /// Returns Pearson's correlation coefficient of the overlap at `shift`; `None` if a signal is
    /// constant within the overlap.
    fn score(&self, shift: usize) -> Option<f64> {
        let [target, measured] = self.overlap(shift);
        correlation(&self.signals[0][target], &self.signals[1][measured])
    }

    /// Estimates Pearson's correlation coefficient at `shift` from running sums, with an error of
    /// at most [`MARGIN`]; `None` where the sums are not exact enough.
    fn estimate(&self, shift: usize) -> Option<f64> {
        let overlap = self.overlap(shift);
        let n = overlap[0].len() as f64;
        let [a, b] = [0, 1].map(|which: usize| {
            let (sums, range) = (&self.sums[which], &overlap[which]);
            let (from, to, total) = (sums[range.start], sums[range.end], sums[sums.len() - 1].1);
            let (sum, squares) = (to.0 - from.0, to.1 - from.1);
            let varies = squares - sum * sum / n;
            (varies > LEAST_SHARE * total).then_some((sum, varies))
        });
        let ((sum_a, varies_a), (sum_b, varies_b)) = (a?, b?);
        let [target, measured] = overlap;
        let product = dot(&self.centred[0][target], &self.centred[1][measured]);
        Some((product - sum_a * sum_b / n) / (varies_a * varies_b).sqrt())
    }

    /// Returns the shift with the largest score; of several equal scores, the last. `None` if a
    /// signal is constant within the overlap of any shift. The result is exact: an exact score is
    /// computed unless its estimate is clearly below the largest.
    fn best_shift(&self) -> Option<usize> {
        let shifts = 0..=2 * self.longest;
        let estimates: Vec<f64> = shifts
            .map(|shift| self.estimate(shift).or_else(|| self.score(shift)))
            .collect::<Option<_>>()?;
        let largest = estimates.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let near = (0..)
            .zip(&estimates)
            .filter(|(_, estimate)| **estimate > largest - 2.0 * MARGIN);
        let scores: Vec<(usize, f64)> = near
            .map(|(shift, _)| Some((shift, self.score(shift)?)))
            .collect::<Option<_>>()?;
        let best = scores.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(best.0)
    }
}

/// Returns the sum of products a·b. It adds up eight partial sums side by side, so that a processor
/// can use vector instructions.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest = a.remainder().iter().zip(b.remainder());
    let rest: f64 = rest.map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Returns Pearson's correlation coefficient; `None` if a signal is constant.
fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let n = a.len() as f64;
    let (mean_a, mean_b) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - mean_a, b - mean_b);
        ab += a * b;
        aa += a * a;
        bb += b * b;
    }
    (aa > 0.0 && bb > 0.0).then(|| ab / (aa * bb).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::random::Random;
    use std::f64::consts::TAU;

    /// Creates a sine of 0.2 Hz over 20 s at 100 Hz, delayed by `delay` s.
    fn sine(t_s: &[f64], delay: f64) -> Vec<f64> {
        let angle = |t: &f64| 45.0 + 40.0 * libm::sin(TAU * 0.2 * (t - delay));
        t_s.iter().map(angle).collect()
    }

    #[test]
    fn finds_a_known_delay_and_a_known_lead() {
        let t_s: Vec<f64> = (0..2000).map(|i| f64::from(i) * 0.01).collect();
        for delay in [0.123, 0.0, -0.4, 1.0] {
            let found = lag_s(&t_s, &sine(&t_s, 0.0), &sine(&t_s, delay)).unwrap();
            assert!((found - delay).abs() < 1e-3, "{delay}: {found}");
        }
    }

    #[test]
    fn uneven_samples_do_not_shift_the_answer() {
        let t_s: Vec<f64> = (0..2000)
            .map(|i| (f64::from(i) + 0.4 * f64::from(i % 3)) * 0.01)
            .collect();
        let found = lag_s(&t_s, &sine(&t_s, 0.0), &sine(&t_s, 0.2)).unwrap();
        assert!((found - 0.2).abs() < 2e-3, "{found}");
    }

    /// Checks that sums find the same shift as exact scores alone, over signals that rest, jump,
    /// repeat themselves and are constant in parts.
    #[test]
    fn sums_leave_no_larger_score_out() {
        let mut random = Random::new(5);
        for round in 0..300 {
            let n = 16 + random.below(120) as usize;
            let mut signal = || {
                let (wave, quiet) = (random.below(4), random.below(2 * n as u64) as usize);
                let value = |i: usize| match wave {
                    0 => random.unit(),
                    1 => f64::from(u8::from(i > n / 2)),
                    2 => (i % 7) as f64 * 1e3,
                    _ => libm::sin(i as f64 * 0.2) + 1e-9 * random.unit(),
                };
                let values = (0..n).map(value).collect::<Vec<f64>>();
                let hold = |i: usize| values[i.min(quiet)];
                (0..n).map(hold).collect::<Vec<f64>>()
            };
            let (target, measured) = (signal(), signal());
            let pair = Pair::new(&target, &measured, n / 4);
            let exact: Option<Vec<f64>> = (0..=n / 4 * 2).map(|shift| pair.score(shift)).collect();
            let best = exact.and_then(|scores| {
                (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]))
            });
            assert_eq!(pair.best_shift(), best, "round {round}");
        }
    }

    #[test]
    fn a_constant_signal_or_a_short_one_has_no_lag() {
        let t_s: Vec<f64> = (0..100).map(|i| f64::from(i) * 0.01).collect();
        assert_eq!(lag_s(&t_s, &sine(&t_s, 0.0), &[5.0; 100]), None);
        assert_eq!(lag_s(&t_s[..3], &[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]), None);
    }
}
