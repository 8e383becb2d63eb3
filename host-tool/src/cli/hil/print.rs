//! Output of `flexor hil`: connections, and the result of a comparison.

use super::expected::pins;
use super::{Output, Plan};
use crate::cli::board::header_name;
use hil::fit::{Alignment, Report};
use hil::merge::MergedReport;
use host_core::run::Board;
use serde_json::{Value, json};
use std::fmt::Write as _;

/// Prints the connections of each capture.
///
/// # Errors
/// Fails if the output cannot be written.
pub fn connections(board: Board, plan: &Plan, output: Output) -> anyhow::Result<()> {
    let pins = pins(board);
    let header = |line: &str| {
        let pin = pins.iter().find(|(name, _)| name == line);
        pin.and_then(|(_, pin)| header_name(board, *pin))
            .unwrap_or_default()
    };
    let text = || {
        let mut text = String::new();
        for (n, connections) in plan.captures.iter().enumerate() {
            let _ = writeln!(text, "capture {}: input, line, header", n + 1);
            for connection in connections {
                let (line, bit) = (&connection.line, connection.bit);
                let _ = writeln!(text, "  D{bit:<3} {line:<6} {}", header(line));
            }
        }
        text.trim_end().to_owned()
    };
    let json = || {
        let captures = plan.captures.iter().map(|connections| {
            let rows = connections.iter().map(|connection| {
                let (line, bit) = (&connection.line, connection.bit);
                json!({ "input": bit, "line": line, "header": header(line) })
            });
            rows.collect::<Value>()
        });
        json!({ "captures": captures.collect::<Vec<_>>() })
    };
    output.print(text, json)
}

/// Returns the verdict in words.
fn verdict(report: &MergedReport, is_simulated: bool) -> String {
    let verdict = format!("{:?}", report.verdict).to_lowercase();
    if is_simulated {
        format!("{verdict} (simulated captures: no evidence about a board)")
    } else {
        verdict
    }
}

/// Returns the result for people.
#[must_use]
pub fn report(report: &MergedReport, is_simulated: bool) -> String {
    let mut text = format!("verdict: {}\n", verdict(report, is_simulated));
    for (n, capture) in report.captures.iter().enumerate() {
        match capture {
            Err(why) => {
                let _ = writeln!(text, "{why}");
            }
            Ok(capture) => {
                let _ = writeln!(
                    text,
                    "capture {}: {} edges in {:.3} s, analyser {:+.1} ± {:.1} ppm, range {:.0} ns of \
                     {:.0}, largest deviation {:.0} ns",
                    n + 1,
                    capture.compared,
                    capture.covered_us / 1e6,
                    capture.clock_ppm,
                    capture.clock_uncertainty_ppm,
                    capture.range_ns,
                    capture.limit_ns,
                    capture.largest_ns,
                );
                text.push_str(&coverage(capture));
                for finding in &capture.findings {
                    let _ = writeln!(text, "  {finding}");
                }
            }
        }
    }
    if !report.not_covered.is_empty() {
        let _ = writeln!(text, "not compared: {}", report.not_covered.join(", "));
    }
    text.trim_end().to_owned()
}

/// Returns where a capture lies in the session, and whether it is too short.
fn coverage(capture: &Report) -> String {
    let mut text = String::new();
    let (from, until) = (capture.start_us / 1e3, capture.until_us / 1e3);
    let _ = writeln!(
        text,
        "  session time {from:.1} to {until:.1} ms{}",
        alignment(capture)
    );
    // If the alignment is not unique, the capture may as well begin between two pulses.
    if from < 0.0 && capture.alignment == Alignment::Unique && capture.findings.is_empty() {
        let _ = writeln!(text, "  silent for {:.1} ms before the first pulse", -from);
    }
    if capture.covered_us < capture.needed_us {
        let (covered, needed) = (capture.covered_us / 1e6, capture.needed_us / 1e6);
        let _ = writeln!(
            text,
            "  incomplete: {covered:.3} s of the session, {needed:.3} s needed; record longer"
        );
    }
    text
}

/// Returns the uncertainty of the session time in words.
fn alignment(capture: &Report) -> String {
    match capture.alignment {
        Alignment::Unique => String::new(),
        Alignment::Repeated { period_us, .. } => {
            format!(", or a multiple of {:.1} ms later", period_us as f64 / 1e3)
        }
    }
}

/// Returns the sheet: every number of the comparison.
#[must_use]
pub fn sheet(report: &MergedReport, board: Board, is_simulated: bool) -> Value {
    let captures = report.captures.iter().map(|capture| match capture {
        Err(why) => json!({ "error": why.to_string() }),
        Ok(capture) => json!({
            "samplerate_hz": capture.samplerate_hz,
            "edges": capture.compared,
            "start_us": capture.start_us,
            "from_us": capture.from_us,
            "until_us": capture.until_us,
            "covered_us": capture.covered_us,
            "needed_us": capture.needed_us,
            "alignment": match capture.alignment {
                Alignment::Unique => json!({ "kind": "unique" }),
                Alignment::Repeated { period_us, others } => {
                    json!({ "kind": "repeated", "period_us": period_us, "others": others })
                }
            },
            "clock_ppm": capture.clock_ppm,
            "clock_uncertainty_ppm": capture.clock_uncertainty_ppm,
            "largest_ns": capture.largest_ns,
            "limit_ns": capture.limit_ns,
            "rms_ns": capture.rms_ns,
            "range_ns": capture.range_ns,
            "findings": capture.findings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        }),
    });
    let lines = report.lines.iter().map(|line| {
        let statistics = &line.statistics;
        json!({
            "line": statistics.name,
            "capture": line.capture,
            "expected": statistics.expected,
            "compared": statistics.compared,
            "moved": statistics.moved,
            "missing": statistics.missing,
            "extra": statistics.extra,
            "mean_ns": statistics.mean_ns,
            "mean_to_sync_ns": line.mean_to_sync_ns,
            "min_ns": statistics.min_ns,
            "max_ns": statistics.max_ns,
        })
    });
    json!({
        "kind": if is_simulated { "simulated" } else { "capture" },
        "board": board.reported_name(),
        "verdict": format!("{:?}", report.verdict).to_lowercase(),
        "captures": captures.collect::<Vec<_>>(),
        "lines": lines.collect::<Vec<_>>(),
        "not_compared": report.not_covered,
    })
}
