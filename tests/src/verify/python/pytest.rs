//! Options and output of pytest.

use crate::verify::command::Finished;
use crate::verify::report::Report;

/// Plain output that ends with failed tests and the reason of each skipped test; no cache in the
/// source tree.
pub(super) const OPTIONS: [&str; 5] = ["-q", "-rfEs", "--color=no", "-p", "no:cacheprovider"];

/// Judges a run of pytest by the counts in its last line.
pub(super) fn judge(finished: Finished) -> Report {
    let last = finished.lines.iter().rev().find(|line| !line.is_empty());
    let Some(mut report) = last.and_then(|line| parse_counts(line)) else {
        let mut report = finished.report("pytest");
        if report.failed == 0 {
            report = Report::fail(vec!["pytest did not print how many tests ran".to_owned()]);
        }
        return report;
    };
    report.lines = match finished.success && report.failed == 0 {
        true => {
            let is_shown = |line: &&String| line.starts_with("SKIPPED ");
            let skipped = finished.lines.iter().filter(is_shown);
            let skipped = skipped.map(|line| format!("skipped python: {line}"));
            let counts = last.map(|line| format!("pytest: {line}"));
            skipped.chain(counts).collect()
        }
        false => finished.lines.clone(),
    };
    if !finished.success && report.failed == 0 {
        report.failed = 1; // it was interrupted, or ended with an internal error
    }
    report
}

/// Parses `1 failed, 2 passed, 1 skipped, 1 warning in 0.12s`. An expected failure is a passed
/// test, an error outside a test a failed one. Returns `None` for any other line.
fn parse_counts(line: &str) -> Option<Report> {
    let line = line.trim_matches(['=', ' ']);
    let (counts, _) = line.rsplit_once(" in ")?;
    let mut report = Report::default();
    for part in counts.split(", ") {
        let (count, kind) = part.split_once(' ')?;
        let count: u32 = count.parse().ok()?;
        match kind {
            "passed" | "xfailed" | "xpassed" => report.passed += count,
            "failed" | "error" | "errors" => report.failed += count,
            "skipped" => report.skipped += count,
            _ => {}
        }
    }
    Some(report)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judged(success: bool, lines: &[&str]) -> Report {
        let lines = lines.iter().map(|line| (*line).to_owned()).collect();
        judge(Finished { success, lines })
    }

    fn counts(report: &Report) -> (u32, u32, u32) {
        (report.passed, report.failed, report.skipped)
    }

    #[test]
    fn the_last_line_has_the_counts() {
        let reason = "SKIPPED [1] tests/test_limb.py:3: could not import 'mujoco'";
        let last = "3 passed, 1 skipped, 2 warnings in 61.20s (0:01:01)";
        let report = judged(true, &["...s", reason, last]);
        assert_eq!(counts(&report), (3, 0, 1));
        let expected = [
            format!("skipped python: {reason}"),
            format!("pytest: {last}"),
        ];
        assert_eq!(report.lines, expected);
        let line = "=== 1 failed, 2 passed, 1 xfailed, 2 errors in 0.12s ===";
        let report = judged(false, &["E  assert 1 == 2", line]);
        assert_eq!(counts(&report), (3, 3, 0));
        assert_eq!(report.lines, ["E  assert 1 == 2", line]);
    }

    #[test]
    fn a_run_without_counts_or_success_is_a_failure() {
        assert_eq!(
            counts(&judged(false, &["no tests ran in 0.01s"])),
            (0, 1, 0)
        );
        assert_eq!(counts(&judged(true, &["something else"])), (0, 1, 0));
        assert_eq!(counts(&judged(false, &["2 passed in 0.10s"])), (2, 1, 0));
    }
}
