//! Agreement of a captured line with an expected line under a clock.

use super::clock::Clock;
use super::track::{Track, Tracks};

/// Distance within which an edge fits an aligned pattern, nanoseconds. Above the largest deviation
/// of one misplaced microsecond, and below the shortest distance of equal edges on a line.
pub(super) const FIT_NS: f64 = 3_000.0;

/// Width of the zones at both ends of the compared period in which an edge may have its partner
/// outside, nanoseconds.
pub(super) const GUARD_NS: f64 = 2_000.0;

/// Score of a fitting edge.
pub(super) const FITTING: i64 = 2;

/// Cost of a missing or an extra edge, and of a wrong level at an end of the span.
pub(super) const WRONG: i64 = 3;

/// Part of a capture that the prediction describes, session nanoseconds. It begins with the
/// capture, because no line moves before the prediction, and ends with the capture or the
/// prediction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub from: f64,
    pub until: f64,
}

impl Span {
    /// Returns the part under a clock.
    pub fn new(tracks: &Tracks, clock: Clock) -> Span {
        Span {
            from: clock.to_expected(0.0),
            until: clock.to_expected(tracks.end).min(tracks.until),
        }
    }

    /// Returns the span without its guard zones.
    pub fn inner(self) -> Span {
        Span {
            from: self.from + GUARD_NS,
            until: self.until - GUARD_NS,
        }
    }

    /// Returns whether a time lies in the span.
    pub fn contains(self, time: f64) -> bool {
        self.from <= time && time <= self.until
    }
}

/// Number of edges of a captured line that an expected line explains.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreement {
    /// Measurement edges in the span.
    pub measured: usize,
    /// Expected edges in the span.
    pub expected: usize,
    /// Measurement edges in the span with a partner.
    pub matched: usize,
    /// Expected edges in the span with a partner.
    pub found: usize,
    /// Ends of the span at which the levels differ, 0 to 2.
    pub wrong_levels: usize,
}

impl Agreement {
    /// Returns the number of expected edges without a partner.
    pub fn missing(self) -> usize {
        self.expected.saturating_sub(self.found)
    }

    /// Returns the number of measured edges without a partner.
    pub fn extra(self) -> usize {
        self.measured.saturating_sub(self.matched)
    }

    /// Returns the number of missing edges, extra edges and wrong levels.
    pub fn errors(self) -> usize {
        self.missing() + self.extra() + self.wrong_levels
    }

    /// Returns whether the line may vote for an alignment: more than two fitting edges per missing
    /// or extra one.
    pub fn votes(self) -> bool {
        self.matched > 2 * (self.missing() + self.extra())
    }

    /// Returns the score of the line. A fitting edge counts [`FITTING`], so that an alignment is
    /// not better because it moves a fault out of the prediction. A missing or an extra edge costs
    /// [`WRONG`], so that it is not better because it moves more edges into the prediction.
    pub fn score(self) -> i64 {
        FITTING * self.matched as i64 - WRONG * self.errors() as i64
    }

    /// Returns the explained share of all edges, 0 to 1; 1 for a line without edges.
    pub fn quality(self) -> f64 {
        let all = self.measured + self.expected;
        if all == 0 {
            return 1.0;
        }
        (self.matched + self.found) as f64 / all as f64
    }
}

/// Returns the number of edges of a captured line after the prediction.
pub(super) fn edges_after(tracks: &Tracks, measured: &Track, clock: Clock) -> usize {
    let end = clock.to_measured(tracks.until + GUARD_NS);
    measured.times.len() - measured.times.partition_point(|t| *t <= end)
}

/// Compares a captured line with an expected line under a clock.
pub(super) fn agreement(measured: &Track, expected: &Track, clock: Clock, span: Span) -> Agreement {
    let mut result = Agreement {
        measured: 0,
        expected: 0,
        matched: 0,
        found: 0,
        wrong_levels: 0,
    };
    let first = clock.to_expected(measured.times.first().copied().unwrap_or(0.0));
    let mut cursor = expected.range(first, first).start;
    for (index, &time) in measured.times.iter().enumerate() {
        let time = clock.to_expected(time);
        if span.contains(time) {
            let edge = measured.edge(index);
            let partner = expected.nearest_from(&mut cursor, time, edge, FIT_NS);
            result.measured += 1;
            result.matched += usize::from(partner.is_some());
        }
    }
    let mut cursor = 0;
    for index in expected.range(span.from, span.until) {
        let Some(&time) = expected.times.get(index) else {
            continue;
        };
        let place = clock.to_measured(time);
        let edge = expected.edge(index);
        let partner = measured.nearest_from(&mut cursor, place, edge, FIT_NS);
        result.expected += 1;
        result.found += usize::from(partner.is_some());
    }
    for time in [span.from, span.until] {
        let place = clock.to_measured(time);
        // An edge near the end decides for itself.
        let quiet = |track: &Track, t: f64| track.range(t - FIT_NS, t + FIT_NS).is_empty();
        if quiet(expected, time) && quiet(measured, place) {
            let differ = measured.high_at(place) != expected.high_at(time);
            result.wrong_levels += usize::from(differ);
        }
    }
    result
}
