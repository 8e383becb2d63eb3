//! Three captures of the board, judged together.

use std::io::Cursor;

use crate::common::{board_plan, exact, session};
use hil::capture::{Capture, ReadOptions, read, write};
use hil::fit::{FitOptions, Verdict};
use hil::merge::{MergeError, MergedReport, merge};
use hil::synthesise::{Analyser, Fault, synthesise};

fn analyser(part: usize) -> Analyser {
    Analyser {
        samplerate_hz: 50_000_000,
        clock_ppb: [100_000, -100_000, 20_000][part],
        start_ps: [240_100_000_000, 333_333_333_333, 410_000_000_000][part],
        samples: 50_000 * 300,
        jitter_samples: 1,
        seed: part as u64,
    }
}

/// Captures of the whole plan, through session files.
fn captures(part_with_faults: usize, faults: &[Fault]) -> Vec<Option<Capture>> {
    let expected = session(1, 1_000);
    let plan = board_plan();
    let make = |part: usize| {
        let lines = exact(&expected, &plan.captures[part], 77);
        let faults = if part == part_with_faults {
            faults
        } else {
            &[]
        };
        let capture = synthesise(&lines, &analyser(part), faults).unwrap();
        let mut file = Cursor::new(Vec::new());
        write(&mut file, &capture).unwrap();
        Some(read(file, &ReadOptions::default()).unwrap())
    };
    (0..3).map(make).collect()
}

fn judge(captures: &[Option<Capture>]) -> MergedReport {
    let expected = session(1, 1_000);
    merge(&expected, &board_plan(), captures, &FitOptions::default())
}

#[test]
fn three_captures_cover_the_board() {
    let report = judge(&captures(0, &[]));
    assert_eq!(report.verdict, Verdict::Passed, "{report:?}");
    assert_eq!(report.lines.len(), 20);
    assert!(report.not_covered.is_empty());
    assert!(report.line_spread_ns < 60.0, "{}", report.line_spread_ns);
    assert!(report.largest_ns.abs() <= 139.0 && report.rms_ns < 60.0);
    let names: Vec<&str> = report
        .lines
        .iter()
        .map(|l| l.statistics.name.as_str())
        .collect();
    assert_eq!((names[0], names[19]), ("c1", "a10"));
    assert_eq!(report.lines[19].capture, 3);
}

#[test]
fn a_fault_in_one_capture_fails_the_board() {
    let faults = [Fault::MoveEdge {
        line: 2,
        edge: 30,
        by_ps: 1_000_000,
    }];
    let report = judge(&captures(1, &faults));
    assert_eq!(report.verdict, Verdict::Failed, "{report:?}");
    let findings: Vec<usize> = report
        .captures
        .iter()
        .map(|capture| capture.as_ref().unwrap().findings.len())
        .collect();
    assert_eq!(findings, [0, 1, 0]);
}

#[test]
fn missing_captures_are_not_covered() {
    let mut two = captures(0, &[]);
    two[1] = None;
    let report = judge(&two);
    assert_eq!(report.verdict, Verdict::Incomplete);
    assert_eq!(
        report.not_covered,
        ["a4", "c5", "a5", "c6", "a6", "c7", "a7"]
    );
    assert_eq!(report.captures[1], Err(MergeError::Absent { number: 2 }));
    assert_eq!(judge(&[]).not_covered.len(), 20);
}

#[test]
fn exchanged_files_are_named() {
    let mut files = captures(0, &[]);
    files.swap(0, 2);
    let report = judge(&files);
    assert_ne!(report.verdict, Verdict::Passed);
    // Capture 3 has no probe on input 6, so it cannot be the first; the first fits the third.
    let first = report.captures[0].as_ref().unwrap_err();
    let third = report.captures[2].as_ref().unwrap_err();
    assert_eq!(
        first.to_string(),
        "capture 1: fits the connections of capture 3; exchange the files"
    );
    assert_eq!(*third, MergeError::Exchanged { number: 3, fits: 1 });
}
