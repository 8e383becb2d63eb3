//! Judgement of a line that toggles at all times, such as the pump. Its phase in the session is
//! unknown, so it has no part in the alignment.

use super::finding::Finding;
use super::report::{LineStatistics, Report};
use crate::line::{MeasuredLine, TogglingLine};

/// Period of a capture and clock under which its lines are judged.
pub(super) struct Scale {
    /// Nanoseconds of the board's time per sample.
    sample_ns: f64,
    /// Length of the capture, nanoseconds.
    length_ns: f64,
    /// Largest deviation of one interval, nanoseconds.
    limit_ns: f64,
    /// Largest range of all edges: the limit, and three standard uncertainties of the clock.
    range_ns: f64,
}

impl Scale {
    /// Returns the scale of a capture with `samples` samples, of which other lines were judged.
    pub fn new(report: &Report, samples: u64) -> Self {
        let sample_ns = 1e9 / report.samplerate_hz as f64 / (1.0 + report.clock_ppm * 1e-6);
        let length_ns = samples.saturating_sub(1) as f64 * sample_ns;
        let uncertainty_ns = 3.0 * report.clock_uncertainty_ppm * 1e-6 * length_ns;
        Self {
            sample_ns,
            length_ns,
            limit_ns: report.limit_ns,
            range_ns: report.limit_ns + uncertainty_ns,
        }
    }
}

/// Judges a line: it must have an edge every half period, from the start of the capture to its end.
pub(super) fn judge(
    measured: &MeasuredLine,
    line: &TogglingLine,
    scale: &Scale,
) -> (LineStatistics, Option<Finding>) {
    let half_ns = line.half_period_us * 1e3;
    let times: Vec<f64> = measured
        .edges
        .iter()
        .map(|sample| *sample as f64 * scale.sample_ns)
        .collect();
    let deviations: Vec<f64> = (0_u32..)
        .zip(&times)
        .map(|(n, t)| t - times.first().unwrap_or(t) - f64::from(n) * half_ns)
        .collect();
    let min_ns = deviations.iter().copied().fold(0.0, f64::min);
    let max_ns = deviations.iter().copied().fold(0.0, f64::max);
    let finding = interruption(&times, half_ns, scale).map_or_else(
        || {
            (max_ns - min_ns > scale.range_ns).then(|| Finding::Unsteady {
                line: line.name.clone(),
                half_period_us: line.half_period_us,
                range_ns: max_ns - min_ns,
                limit_ns: scale.range_ns,
            })
        },
        |(from_ns, interval_ns)| {
            Some(Finding::Uneven {
                line: line.name.clone(),
                half_period_us: line.half_period_us,
                at_us: from_ns / 1e3,
                interval_us: interval_ns / 1e3,
            })
        },
    );
    let statistics = LineStatistics {
        name: line.name.clone(),
        expected: (scale.length_ns / half_ns) as usize,
        compared: times.len(),
        moved: 0,
        missing: 0,
        extra: 0,
        mean_ns: 0.0,
        rms_ns: 0.0,
        min_ns,
        max_ns,
    };
    (statistics, finding)
}

/// Returns start and length of the first interval that is not half a period, nanoseconds. The
/// capture may begin and end within one.
fn interruption(times: &[f64], half_ns: f64, scale: &Scale) -> Option<(f64, f64)> {
    let mut last = None;
    for &time in times {
        let interval = time - last.unwrap_or(0.0);
        let is_short = last.is_some() && interval < half_ns - scale.limit_ns;
        if is_short || interval > half_ns + scale.limit_ns {
            return Some((last.unwrap_or(0.0), interval));
        }
        last = Some(time);
    }
    let last = last.unwrap_or(0.0);
    let rest = scale.length_ns - last;
    (rest > half_ns + scale.limit_ns).then_some((last, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge_edges(edges: Vec<u64>) -> Option<Finding> {
        let scale = Scale {
            sample_ns: 10.0,
            length_ns: 1e6,
            limit_ns: 149.0,
            range_ns: 150.0,
        };
        let measured = MeasuredLine {
            name: "pump".into(),
            first_high: false,
            edges,
        };
        let line = TogglingLine {
            name: "pump".into(),
            half_period_us: 25.0,
        };
        judge(&measured, &line, &scale).1
    }

    #[test]
    fn a_toggling_line_has_no_interruption_and_no_other_period() {
        let even: Vec<u64> = (0..40).map(|n| 1_234 + n * 2_500).collect();
        assert_eq!(judge_edges(even.clone()), None);
        let uneven = |edges| matches!(judge_edges(edges), Some(Finding::Uneven { .. }));
        assert!(uneven(Vec::new()), "a dead line");
        assert!(uneven(even[..30].to_vec()), "it stops");
        assert!(uneven(even[3..].to_vec()), "it starts late");
        let mut lacking = even.clone();
        lacking.drain(10..12);
        assert!(uneven(lacking));
        let mut short = even.clone();
        short[20] += 20;
        assert!(uneven(short));
        // Every interval is 10 ns too long: within the limit of one, but another period.
        let slow: Vec<u64> = (0..40).map(|n| 1_234 + n * 2_501).collect();
        let slow = judge_edges(slow);
        assert!(matches!(slow, Some(Finding::Unsteady { .. })), "{slow:?}");
    }
}
