//! Edge-by-edge comparison of one line with its prediction.

use super::agreement::Span;
use super::clock::Clock;
use super::finding::Finding;
use super::report::LineStatistics;
use super::track::Track;
use crate::line::Edge;

/// Largest distance of an edge from its prediction at which it counts as moved whatever its
/// neighbours are, nanoseconds. Below the shortest distance of equal edges of a line, two phases
/// of at least 10 µs and a pause.
const GATE_NS: f64 = 20_000.0;

/// Number of measured edges of one direction that compete for an expected one.
const RIVALS: usize = 16;

/// Smallest number of compared edges for a shift of the whole line.
const MIN_SHIFTED: usize = 4;

/// Edges of one captured line with their partners in the prediction.
pub(super) struct Comparison<'a> {
    expected: &'a Track,
    /// Captured line in session time.
    session: Track,
    pairing: Pairing,
    span: Span,
    /// Start of the prediction, nanoseconds.
    begin: f64,
    /// Indices of expected edges in the span that have a partner, with their deviations in
    /// nanoseconds.
    pub deviations: Vec<(usize, f64)>,
}

impl<'a> Comparison<'a> {
    /// Pairs the edges of a line.
    pub fn new(
        measured: &Track,
        expected: &'a Track,
        clock: Clock,
        span: Span,
        begin: f64,
    ) -> Comparison<'a> {
        let times = measured.times.iter().map(|t| clock.to_expected(*t));
        let session = Track {
            times: times.collect(),
            ..measured.clone()
        };
        let pairing = Pairing::new(&session, expected);
        let mut deviations = Vec::new();
        for (index, &time) in expected.times.iter().enumerate() {
            let partner = pairing.of_expected.get(index).copied().flatten();
            let partner = partner.and_then(|partner| session.times.get(partner));
            if let Some(partner) = partner.filter(|_| span.contains(time)) {
                deviations.push((index, partner - time));
            }
        }
        Comparison {
            expected,
            session,
            pairing,
            span,
            begin,
            deviations,
        }
    }

    /// Returns name and predicted time of an expected edge, microseconds.
    pub fn edge(&self, index: usize) -> (String, u64) {
        (
            self.expected.name.clone(),
            microseconds(self.expected, index),
        )
    }

    /// Returns the predicted time of an expected edge, nanoseconds.
    pub fn time(&self, index: usize) -> f64 {
        self.expected.times.get(index).copied().unwrap_or_default()
    }

    /// Returns the number of measured edges before the prediction.
    pub fn before(&self) -> usize {
        let extra = self.pairing.extra(&self.session, self.span.inner());
        extra.iter().filter(|index| self.is_before(**index)).count()
    }

    fn is_before(&self, measured: usize) -> bool {
        self.session
            .times
            .get(measured)
            .is_some_and(|t| *t < self.begin)
    }

    /// Returns whether nearly all edges deviate by more than the limit to one side.
    pub fn is_shifted(&self, limit_ns: f64) -> bool {
        shift(&self.values(), limit_ns).is_some()
    }

    fn values(&self) -> Vec<f64> {
        self.deviations.iter().map(|entry| entry.1).collect()
    }

    /// Adds the findings of the line, and returns its statistics.
    pub fn judge(&self, limit_ns: f64, findings: &mut Vec<Finding>) -> LineStatistics {
        let (expected, name) = (self.expected, &self.expected.name);
        let values = self.values();
        let outside = self.deviations.iter().filter(|(_, d)| d.abs() > limit_ns);
        let mut moved: Vec<Finding> = outside
            .map(|&(index, deviation_ns)| Finding::EdgeMoved {
                line: name.clone(),
                time_us: microseconds(expected, index),
                edge: expected.edge(index),
                deviation_ns,
            })
            .collect();
        let mut statistics = statistics(name, &values, limit_ns);
        statistics.moved = moved.len();
        statistics.expected = expected.range(self.span.from, self.span.until).len();
        if let Some(mean_ns) = shift(&values, limit_ns) {
            moved = vec![Finding::LineShifted {
                line: name.clone(),
                mean_ns,
                edges: values.len(),
            }];
        }
        let missing = self.pairing.missing(expected, self.span.inner());
        let mut extra = self.pairing.extra(&self.session, self.span.inner());
        extra.retain(|index| !self.is_before(*index));
        statistics.missing = missing.len();
        statistics.extra = extra.len();
        findings.append(&mut moved);
        runs(&missing, |from, until| {
            findings.push(missing_finding(expected, from, until));
        });
        runs(&extra, |from, until| {
            findings.push(extra_finding(&self.session, name, from, until));
        });
        statistics
    }
}

/// Returns the mean deviation if at least 90 % of the edges of a line are outside the limit on the
/// same side.
fn shift(deviations: &[f64], limit_ns: f64) -> Option<f64> {
    let mean = |late: bool| {
        let outside = |d: &&f64| {
            if late {
                **d > limit_ns
            } else {
                **d < -limit_ns
            }
        };
        let count = deviations.iter().filter(outside).count();
        let most = count >= MIN_SHIFTED && count * 10 >= deviations.len() * 9;
        let sum: f64 = deviations.iter().filter(outside).sum();
        most.then_some(sum / count as f64)
    };
    mean(true).or_else(|| mean(false))
}

/// Partners of expected and measured edges.
struct Pairing {
    of_expected: Vec<Option<usize>>,
    of_measured: Vec<Option<usize>>,
}

impl Pairing {
    /// Pairs edges of equal direction, the nearest first. `measured` has session times.
    fn new(measured: &Track, expected: &Track) -> Self {
        let mut candidates: Vec<(f64, usize, usize)> = Vec::new();
        for (index, &time) in expected.times.iter().enumerate() {
            let edge = expected.edge(index);
            let near = measured.range(time - GATE_NS, time + GATE_NS);
            let mut near: Vec<(f64, usize, usize)> = near
                .filter(|other| measured.edge(*other) == edge)
                .filter_map(|other| {
                    let distance = (measured.times.get(other)? - time).abs();
                    Some((distance, index, other))
                })
                .collect();
            sort(&mut near);
            near.truncate(RIVALS);
            candidates.append(&mut near);
        }
        sort(&mut candidates);
        let mut pairing = Pairing {
            of_expected: vec![None; expected.times.len()],
            of_measured: vec![None; measured.times.len()],
        };
        for (_, index, other) in candidates {
            pairing.join(index, other);
        }
        pairing.join_far(measured, expected);
        pairing
    }

    fn join(&mut self, index: usize, other: usize) {
        let slots = (
            self.of_expected.get_mut(index),
            self.of_measured.get_mut(other),
        );
        if let (Some(expected @ None), Some(measured @ None)) = slots {
            *expected = Some(other);
            *measured = Some(index);
        }
    }

    /// Pairs an edge that moved further than the gate, if both of its neighbours are in place.
    fn join_far(&mut self, measured: &Track, expected: &Track) {
        for index in 1..expected.times.len() {
            let partner = |index: usize| self.of_expected.get(index).copied().flatten();
            let (Some(before), None, Some(after)) =
                (partner(index - 1), partner(index), partner(index + 1))
            else {
                continue;
            };
            if before + 2 == after && measured.edge(before + 1) == expected.edge(index) {
                self.join(index, before + 1);
            }
        }
    }

    fn missing(&self, expected: &Track, span: Span) -> Vec<usize> {
        let unpaired = |index: &usize| self.of_expected.get(*index) == Some(&None);
        expected
            .range(span.from, span.until)
            .filter(unpaired)
            .collect()
    }

    fn extra(&self, measured: &Track, span: Span) -> Vec<usize> {
        let unpaired = |index: &usize| self.of_measured.get(*index) == Some(&None);
        measured
            .range(span.from, span.until)
            .filter(unpaired)
            .collect()
    }
}

fn sort(candidates: &mut [(f64, usize, usize)]) {
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
}

/// Groups consecutive indices into pairs; a single index is passed with `None`.
fn runs(indices: &[usize], mut visit: impl FnMut(usize, Option<usize>)) {
    let mut rest = indices;
    while let [first, tail @ ..] = rest {
        rest = tail;
        match tail {
            [next, after @ ..] if *next == first + 1 => {
                visit(*first, Some(*next));
                rest = after;
            }
            _ => visit(*first, None),
        }
    }
}

/// Returns the predicted time of an edge in whole microseconds. The skew is below 1 µs and was
/// added to the time, so the result uses the time without it.
fn microseconds(expected: &Track, index: usize) -> u64 {
    let time = expected.times.get(index).copied().unwrap_or_default();
    ((time - expected.skew) / 1e3).round() as u64
}

fn missing_finding(expected: &Track, from: usize, until: Option<usize>) -> Finding {
    let line = expected.name.clone();
    let time_us = microseconds(expected, from);
    match until {
        Some(until) => Finding::PulseMissing {
            line,
            high: expected.high_after(from),
            from_us: time_us,
            until_us: microseconds(expected, until),
        },
        None => Finding::EdgeMissing {
            line,
            time_us,
            edge: expected.edge(from),
        },
    }
}

fn extra_finding(measured: &Track, line: &str, from: usize, until: Option<usize>) -> Finding {
    let line = line.to_string();
    let time = |index: usize| measured.times.get(index).copied().unwrap_or_default() / 1e3;
    match until {
        Some(until) => Finding::PulseExtra {
            line,
            high: measured.high_after(from),
            from_us: time(from),
            until_us: time(until),
        },
        None => Finding::EdgeExtra {
            line,
            time_us: time(from),
            edge: Edge::towards(measured.high_after(from)),
        },
    }
}

/// Returns the statistics of deviations; counts other than `compared` are 0.
pub(super) fn statistics(name: &str, deviations: &[f64], limit_ns: f64) -> LineStatistics {
    let count = deviations.len();
    let square: f64 = deviations.iter().map(|d| d * d).sum();
    let extreme = |start: f64, pick: fn(f64, f64) -> f64| {
        let value = deviations.iter().copied().fold(start, pick);
        if count == 0 { 0.0 } else { value }
    };
    let within = deviations.iter().filter(|d| d.abs() <= limit_ns);
    let mean = match within.clone().count() {
        0 => deviations.iter().sum::<f64>() / count.max(1) as f64,
        within_count => within.sum::<f64>() / within_count as f64,
    };
    LineStatistics {
        name: name.to_string(),
        expected: 0,
        compared: count,
        moved: 0,
        missing: 0,
        extra: 0,
        mean_ns: mean,
        rms_ns: (square / count.max(1) as f64).sqrt(),
        min_ns: extreme(f64::INFINITY, f64::min),
        max_ns: extreme(f64::NEG_INFINITY, f64::max),
    }
}
