//! Clock of the analyser: a straight line through pairs of expected and measured times.

/// Relation between session time and analyser time:
/// `measured = measured_0 + (1 + drift) × (expected − expected_0)`, all in nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clock {
    pub expected_0: f64,
    pub measured_0: f64,
    /// Relative clock error: positive if the analyser counts too fast.
    pub drift: f64,
}

impl Clock {
    /// Converts an analyser time to session time, nanoseconds.
    pub fn to_expected(self, measured: f64) -> f64 {
        self.expected_0 + (measured - self.measured_0) / (1.0 + self.drift)
    }

    /// Converts a session time to analyser time, nanoseconds.
    pub fn to_measured(self, expected: f64) -> f64 {
        self.measured_0 + (expected - self.expected_0) * (1.0 + self.drift)
    }
}

/// Result of a robust fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct ClockFit {
    pub clock: Clock,
    /// Standard uncertainty of the drift.
    pub drift_uncertainty: f64,
}

/// Tuning constant of Tukey's biweight for 95 % efficiency with normal errors (Holland and Welsch,
/// Communications in Statistics A6 (1977) 813).
const BIWEIGHT: f64 = 4.685;

/// Smallest scale of the residuals, nanoseconds: prevents division by zero if all residuals are
/// equal. Half a sample at 100 MS/s.
const MIN_SCALE_NS: f64 = 5.0;

/// Fits a clock to pairs of expected and measured times by least squares with Tukey's biweight,
/// starting from the median residual. Returns `None` for less than two different expected times.
pub(super) fn fit_clock(pairs: &[(f64, f64)], start: Clock) -> Option<ClockFit> {
    let count = pairs.len() as f64;
    if pairs.len() < 2 {
        return None;
    }
    let center = pairs.iter().map(|pair| pair.0).sum::<f64>() / count;
    // y is the lateness against an ideal clock, x the time from the centre.
    let origin = start.measured_0 - start.expected_0;
    let points: Vec<(f64, f64)> = pairs
        .iter()
        .map(|&(expected, measured)| (expected - center, measured - expected - origin))
        .collect();
    let mut slope = start.drift;
    let mut residuals: Vec<f64> = points.iter().map(|&(x, y)| y - slope * x).collect();
    let mut intercept = median(&mut residuals)?;
    let mut uncertainty = 0.0;
    for _ in 0..12 {
        residuals.clear();
        residuals.extend(
            points
                .iter()
                .map(|&(x, y)| (y - intercept - slope * x).abs()),
        );
        // 1.4826 × the median absolute deviation is the standard deviation of normal errors.
        let scale = (1.4826 * median(&mut residuals)?).max(MIN_SCALE_NS);
        let sums = weighted_sums(&points, slope, intercept, BIWEIGHT * scale);
        let [w, x, y, xx, xy] = sums;
        let variance = xx - x * x / w;
        if w < 1e-9 || variance <= 0.0 {
            return None;
        }
        slope = (xy - x * y / w) / variance;
        intercept = (y - slope * x) / w;
        let square = weighted_square(&points, slope, intercept, BIWEIGHT * scale);
        let deviation = (square / (w - 2.0).max(1.0)).sqrt().max(scale);
        uncertainty = deviation / variance.sqrt();
    }
    let clock = Clock {
        expected_0: center,
        measured_0: center + origin + intercept,
        drift: slope,
    };
    clock.drift.is_finite().then_some(ClockFit {
        clock,
        drift_uncertainty: uncertainty,
    })
}

/// Returns the weight of a residual, with the residual in units of the cut.
fn biweight(u: f64) -> f64 {
    if u.abs() < 1.0 {
        (1.0 - u * u).powi(2)
    } else {
        0.0
    }
}

/// Returns the weighted sum of the squared residuals.
fn weighted_square(points: &[(f64, f64)], slope: f64, intercept: f64, cut: f64) -> f64 {
    let residuals = points.iter().map(|(x, y)| y - intercept - slope * x);
    residuals.map(|r| biweight(r / cut) * r * r).sum()
}

fn weighted_sums(points: &[(f64, f64)], slope: f64, intercept: f64, cut: f64) -> [f64; 5] {
    let mut sums = [0.0; 5];
    for &(x, y) in points {
        let weight = biweight((y - intercept - slope * x) / cut);
        let terms = [1.0, x, y, x * x, x * y];
        for (sum, term) in sums.iter_mut().zip(terms) {
            *sum += weight * term;
        }
    }
    sums
}

/// Returns the median: the upper of the two middle values if their number is even.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Returns the value at which half of the weight is reached.
pub(super) fn weighted_median(values: &mut [(f64, f64)]) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|value| value.1).sum();
    let mut sum = 0.0;
    for &(value, weight) in values.iter() {
        sum += weight;
        if sum >= total / 2.0 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drift_survives_a_third_of_outliers() {
        let start = Clock {
            expected_0: 0.0,
            measured_0: 5e6,
            drift: 0.0,
        };
        let pairs: Vec<(f64, f64)> = (0..300)
            .map(|n| {
                let expected = f64::from(n) * 1e6;
                let noise = f64::from(n * 7919 % 41) - 20.0;
                let outlier = if n % 3 == 0 { 1_000.0 } else { 0.0 };
                (expected, 5e6 + expected * 1.000_3 + noise + outlier)
            })
            .collect();
        let fit = fit_clock(
            &pairs,
            Clock {
                drift: 3e-4,
                ..start
            },
        );
        let Some(fit) = fit else {
            panic!("300 pairs determine a clock");
        };
        assert!((fit.clock.drift - 3e-4).abs() < 3e-8, "{fit:?}");
        assert!(fit.clock.to_expected(5e6).abs() < 20.0, "{fit:?}");
        assert!(fit_clock(&[(1.0, 1.0)], start).is_none());
        assert!(fit_clock(&[(1.0, 1.0), (1.0, 2.0)], start).is_none());
    }
}
