//! Judgement of several captures that together cover all lines.
//!
//! Every capture is aligned by its own lines, of which the common line of the plan is one, so the
//! captures need not come from one run.

use crate::capture::Capture;
use crate::fit::{FitError, FitOptions, LineStatistics, Report, Verdict, fit};
use crate::line::Expected;
use crate::plan::{Connection, Plan, PlanError, connect};

/// Reason why one capture of a plan has no report.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MergeError {
    /// No file was given for this part of the plan.
    #[error("capture {number}: not given; record it")]
    Absent {
        /// Number of the capture, from 1.
        number: usize,
    },
    /// The capture lacks a probe of the plan.
    #[error("capture {number}: {source}")]
    Plan {
        /// Number of the capture, from 1.
        number: usize,
        /// Missing probe.
        source: PlanError,
    },
    /// The capture cannot be aligned.
    #[error("capture {number}: {source}")]
    Fit {
        /// Number of the capture, from 1.
        number: usize,
        /// Reason.
        source: FitError,
    },
    /// The capture fits another part of the plan.
    #[error("capture {number}: fits the connections of capture {fits}; exchange the files")]
    Exchanged {
        /// Number of the capture, from 1.
        number: usize,
        /// Number of the part that it fits, from 1.
        fits: usize,
    },
}

/// Result of several captures.
#[derive(Clone, Debug, PartialEq)]
pub struct MergedReport {
    /// Report of every capture of the plan, or the reason why there is none.
    pub captures: Vec<Result<Report, MergeError>>,
    /// Statistics of every line of the plan without the common line, in the order of the plan.
    /// Means of different captures are comparable in `mean_to_common_ns`.
    pub lines: Vec<MergedLine>,
    /// Lines that were not compared: their capture is missing, or no edge is paired although the
    /// prediction has edges. A line without any predicted edge is compared by being quiet.
    pub not_covered: Vec<String>,
    /// Number of compared edges.
    pub compared: usize,
    /// Deviation with the largest magnitude, nanoseconds.
    pub largest_ns: f64,
    /// Root mean square of all deviations, nanoseconds.
    pub rms_ns: f64,
    /// Largest less smallest of the lines' `mean_to_common_ns`, nanoseconds.
    pub line_spread_ns: f64,
    /// Conclusion. [`Verdict::Passed`] only if every capture passed and every line is covered.
    pub verdict: Verdict,
}

/// Line in a result of several captures.
#[derive(Clone, Debug, PartialEq)]
pub struct MergedLine {
    /// Number of the capture, from 1.
    pub capture: usize,
    /// Statistics within that capture.
    pub statistics: LineStatistics,
    /// Mean deviation less that of the common line in the same capture, nanoseconds. `None` if
    /// either was not compared, or the line toggles at all times.
    pub mean_to_common_ns: Option<f64>,
}

/// Judges the captures of a plan, given in its order. A missing capture is `None` or beyond the
/// end.
pub fn merge(
    expected: &Expected,
    plan: &Plan,
    captures: &[Option<Capture>],
    options: &FitOptions,
) -> MergedReport {
    let mut reports = Vec::new();
    for (index, connections) in plan.captures.iter().enumerate() {
        let number = index + 1;
        let capture = captures.get(index).and_then(Option::as_ref);
        reports.push(match capture {
            None => Err(MergeError::Absent { number }),
            Some(capture) => judge(expected, plan, capture, (number, connections), options),
        });
    }
    let lines = merged_lines(expected, plan, &reports);
    let is_quiet = |name: &str| {
        let line = expected.lines.iter().find(|line| line.name == name);
        line.is_some_and(|line| line.edges_us.is_empty())
    };
    let covered = |name: &str| {
        let mut with_name = lines.iter().filter(|line| line.statistics.name == name);
        with_name.any(|line| line.statistics.compared > 0 || is_quiet(name))
    };
    let names = plan.captures.iter().flatten().map(|c| &c.line);
    let lines_only = names.filter(|name| **name != plan.common);
    let not_covered: Vec<String> = lines_only.filter(|name| !covered(name)).cloned().collect();
    let good = || reports.iter().flatten();
    let compared: usize = good().map(|report| report.compared).sum();
    let square = |report: &Report| report.rms_ns.powi(2) * report.compared as f64;
    let squares: f64 = good().map(square).sum();
    let largest = good().map(|report| report.largest_ns);
    let verdict = verdict(&reports, &not_covered);
    MergedReport {
        compared,
        largest_ns: largest.fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a }),
        rms_ns: (squares / compared.max(1) as f64).sqrt(),
        line_spread_ns: spread(&lines),
        captures: reports,
        lines,
        not_covered,
        verdict,
    }
}

fn judge(
    expected: &Expected,
    plan: &Plan,
    capture: &Capture,
    (number, connections): (usize, &[Connection]),
    options: &FitOptions,
) -> Result<Report, MergeError> {
    let try_part = |connections: &[Connection]| {
        let measured = connect(capture, connections);
        let measured = measured.map_err(|source| MergeError::Plan { number, source })?;
        let report = fit(expected, &measured, options);
        report.map_err(|source| MergeError::Fit { number, source })
    };
    let own = try_part(connections);
    let wrong = |report: &Report| {
        let about_lines = report.findings.iter().filter(|f| f.is_about_line());
        about_lines.count()
    };
    // Files in the wrong order disagree with most lines, and agree with another part.
    let suspicious = match &own {
        Ok(report) => wrong(report) > 0,
        Err(error) => matches!(error, MergeError::Fit { .. }),
    };
    if suspicious {
        for (index, other) in plan.captures.iter().enumerate() {
            let fits = index + 1;
            if fits != number && try_part(other).is_ok_and(|report| wrong(&report) == 0) {
                return Err(MergeError::Exchanged { number, fits });
            }
        }
    }
    own
}

fn merged_lines(
    expected: &Expected,
    plan: &Plan,
    reports: &[Result<Report, MergeError>],
) -> Vec<MergedLine> {
    let has_phase = |name: &str| expected.toggling.iter().all(|line| line.name != name);
    let mut lines = Vec::new();
    for (report, capture) in reports.iter().zip(1..) {
        let Ok(report) = report else {
            continue;
        };
        let mean = |line: &LineStatistics| {
            (line.compared > 0 && has_phase(&line.name)).then_some(line.mean_ns)
        };
        let common = report.lines.iter().find(|line| line.name == plan.common);
        let common = common.and_then(mean);
        for line in report.lines.iter().filter(|line| line.name != plan.common) {
            let difference = mean(line).zip(common).map(|(line, common)| line - common);
            lines.push(MergedLine {
                capture,
                statistics: line.clone(),
                mean_to_common_ns: difference,
            });
        }
    }
    lines
}

fn spread(lines: &[MergedLine]) -> f64 {
    let means = lines.iter().filter_map(|line| line.mean_to_common_ns);
    let largest = means.clone().fold(f64::NEG_INFINITY, f64::max);
    let smallest = means.fold(f64::INFINITY, f64::min);
    (largest - smallest).max(0.0)
}

fn verdict(reports: &[Result<Report, MergeError>], not_covered: &[String]) -> Verdict {
    let any = |verdict| reports.iter().flatten().any(|r| r.verdict == verdict);
    if any(Verdict::Failed) {
        Verdict::Failed
    } else if reports.iter().any(Result::is_err)
        || any(Verdict::Incomplete)
        || !not_covered.is_empty()
    {
        Verdict::Incomplete
    } else if any(Verdict::Ambiguous) {
        Verdict::Ambiguous
    } else if any(Verdict::NotJudged) {
        Verdict::NotJudged
    } else {
        Verdict::Passed
    }
}
