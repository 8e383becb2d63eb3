//! Findings of a comparison, in numbers and in words.

use crate::line::Edge;
use std::fmt;

/// Deviation of a captured line from its prediction. Times are session times; if the alignment is
/// [`super::Alignment::Repeated`], they are valid modulo its period.
#[derive(Clone, Debug, PartialEq)]
pub enum Finding {
    /// The range of all edges exceeds the limit, and the edge deviates by more than the limit from
    /// the clock that fits most edges.
    EdgeMoved {
        /// Name of the line.
        line: String,
        /// Predicted time, microseconds.
        time_us: u64,
        /// Direction.
        edge: Edge,
        /// Measurement less predicted time, nanoseconds.
        deviation_ns: f64,
    },
    /// One predicted edge was not measured.
    EdgeMissing {
        /// Name of the line.
        line: String,
        /// Predicted time, microseconds.
        time_us: u64,
        /// Direction.
        edge: Edge,
    },
    /// One measured edge was not predicted.
    EdgeExtra {
        /// Name of the line.
        line: String,
        /// Measurement time, microseconds.
        time_us: f64,
        /// Direction.
        edge: Edge,
    },
    /// Two consecutive predicted edges were not measured: a missing pulse, or a missing pause
    /// between two pulses. A line that misses one edge also misses the next one, because its
    /// level is then already that after the next edge.
    PulseMissing {
        /// Name of the line.
        line: String,
        /// Level of the missing pulse: high for a pulse, low for a pause.
        high: bool,
        /// Predicted start, microseconds.
        from_us: u64,
        /// Predicted end, microseconds.
        until_us: u64,
    },
    /// Two consecutive measured edges were not predicted, for example a glitch.
    PulseExtra {
        /// Name of the line.
        line: String,
        /// Level of the additional pulse: high for a pulse, low for a pause.
        high: bool,
        /// Measurement start, microseconds.
        from_us: f64,
        /// Measurement end, microseconds.
        until_us: f64,
    },
    /// At least 90 % of the edges of a line deviate by more than the limit, all in one direction.
    LineShifted {
        /// Name of the line.
        line: String,
        /// Mean of measured less predicted time of these edges, nanoseconds.
        mean_ns: f64,
        /// Number of edges.
        edges: usize,
    },
    /// Two probes are exchanged: each carries the pattern of the other.
    LinesSwapped {
        /// Name of the first line.
        first: String,
        /// Name of the second line.
        second: String,
    },
    /// The probe of a line carries the pattern of another line.
    LineCarriesOther {
        /// Name of the line that the probe should carry.
        line: String,
        /// Name of the line that it carries.
        carries: String,
    },
    /// Levels of a line are inverted.
    LineInverted {
        /// Name of the line.
        line: String,
    },
    /// A line has no edge in the capture although edges are predicted.
    LineNeverMoves {
        /// Name of the line.
        line: String,
        /// Measurement level.
        high: bool,
        /// Number of predicted edges.
        expected: usize,
    },
    /// A line has neither measured nor predicted edges, but the wrong level.
    WrongLevel {
        /// Name of the line.
        line: String,
        /// Measurement level.
        high: bool,
    },
    /// A line does not follow its pattern, and no other finding explains it.
    LineDiffers {
        /// Name of the line.
        line: String,
        /// Number of predicted edges.
        expected: usize,
        /// Number of measured edges.
        measured: usize,
        /// Number of measured edges that fit a predicted one.
        matched: usize,
    },
    /// Deviations of edges that are not moved have a range above the limit, whatever straight
    /// clock the analyser has.
    TooWide {
        /// Smallest range over all clocks, nanoseconds.
        range_ns: f64,
        /// Largest allowed range, nanoseconds.
        limit_ns: f64,
        /// Line and predicted time in microseconds of the earliest edge.
        earliest: (String, u64),
        /// Line and predicted time in microseconds of the latest edge.
        latest: (String, u64),
    },
    /// A line that must toggle at all times has an interval of another length.
    Uneven {
        /// Name of the line.
        line: String,
        /// Length of an interval, microseconds.
        half_period_us: f64,
        /// Start of the first wrong interval after the start of the capture, microseconds.
        at_us: f64,
        /// Its length, microseconds.
        interval_us: f64,
    },
    /// The intervals of a line that must toggle at all times are right, but their sum is not.
    Unsteady {
        /// Name of the line.
        line: String,
        /// Length of an interval, microseconds.
        half_period_us: f64,
        /// Range of the edges against equal intervals, nanoseconds.
        range_ns: f64,
        /// Largest allowed range, nanoseconds.
        limit_ns: f64,
    },
    /// Part of a capture lies outside the prediction: edges before it, or any time after it.
    Outside {
        /// Side of the prediction.
        side: Side,
        /// Length of the part, microseconds.
        length_us: f64,
        /// Number of edges in it.
        edges: usize,
    },
    /// The clock of the analyser is outside the accepted range by more than three standard
    /// uncertainties.
    ClockError {
        /// Estimated error, parts per million.
        ppm: f64,
        /// Accepted error, parts per million.
        limit_ppm: f64,
    },
}

/// Side of the prediction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Before its start.
    Before,
    /// After its end.
    After,
}

impl Finding {
    /// Returns the stable number of the finding, 1 to 17.
    pub const fn number(&self) -> u8 {
        match self {
            Self::EdgeMoved { .. } => 1,
            Self::EdgeMissing { .. } => 2,
            Self::EdgeExtra { .. } => 3,
            Self::PulseMissing { .. } => 4,
            Self::PulseExtra { .. } => 5,
            Self::LineShifted { .. } => 6,
            Self::LinesSwapped { .. } => 7,
            Self::LineCarriesOther { .. } => 8,
            Self::LineInverted { .. } => 9,
            Self::LineNeverMoves { .. } => 10,
            Self::WrongLevel { .. } => 11,
            Self::LineDiffers { .. } => 12,
            Self::ClockError { .. } => 13,
            Self::TooWide { .. } => 14,
            Self::Outside { .. } => 15,
            Self::Uneven { .. } => 16,
            Self::Unsteady { .. } => 17,
        }
    }

    /// Returns whether the finding concerns the pattern of a whole line.
    pub const fn is_about_line(&self) -> bool {
        matches!(self.number(), 7..=12 | 16)
    }
}

const fn level(high: bool) -> &'static str {
    if high { "high" } else { "low" }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::EdgeMoved {
                line,
                time_us,
                edge,
                deviation_ns,
            } => write!(
                f,
                "{line}: the {edge} edge at {time_us} µs deviates by {deviation_ns:+.0} ns"
            ),
            Self::EdgeMissing {
                line,
                time_us,
                edge,
            } => write!(f, "{line}: the {edge} edge at {time_us} µs is missing"),
            Self::EdgeExtra {
                line,
                time_us,
                edge,
            } => write!(f, "{line}: an additional {edge} edge at {time_us:.2} µs"),
            Self::PulseMissing {
                line,
                high,
                from_us,
                until_us,
            } => write!(
                f,
                "{line}: the {} phase from {from_us} to {until_us} µs is missing",
                level(*high)
            ),
            Self::PulseExtra {
                line,
                high,
                from_us,
                until_us,
            } => write!(
                f,
                "{line}: an additional {} phase from {from_us:.2} to {until_us:.2} µs",
                level(*high)
            ),
            Self::LineShifted {
                line,
                mean_ns,
                edges,
            } => write!(
                f,
                "{line}: nearly all of {edges} edges deviate, by {mean_ns:+.0} ns in the mean"
            ),
            Self::LinesSwapped { first, second } => {
                write!(f, "{first} and {second}: exchange their probes")
            }
            Self::LineCarriesOther { line, carries } => {
                write!(f, "{line}: its probe carries {carries}; move the probe")
            }
            Self::LineInverted { line } => {
                write!(f, "{line}: the levels are inverted; check the isolator")
            }
            Self::LineNeverMoves {
                line,
                high,
                expected,
            } => write!(
                f,
                "{line}: always {}, with {expected} edges predicted; check the probe",
                level(*high)
            ),
            Self::WrongLevel { line, high } => write!(
                f,
                "{line}: always {}, {} predicted; check the probe",
                level(*high),
                level(!*high)
            ),
            Self::LineDiffers {
                line,
                expected,
                measured,
                matched,
            } => write!(
                f,
                "{line}: {matched} of {measured} measured edges fit the {expected} predicted ones; \
                 check session and probe"
            ),
            Self::TooWide {
                range_ns,
                limit_ns,
                earliest,
                latest,
            } => write!(
                f,
                "the edges have a range of {range_ns:.0} ns, allowed {limit_ns:.0} ns: earliest {} at \
                 {} µs, latest {} at {} µs",
                earliest.0, earliest.1, latest.0, latest.1
            ),
            Self::Uneven {
                line,
                half_period_us,
                at_us,
                interval_us,
            } => write!(
                f,
                "{line}: {interval_us:.3} µs without an edge from {at_us:.1} µs of the capture on, \
                 {half_period_us:.3} µs expected"
            ),
            Self::Unsteady {
                line,
                half_period_us,
                range_ns,
                limit_ns,
            } => write!(
                f,
                "{line}: the edges leave equal intervals of {half_period_us:.3} µs by {range_ns:.0} \
                 ns, allowed {limit_ns:.0} ns"
            ),
            Self::Outside {
                side: Side::Before,
                length_us,
                edges,
            } => write!(
                f,
                "{edges} edges in the first {:.1} ms, before the first pulse of the session; begin \
                 to record later",
                length_us / 1e3
            ),
            Self::Outside {
                side: Side::After,
                length_us,
                edges,
            } => write!(
                f,
                "the last {:.1} ms ({edges} edges) are after the predicted session; the board \
                 stopped, or the capture must end earlier",
                length_us / 1e3
            ),
            Self::ClockError { ppm, limit_ppm } => write!(
                f,
                "analyser clock: {ppm:+.1} ppm, allowed ±{limit_ppm} ppm; use another analyser or \
                 measure its clock"
            ),
        }
    }
}
