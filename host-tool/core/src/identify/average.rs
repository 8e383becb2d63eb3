//! The experimenter's filter: a moving average over 40 ms (Lee 2020, §2.3.2), whose gain is -3 dB
//! at 11.1 Hz. No other module implements it.

/// Length of the moving average's window: 40 samples of 1 ms.
pub const WINDOW: usize = 40;

/// Returns the mean of every [`WINDOW`] consecutive samples: `result[i]` is the mean of
/// `samples[i..i + WINDOW]`, so the result is 39 shorter. The result is empty for fewer samples
/// than one window.
#[must_use]
pub fn moving_average(samples: &[f64]) -> Vec<f64> {
    let part = 1.0 / WINDOW as f64;
    let mut sums = Vec::with_capacity(samples.len() + 1);
    let mut sum = 0.0;
    sums.push(sum);
    for sample in samples {
        sum += sample;
        sums.push(sum);
    }
    let later = sums.iter().skip(WINDOW);
    later
        .zip(&sums)
        .map(|(to, from)| part * (to - from))
        .collect()
}

/// Applies the transpose of the matrix that [`moving_average`] multiplies by. Converts the averages
/// of a record to a vector with one number for each of its `samples` samples.
pub(super) fn moving_average_transpose(averages: &[f64], samples: usize) -> Vec<f64> {
    let nothing = vec![0.0; WINDOW - 1];
    let padded: Vec<f64> = nothing
        .iter()
        .chain(averages)
        .chain(&nothing)
        .copied()
        .collect();
    let mut spread = moving_average(&padded);
    spread.resize(samples, 0.0);
    spread
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_becomes_a_ramp_of_forty_milliseconds() {
        let step: Vec<f64> = (0..200).map(|i| if i < 100 { 0.0 } else { 1.0 }).collect();
        let ramp = moving_average(&step);
        assert_eq!(ramp.len(), 161);
        assert_eq!((ramp[60], ramp[100]), (0.0, 1.0));
        assert!((ramp[80] - 0.5).abs() < 1e-12);
        assert!(moving_average(&step[..39]).is_empty());
    }

    /// Checks ⟨W a, b⟩ = ⟨a, Wᵀ b⟩.
    #[test]
    fn spreading_is_the_transpose() {
        let a: Vec<f64> = (0..120).map(|i| f64::from(i * i % 17)).collect();
        let b: Vec<f64> = (0..81).map(|i| f64::from(i * 7 % 13)).collect();
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (first, other) = (
            product(&moving_average(&a), &b),
            product(&a, &moving_average_transpose(&b, 120)),
        );
        assert!((first - other).abs() < 1e-9 * first.abs());
    }
}
