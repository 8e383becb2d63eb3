//! Results of a comparison: statistics and the verdict.

use super::Finding;
use std::fmt;

/// Relation of a capture to the session.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alignment {
    /// Only one alignment explains the capture.
    Unique,
    /// Several alignments explain the capture equally, because the session repeats itself. The
    /// report uses the earliest one with the highest score.
    Repeated {
        /// Distance to the nearest other alignment, microseconds.
        period_us: u64,
        /// Number of other alignments; at most 4096 are compared, the earliest first.
        others: usize,
    },
}

/// Conclusion of a comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Every edge of the capture is where the session has it, and none is missing.
    Passed,
    /// There is at least one finding.
    Failed,
    /// Nothing was found, but the sample rate is too low to judge the range of the edges.
    NotJudged,
    /// Nothing was found, but only because the capture fits the start or the end of the session;
    /// all other alignments have one missing or additional pulse. Record a longer time.
    Ambiguous,
    /// Nothing was found, but a capture covers too little of the session or cannot be aligned, or a
    /// line was not compared.
    Incomplete,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::NotJudged => "not judged",
            Self::Ambiguous => "ambiguous",
            Self::Incomplete => "incomplete",
        })
    }
}

/// Statistics of one line. Deviations are measured less predicted time, nanoseconds, after the
/// known skew and the clock of the analyser; 0 if no edge was compared.
#[derive(Clone, Debug, PartialEq)]
pub struct LineStatistics {
    /// Name of the line.
    pub name: String,
    /// Predicted edges in the compared period.
    pub expected: usize,
    /// Edges with a measured partner.
    pub compared: usize,
    /// Compared edges outside the limit.
    pub moved: usize,
    /// Predicted edges without a partner.
    pub missing: usize,
    /// Measurement edges without a partner.
    pub extra: usize,
    /// Mean of the deviations within the limit; of all, if none is within it.
    pub mean_ns: f64,
    /// Root mean square of the deviations.
    pub rms_ns: f64,
    /// Smallest deviation.
    pub min_ns: f64,
    /// Largest deviation.
    pub max_ns: f64,
}

/// Result of the comparison of one capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Nominal sample rate, hertz.
    pub samplerate_hz: u64,
    /// Uniqueness of the alignment.
    pub alignment: Alignment,
    /// Session time of sample 0, microseconds. Negative if the capture began before the session.
    pub start_us: f64,
    /// Compared period: start, session microseconds; not before the prediction.
    pub from_us: f64,
    /// Compared period: end, session microseconds.
    pub until_us: f64,
    /// Length of the compared period, microseconds.
    pub covered_us: f64,
    /// Smallest `covered_us` that is accepted.
    pub needed_us: f64,
    /// Clock error of the analyser against the board, parts per million; positive if it is fast.
    pub clock_ppm: f64,
    /// Standard uncertainty of `clock_ppm`.
    pub clock_uncertainty_ppm: f64,
    /// Limit of the range of all edges, and of the deviation of one edge, nanoseconds.
    pub limit_ns: f64,
    /// Statistics of the captured lines, in the order of the capture.
    pub lines: Vec<LineStatistics>,
    /// Number of compared edges of all lines.
    pub compared: usize,
    /// Deviation with the largest magnitude, nanoseconds.
    pub largest_ns: f64,
    /// Root mean square of all deviations, nanoseconds.
    pub rms_ns: f64,
    /// Latest less earliest deviation of the edges that are not moved, nanoseconds, under the clock
    /// that makes it smallest.
    pub range_ns: f64,
    /// Largest less smallest mean of the compared lines, nanoseconds.
    pub line_spread_ns: f64,
    /// Deviations from the prediction, by line, then by time.
    pub findings: Vec<Finding>,
    /// Conclusion.
    pub verdict: Verdict,
}
