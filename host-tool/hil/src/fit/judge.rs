//! Judgement of a capture under a fitted clock: lines first, then the edges of each line.

use super::FitOptions;
use super::agreement::{Agreement, Span, agreement};
use super::clock::{Clock, ClockFit};
use super::edges::{compare, statistics};
use super::report::{Alignment, Finding, LineStatistics, Report, Verdict};
use super::track::{Track, Tracks};

/// Share of explained edges above which a line carries its own pattern.
const OWN: f64 = 0.75;

/// Share of explained edges above which a line carries another pattern.
const OTHER: f64 = 0.8;

/// Number of unexplained edges up to which a line is compared edge by edge in any case.
const FEW: usize = 8;

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
    let sample_ns = 1e9 / samplerate_hz as f64;
    let limit_ns = options.edge_limit_ns + options.resolution_samples * sample_ns;
    let mut findings = Vec::new();
    let (clock_ppm, uncertainty) = (clock.drift * 1e6, fit.drift_uncertainty * 1e6);
    if clock_ppm.abs() - 3.0 * uncertainty > options.max_clock_ppm {
        findings.push(Finding::ClockError {
            ppm: clock_ppm,
            limit_ppm: options.max_clock_ppm,
        });
    }
    let conditions = explain(tracks, clock, span);
    let mut all = Vec::new();
    let mut lines: Vec<LineStatistics> = Vec::new();
    for ((measured, expected), condition) in tracks.pairs().zip(conditions) {
        match condition {
            Condition::Own => {
                let compared = compare(measured, expected, clock, span, limit_ns, &mut findings);
                lines.push(compared.0);
                all.extend(compared.1);
            }
            Condition::Wrong(finding) => {
                let mut line = statistics(&expected.name, &[], limit_ns);
                line.expected = expected.range(span.from, span.until).len();
                lines.push(line);
                findings.extend(finding);
            }
        }
    }
    let total = statistics("", &all, limit_ns);
    let largest = if total.max_ns >= -total.min_ns {
        total.max_ns
    } else {
        total.min_ns
    };
    let verdict = if samplerate_hz < options.min_samplerate_hz {
        Verdict::NotJudged
    } else if findings.is_empty() {
        Verdict::Passed
    } else {
        Verdict::Failed
    };
    Report {
        samplerate_hz,
        alignment,
        start_us: clock.to_expected(0.0) / 1e3,
        from_us: span.from / 1e3,
        until_us: span.until / 1e3,
        clock_ppm,
        clock_uncertainty_ppm: uncertainty,
        limit_ns,
        line_spread_ns: line_spread(&lines),
        lines,
        compared: all.len(),
        largest_ns: largest,
        rms_ns: total.rms_ns,
        range_ns: total.max_ns - total.min_ns,
        findings,
        verdict,
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
