//! Comparison of one capture with the expected edges.
//!
//! The analyser starts at an unknown time, and its clock may be off by up to 1000 ppm. [`fit()`]
//! finds both by the pattern of the edges, then judges each edge against the clock that fits most
//! edges. An edge in the wrong place therefore does not move the others.

mod agreement;
mod align;
mod clock;
mod edges;
mod error;
mod finding;
mod judge;
mod range;
mod report;
mod toggling;
mod track;

pub use error::FitError;
pub use finding::{Finding, Side};
pub use report::{Alignment, LineStatistics, Report, Verdict};

use crate::line::{Expected, MeasuredLine, Measurement};
use agreement::{FIT_NS, Span, agreement};
use align::align;
use clock::fit_clock;
use toggling::Scale;
use track::{Tracks, bad_value};

/// Limits of a comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitOptions {
    /// Allowed range of the board's edges, latest less earliest deviation, nanoseconds, 0 to 1000.
    /// Default 119 ns: 20 cycles at 168 MHz (docs/evidence/hil.md, part 3).
    pub range_ns: f64,
    /// Largest displacement of an edge by the analyser besides rounding to samples, sample periods,
    /// 0 to 1000. Default 1. Rounding widens a range by up to one sample period, and displacements
    /// of the earliest and the latest edge by up to twice this number.
    pub jitter_samples: f64,
    /// Smallest part of the session that a capture must cover, microseconds, 0 to 10¹². Default 0.
    pub min_covered_us: f64,
    /// Accepted clock error of the analyser, parts per million, 0 to 1000. Default 200.
    pub max_clock_ppm: f64,
    /// Smallest sample rate that gives a verdict, hertz. Default 50 MS/s.
    pub min_samplerate_hz: u64,
    /// Smallest number of edges that determine the clock. Default 8.
    pub min_edges: usize,
}

impl Default for FitOptions {
    fn default() -> Self {
        Self {
            range_ns: 119.0,
            jitter_samples: 1.0,
            min_covered_us: 0.0,
            max_clock_ppm: 200.0,
            min_samplerate_hz: 50_000_000,
            min_edges: 8,
        }
    }
}

impl FitOptions {
    /// Returns the largest range that a board within `range_ns` can show at a sample rate,
    /// nanoseconds.
    pub fn limit_ns(&self, samplerate_hz: u64) -> f64 {
        let sample_ns = 1e9 / samplerate_hz as f64;
        self.range_ns + (1.0 + 2.0 * self.jitter_samples) * sample_ns
    }
}

/// Aligns a capture with the expected edges and judges every edge of the capture.
///
/// A capture passes only if it is a part of the prediction, or begins before the prediction and
/// has no edge there.
///
/// # Errors
/// Returns a [`FitError`] if the inputs contradict each other, an option is out of range, or the
/// capture cannot be aligned.
pub fn fit(
    expected: &Expected,
    measured: &Measurement,
    options: &FitOptions,
) -> Result<Report, FitError> {
    for (name, value, most) in [
        ("range_ns", options.range_ns, 1e3),
        ("jitter_samples", options.jitter_samples, 1e3),
        ("max_clock_ppm", options.max_clock_ppm, 1e3),
        ("min_covered_us", options.min_covered_us, 1e12),
    ] {
        if !(0.0..=most).contains(&value) {
            return Err(bad_value(name, value));
        }
    }
    let find = |line: &MeasuredLine| expected.toggling.iter().find(|t| t.name == line.name);
    let (toggling, lines): (Vec<_>, Vec<_>) = measured
        .lines
        .iter()
        .cloned()
        .partition(|line| find(line).is_some());
    let measured = &Measurement { lines, ..*measured };
    let tracks = Tracks::new(expected, measured)?;
    let aligned = align(&tracks)?;
    let pairs = if aligned.inverted {
        pairs(&tracks.inverted(), aligned.clock)
    } else {
        pairs(&tracks, aligned.clock)
    };
    let too_few = FitError::TooFewEdges {
        matched: pairs.len(),
        needed: options.min_edges,
    };
    if pairs.len() < options.min_edges {
        return Err(too_few);
    }
    let clock = fit_clock(&pairs, aligned.clock).ok_or(too_few)?;
    let alignment = match aligned.repetition {
        None => Alignment::Unique,
        Some((period_ns, others)) => Alignment::Repeated {
            period_us: (period_ns / 1e3).round() as u64,
            others,
        },
    };
    let mut report = judge::judge(&tracks, clock, alignment, measured.samplerate_hz, options);
    let scale = Scale::new(&report, measured.samples);
    for line in &toggling {
        let Some(expected) = find(line) else { continue };
        let (statistics, finding) = toggling::judge(line, expected, &scale);
        report.lines.push(statistics);
        if let Some(finding) = finding {
            report.findings.push(finding);
            report.verdict = Verdict::Failed;
        }
    }
    if aligned.ambiguous && matches!(report.verdict, Verdict::Passed | Verdict::NotJudged) {
        report.verdict = Verdict::Ambiguous;
    }
    Ok(report)
}

/// Returns the expected and measured times of all edges that fit the alignment, of the lines that
/// carry their own pattern.
fn pairs(tracks: &Tracks, clock: clock::Clock) -> Vec<(f64, f64)> {
    let span = Span::new(tracks, clock);
    let mut pairs = Vec::new();
    for (_, (measured, expected)) in tracks.voters() {
        if !agreement(measured, expected, clock, span.inner()).votes() {
            continue;
        }
        for (index, &time) in measured.times.iter().enumerate() {
            let place = clock.to_expected(time);
            let partner = expected.nearest(place, measured.edge(index), FIT_NS);
            if let Some((_, partner)) = partner.filter(|_| span.contains(place)) {
                pairs.push((partner, time));
            }
        }
    }
    pairs
}
