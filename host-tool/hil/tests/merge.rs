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

/// At 24 MS/s a capture that cannot be aligned must not count as one that is only not judged.
#[test]
fn a_dead_or_foreign_capture_at_a_low_rate_is_incomplete() {
    let expected = session(1, 1_000);
    let plan = board_plan();
    let record = |part: usize, period_percent: i64| {
        let mut lines = exact(&expected, &plan.captures[part], 77);
        for edge in lines.iter_mut().flat_map(|line| &mut line.edges) {
            edge.time_ps = edge.time_ps / 100 * period_percent;
        }
        let analyser = Analyser {
            samplerate_hz: 24_000_000,
            samples: 24_000 * 300,
            ..analyser(part)
        };
        synthesise(&lines, &analyser, &[]).unwrap()
    };
    let good: Vec<Option<Capture>> = (0..3).map(|part| Some(record(part, 100))).collect();
    assert_eq!(judge(&good).verdict, Verdict::NotJudged);
    let dead: Vec<Fault> = (0..8)
        .map(|line| Fault::HoldLine { line, high: false })
        .collect();
    let lines = exact(&expected, &plan.captures[1], 77);
    let slow = Analyser {
        samplerate_hz: 24_000_000,
        samples: 24_000 * 300,
        ..analyser(1)
    };
    let dead = synthesise(&lines, &slow, &dead).unwrap();
    for wrong in [dead, record(1, 70)] {
        let mut captures = good.clone();
        captures[1] = Some(wrong);
        let report = judge(&captures);
        assert!(report.captures[1].is_err(), "{report:?}");
        assert_eq!(report.verdict, Verdict::Incomplete, "{report:?}");
    }
    let mut absent = good;
    absent[2] = None;
    assert_eq!(judge(&absent).verdict, Verdict::Incomplete);
}

/// A fault that does not depend on the resolution fails at every rate.
#[test]
fn a_missing_pulse_at_a_low_rate_fails() {
    let expected = session(1, 1_000);
    let plan = board_plan();
    let captures: Vec<Option<Capture>> = (0..3)
        .map(|part| {
            let lines = exact(&expected, &plan.captures[part], 77);
            let slow = Analyser {
                samplerate_hz: 24_000_000,
                samples: 24_000 * 300,
                ..analyser(part)
            };
            let missing = [Fault::DropEdge { line: 2, edge: 30 }];
            let faults = if part == 1 { &missing[..] } else { &[] };
            Some(synthesise(&lines, &slow, faults).unwrap())
        })
        .collect();
    assert_eq!(judge(&captures).verdict, Verdict::Failed);
}

/// A session may leave channels unused: their lines must be quiet, and are covered by that. The
/// common line aligns the captures in which nothing else moves.
#[test]
fn lines_without_predicted_edges_must_be_quiet() {
    let mut expected = session(1, 1_000);
    for line in &mut expected.lines {
        if !["c1", "a1"].contains(&line.name.as_str()) {
            line.edges_us.clear();
        }
    }
    let names = expected.lines.iter().map(|line| line.name.clone());
    let others: Vec<String> = names.filter(|name| name != "a1").collect();
    let plan = hil::plan::plan(&others, "a1", 8).unwrap();
    let record = |faults: &[Fault]| -> Vec<Option<Capture>> {
        (0..3)
            .map(|part| {
                let lines = exact(&expected, &plan.captures[part], 77);
                let faults = if part == 1 { faults } else { &[] };
                Some(synthesise(&lines, &analyser(part), faults).unwrap())
            })
            .collect()
    };
    let judge =
        |captures: &[Option<Capture>]| merge(&expected, &plan, captures, &FitOptions::default());
    let good = judge(&record(&[]));
    assert_eq!(good.verdict, Verdict::Passed, "{good:?}");
    assert!(good.not_covered.is_empty(), "{:?}", good.not_covered);
    let pulse = Fault::AddPulse {
        line: 3,
        time_ps: 500_000_000_000,
        width_ps: 200_000_000,
    };
    for fault in [
        pulse,
        Fault::HoldLine {
            line: 3,
            high: true,
        },
    ] {
        let wrong = judge(&record(&[fault]));
        assert_eq!(wrong.verdict, Verdict::Failed, "{fault:?}");
    }
    // Without its only moving line, a capture shows nothing.
    let dead = judge(&record(&[Fault::HoldLine {
        line: 7,
        high: false,
    }]));
    assert_eq!(dead.verdict, Verdict::Incomplete, "{dead:?}");
}
