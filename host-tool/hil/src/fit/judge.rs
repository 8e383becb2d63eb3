//! Judgement of a capture under a fitted clock: lines first, then the edges of each line.

use super::FitOptions;
use super::agreement::{Agreement, GUARD_NS, Span, agreement, edges_after};
use super::clock::{Clock, ClockFit};
use super::edges::{Comparison, statistics};
use super::finding::{Finding, Side};
use super::range::smallest_range;
use super::report::{Alignment, LineStatistics, Report, Verdict};
use super::track::{Track, Tracks};

/// Share of explained edges above which a line carries its own pattern.
const OWN: f64 = 0.75;

/// Share of explained edges above which a line carries another pattern.
const OTHER: f64 = 0.8;

/// Number of unexplained edges up to which a line is compared edge by edge in any case.
const FEW: usize = 8;

/// Tolerance of a range for the rounding of numbers, nanoseconds.
const ROUNDING_NS: f64 = 0.01;

/// Judges all lines and returns the report.
pub(super) fn judge(
    tracks: &Tracks,
    fit: ClockFit,
    alignment: Alignment,
    samplerate_hz: u64,
    options: &FitOptions,
) -> Report {
    let clock = fit.clock;
    let span = Span::new(tracks, clock);
    let limit_ns = options.limit_ns(samplerate_hz);
    let (clock_ppm, uncertainty) = (clock.drift * 1e6, fit.drift_uncertainty * 1e6);
    let mut findings = Vec::new();
    if clock_ppm.abs() - 3.0 * uncertainty > options.max_clock_ppm {
        findings.push(Finding::ClockError {
            ppm: clock_ppm,
            limit_ppm: options.max_clock_ppm,
        });
    }
    let conditions = explain(tracks, clock, span);
    let compare = |((measured, expected), condition)| match condition {
        Condition::Own => Ok(Comparison::new(
            measured,
            expected,
            clock,
            span,
            tracks.from,
        )),
        Condition::Wrong(finding) => Err((expected, finding)),
    };
    let comparisons: Vec<_> = tracks.pairs().zip(conditions).map(compare).collect();
    let own: Vec<&Comparison<'_>> = comparisons.iter().flatten().collect();
    findings.extend(outside(tracks, clock, &own));
    let (range_ns, edge_limit_ns, too_wide) = judge_range(&own, limit_ns);
    let mut lines: Vec<LineStatistics> = Vec::new();
    for comparison in &comparisons {
        lines.push(match comparison {
            Ok(comparison) => comparison.judge(edge_limit_ns, &mut findings),
            Err((expected, finding)) => {
                findings.extend(finding.clone());
                LineStatistics {
                    expected: expected.range(span.from, span.until).len(),
                    ..statistics(&expected.name, &[], limit_ns)
                }
            }
        });
    }
    findings.extend(too_wide);
    let deviations = own.iter().flat_map(|line| &line.deviations);
    let deviations: Vec<f64> = deviations.map(|entry| entry.1).collect();
    let total = statistics("", &deviations, limit_ns);
    let largest = if total.max_ns >= -total.min_ns {
        total.max_ns
    } else {
        total.min_ns
    };
    let from = span.from.max(tracks.from);
    let covered_us = (span.until - from).max(0.0) / 1e3;
    Report {
        samplerate_hz,
        alignment,
        start_us: clock.to_expected(0.0) / 1e3,
        from_us: from / 1e3,
        until_us: span.until / 1e3,
        covered_us,
        needed_us: options.min_covered_us,
        clock_ppm,
        clock_uncertainty_ppm: uncertainty,
        limit_ns,
        line_spread_ns: line_spread(&lines),
        lines,
        compared: deviations.len(),
        largest_ns: largest,
        rms_ns: total.rms_ns,
        range_ns,
        verdict: verdict(&findings, covered_us, samplerate_hz, options),
        findings,
    }
}

fn verdict(
    findings: &[Finding],
    covered_us: f64,
    samplerate_hz: u64,
    options: &FitOptions,
) -> Verdict {
    if !findings.is_empty() {
        Verdict::Failed
    } else if covered_us < options.min_covered_us {
        Verdict::Incomplete
    } else if samplerate_hz < options.min_samplerate_hz {
        Verdict::NotJudged
    } else {
        Verdict::Passed
    }
}

/// Returns the findings about parts of a capture outside the prediction.
fn outside(tracks: &Tracks, clock: Clock, lines: &[&Comparison<'_>]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let start = clock.to_expected(0.0);
    let before: usize = lines.iter().map(|line| line.before()).sum();
    if before > 0 {
        findings.push(Finding::Outside {
            side: Side::Before,
            length_us: (tracks.from - start) / 1e3,
            edges: before,
        });
    }
    let end = clock.to_expected(tracks.end);
    if end > tracks.until + GUARD_NS {
        let after = tracks.pairs();
        let after = after.map(|(measured, _)| edges_after(tracks, measured, clock));
        findings.push(Finding::Outside {
            side: Side::After,
            length_us: (end - tracks.until) / 1e3,
            edges: after.sum(),
        });
    }
    findings
}

/// Judges the range of all edges. Returns the range, the limit of single edges and the finding: a
/// limit only if the range is too wide, because the fitted clock may make one edge of a good
/// capture deviate further than the best clock does.
fn judge_range(lines: &[&Comparison<'_>], limit_ns: f64) -> (f64, f64, Option<Finding>) {
    let range_of = |limit_ns: f64| {
        let lines = lines.iter().filter(|line| !line.is_shifted(limit_ns));
        let kept = |line: &'_ Comparison<'_>| {
            let deviations = line.deviations.iter();
            let kept = deviations.filter(|(_, d)| d.abs() <= limit_ns);
            let kept = kept.map(|&(index, d)| (line.edge(index), (line.time(index), d)));
            kept.collect::<Vec<_>>()
        };
        let edges: Vec<_> = lines.flat_map(|line| kept(line)).collect();
        let points: Vec<(f64, f64)> = edges.iter().map(|edge| edge.1).collect();
        let range = smallest_range(&points)?;
        let name = |index: usize| edges.get(index).map(|edge| edge.0.clone());
        Some((range.width, name(range.earliest)?, name(range.latest)?))
    };
    let is_wide = |width: f64| width > limit_ns + ROUNDING_NS;
    match range_of(f64::INFINITY) {
        None => (0.0, f64::INFINITY, None),
        Some((width, ..)) if !is_wide(width) => (width, f64::INFINITY, None),
        Some(_) => {
            let rest = range_of(limit_ns);
            let width = rest.as_ref().map_or(0.0, |rest| rest.0);
            let finding = rest.filter(|rest| is_wide(rest.0));
            let finding = finding.map(|(range_ns, earliest, latest)| Finding::TooWide {
                range_ns,
                limit_ns,
                earliest,
                latest,
            });
            (width, limit_ns, finding)
        }
    }
}

fn line_spread(lines: &[LineStatistics]) -> f64 {
    let compared = lines.iter().filter(|line| line.compared > 0);
    let means = compared.map(|line| line.mean_ns);
    let largest = means.clone().fold(f64::NEG_INFINITY, f64::max);
    let smallest = means.fold(f64::INFINITY, f64::min);
    (largest - smallest).max(0.0)
}

/// Condition of a line as a whole.
enum Condition {
    /// The line carries its own pattern; its edges are compared one by one.
    Own,
    /// The line carries something else. The second line of a swapped pair has no finding.
    Wrong(Option<Finding>),
}

fn explain(tracks: &Tracks, clock: Clock, span: Span) -> Vec<Condition> {
    let inner = span.inner();
    let middle = (inner.from + inner.until) / 2.0;
    let quality = |measured: &Track, expected: &Track| {
        let counts = agreement(measured, expected, clock, inner);
        if counts.measured + counts.expected > 0 {
            return counts.quality();
        }
        // Lines without edges can only differ in their level.
        let level = measured.high_at(clock.to_measured(middle));
        f64::from(level == expected.high_at(middle))
    };
    let own: Vec<f64> = tracks.pairs().map(|(m, e)| quality(m, e)).collect();
    let mut swapped_with: Vec<Option<usize>> = vec![None; own.len()];
    let bad = |index: usize| own.get(index).is_some_and(|own| *own < OWN);
    let lines: Vec<(&Track, &Track)> = tracks.pairs().collect();
    for (first, a) in lines.iter().enumerate().filter(|(index, _)| bad(*index)) {
        for (second, b) in lines.iter().enumerate().skip(first + 1) {
            let free = |index: usize| swapped_with.get(index) == Some(&None);
            let explains = bad(second)
                && free(first)
                && free(second)
                && quality(a.0, b.1) >= OTHER
                && quality(b.0, a.1) >= OTHER;
            if explains {
                for (index, other) in [(first, second), (second, first)] {
                    if let Some(slot) = swapped_with.get_mut(index) {
                        *slot = Some(other);
                    }
                }
            }
        }
    }
    let conditions = lines.iter().zip(swapped_with).enumerate();
    conditions
        .map(|(index, (&(measured, expected), swapped))| {
            if let Some(other) = swapped {
                let partner = lines.get(other).filter(|_| index < other);
                return Condition::Wrong(partner.map(|(_, partner)| Finding::LinesSwapped {
                    first: expected.name.clone(),
                    second: partner.name.clone(),
                }));
            }
            if !bad(index) {
                return Condition::Own;
            }
            let counts = agreement(measured, expected, clock, inner);
            explain_one(tracks, measured, expected, counts, &quality)
        })
        .collect()
}

/// Finds the reason why a line does not carry its own pattern.
fn explain_one(
    tracks: &Tracks,
    measured: &Track,
    expected: &Track,
    counts: Agreement,
    quality: &dyn Fn(&Track, &Track) -> f64,
) -> Condition {
    let line = expected.name.clone();
    let wrong = |finding| Condition::Wrong(Some(finding));
    let high = measured.first_high;
    if measured.times.is_empty() {
        return wrong(match counts.expected {
            0 => Finding::WrongLevel { line, high },
            expected => Finding::LineNeverMoves {
                line,
                high,
                expected,
            },
        });
    }
    let inverted = Track {
        first_high: !measured.first_high,
        ..measured.clone()
    };
    if counts.expected > 0 && quality(&inverted, expected) >= OTHER {
        return wrong(Finding::LineInverted { line });
    }
    let mut best: Option<(f64, &Track)> = None;
    for other in tracks.expected.iter().filter(|other| other.name != line) {
        let share = quality(measured, other);
        if counts.measured >= 2 && share >= OTHER && best.is_none_or(|best| share > best.0) {
            best = Some((share, other));
        }
    }
    if let Some((_, other)) = best {
        let carries = other.name.clone();
        return wrong(Finding::LineCarriesOther { line, carries });
    }
    if counts.missing() + counts.extra() <= FEW {
        return Condition::Own;
    }
    wrong(Finding::LineDiffers {
        line,
        expected: counts.expected,
        measured: counts.measured,
        matched: counts.matched,
    })
}
