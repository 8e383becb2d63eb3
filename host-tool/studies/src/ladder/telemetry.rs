//! What is lost of a force that the host only hears of now and then.

/// Worst difference, as a part of the peak, between a force at every
/// millisecond and straight lines through every `period_ms`-th of them. The
/// worst over where the first sample falls; of the end after the last sample
/// nothing is known, and nothing is scored.
pub fn error(force: &[f64], period_ms: usize) -> f64 {
    if period_ms <= 1 {
        return 0.0;
    }
    let peak = force.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    // Four phases: with steps of a millisecond, at least every one of 1…4 ms.
    let phases = (0..4).map(|i| i * period_ms / 4);
    let mut worst = 0f64;
    for first in phases {
        let Some(rest) = force.get(first..) else {
            continue;
        };
        for start in (0..rest.len().saturating_sub(period_ms)).step_by(period_ms) {
            let (from, to) = (rest[start], rest[start + period_ms]);
            for i in 1..period_ms {
                let line = from + (to - from) * i as f64 / period_ms as f64;
                worst = worst.max((rest[start + i] - line).abs());
            }
        }
    }
    worst / peak
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_loses_nothing_and_a_peak_between_samples_is_lost() {
        let line: Vec<f64> = (0..100).map(f64::from).collect();
        assert!(error(&line, 10) < 1e-12);
        let mut peak = vec![0.0; 100];
        peak[55] = 2.0;
        assert!((error(&peak, 10) - 1.0).abs() < 1e-12);
        assert_eq!(error(&peak, 1), 0.0);
    }
}
