//! Output of `flexor hil`: connections, and the result of a comparison.

use super::expected::pins;
use super::{CaptureFile, Output, Plan};
use crate::cli::board::header_name;
use hil::fit::{Alignment, Report};
use hil::merge::{MergeError, MergedReport};
use host_core::plot::words;
use host_core::record::{DeviceKind, Program, sha256};
use host_core::run::{Board, SessionFile};
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
        if board.pins().breadboard.is_some() {
            let _ = writeln!(text, "{}", DeviceKind::Breadboard.words());
        }
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

/// Largest width of a printed line, columns.
const COLUMNS: u16 = 80;

/// Appends a paragraph in lines of at most 80 columns, indented by `indent` columns, and two more
/// from the second line on.
fn push_wrapped(text: &mut String, indent: usize, paragraph: &str) {
    let room = usize::from(COLUMNS) - indent - 2;
    let wrapped = words::wrap_columns(paragraph, room as u16); // below 80
    for (n, line) in wrapped.lines().enumerate() {
        let indent = indent + if n == 0 { 0 } else { 2 };
        let _ = writeln!(text, "{:indent$}{line}", "");
    }
}

/// Returns the result for people.
#[must_use]
pub fn report(report: &MergedReport, measurement: &Measurement<'_>) -> String {
    let mut text = format!("verdict: {}\n", report.verdict);
    if measurement.is_simulated {
        text.push_str("simulated captures: no evidence about a board\n");
    }
    if measurement.board.pins().breadboard.is_some() {
        let _ = writeln!(text, "{}", DeviceKind::Breadboard.words());
    }
    for (n, capture) in report.captures.iter().enumerate() {
        match capture {
            Err(why) => push_wrapped(&mut text, 0, &why.to_string()),
            Ok(capture) => {
                let line = format!(
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
                push_wrapped(&mut text, 0, &line);
                text.push_str(&coverage(capture));
                for finding in &capture.findings {
                    push_wrapped(&mut text, 2, &finding.to_string());
                }
            }
        }
    }
    if !report.not_covered.is_empty() {
        let lines = format!("not compared: {}", report.not_covered.join(", "));
        push_wrapped(&mut text, 0, &lines);
    }
    text.trim_end().to_owned()
}

/// Returns where a capture lies in the session, and whether it is too short.
fn coverage(capture: &Report) -> String {
    let mut text = String::new();
    let (from, until) = (capture.start_us / 1e3, capture.until_us / 1e3);
    let time = format!(
        "session time {from:.1} to {until:.1} ms{}",
        alignment(capture)
    );
    push_wrapped(&mut text, 2, &time);
    // If the alignment is not unique, the capture may as well begin between two pulses.
    if from < 0.0 && capture.alignment == Alignment::Unique && capture.findings.is_empty() {
        let _ = writeln!(text, "  silent for {:.1} ms before the first pulse", -from);
    }
    if capture.covered_us < capture.needed_us {
        let (covered, needed) = (capture.covered_us / 1e6, capture.needed_us / 1e6);
        let short = format!(
            "incomplete: {covered:.3} s of the session, {needed:.3} s needed; record longer"
        );
        push_wrapped(&mut text, 2, &short);
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

/// Inputs of a comparison.
pub struct Measurement<'a> {
    /// Session that the board ran.
    pub session: &'a SessionFile,
    /// Board that was measured.
    pub board: Board,
    /// Part of the session that each capture must cover, s.
    pub seconds: f64,
    /// Captures in the order of the plan.
    pub files: &'a [CaptureFile],
    /// Line that every capture records.
    pub common: &'a str,
    /// Whether a capture was made by `--rehearse`.
    pub is_simulated: bool,
}

/// Returns the sheet: what was compared, and every number of the comparison.
#[must_use]
pub fn sheet(report: &MergedReport, measurement: &Measurement<'_>) -> Value {
    let captures = measurement.files.iter().zip(&report.captures);
    let captures = captures.map(|(file, capture)| {
        let mut entry = capture_entry(capture);
        entry["file"] = json!(file.path);
        entry["sha256"] = json!(file.sha256);
        entry
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
            "mean_to_common_ns": line.mean_to_common_ns,
            "min_ns": statistics.min_ns,
            "max_ns": statistics.max_ns,
        })
    });
    let session = measurement.session;
    json!({
        "kind": if measurement.is_simulated { "simulated" } else { "capture" },
        "program": Program::current(),
        "board": measurement.board.reported_name(),
        "session": {
            "title": session.session.title,
            "file": session.name,
            "sha256": sha256(session.text.as_bytes()),
        },
        "seconds": measurement.seconds,
        "verdict": report.verdict.to_string().replace(' ', "_"),
        "common_line": measurement.common,
        "captures": captures.collect::<Vec<_>>(),
        "lines": lines.collect::<Vec<_>>(),
        "not_compared": report.not_covered,
    })
}

/// Returns every number of one capture.
fn capture_entry(capture: &Result<Report, MergeError>) -> Value {
    match capture {
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
    }
}
