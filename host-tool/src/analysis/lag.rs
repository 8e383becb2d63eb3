//! Delay between two signals by cross-correlation.

/// The longest lag looked for, s, unless a quarter of the record is shorter.
const LONGEST_S: f64 = 2.0;

/// How far `measured` trails `target`, s; negative if it leads. Both are
/// resampled to the mean step of `t_s` (increasing, s). For each shift the
/// correlation coefficient of the overlapping parts is computed, and the
/// largest is refined by a parabola through its neighbours. `None` for fewer
/// than 16 samples, a constant signal, or no maximum within ±2 s (or a quarter
/// of the record).
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
    let scores: Vec<f64> = (0..=2 * longest)
        .map(|shift| match shift.checked_sub(longest) {
            Some(late) => correlation(&target[..n - late], &measured[late..]),
            None => correlation(&target[longest - shift..], &measured[..n - longest + shift]),
        })
        .collect::<Option<_>>()?;
    let best = (0..scores.len()).max_by(|&a, &b| scores[a].total_cmp(&scores[b]))?;
    let (before, peak) = (*scores.get(best.checked_sub(1)?)?, scores[best]);
    let after = *scores.get(best + 1)?;
    let curvature = before - 2.0 * peak + after;
    let refined = if curvature < 0.0 {
        0.5 * (before - after) / curvature
    } else {
        0.0
    };
    Some((best as f64 - longest as f64 + refined) * step)
}

/// Linear interpolation of `values` at `first + i·step`, as many points as there are values.
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

/// Pearson's coefficient; `None` if a signal is constant.
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
    use std::f64::consts::TAU;

    /// 0.2 Hz over 20 s at 100 Hz, delayed by `delay` s.
    fn sine(t_s: &[f64], delay: f64) -> Vec<f64> {
        let angle = |t: &f64| 45.0 + 40.0 * (TAU * 0.2 * (t - delay)).sin();
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

    #[test]
    fn a_constant_signal_or_a_short_one_has_no_lag() {
        let t_s: Vec<f64> = (0..100).map(|i| f64::from(i) * 0.01).collect();
        assert_eq!(lag_s(&t_s, &sine(&t_s, 0.0), &[5.0; 100]), None);
        assert_eq!(lag_s(&t_s[..3], &[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]), None);
    }
}
