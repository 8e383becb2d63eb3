//! Result of a step.

/// Counts of checks, and lines for people.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Report {
    /// Number of tests or checks that passed.
    pub passed: u32,
    /// Number of tests or checks that failed.
    pub failed: u32,
    /// Number of checks that could not run here, each named in a line.
    pub skipped: u32,
    /// Lines for people: problems, measured values, notes.
    pub lines: Vec<String>,
}

impl Report {
    /// Returns one passed check.
    pub fn pass() -> Self {
        Self {
            passed: 1,
            ..Self::default()
        }
    }

    /// Returns one failed check with its reason.
    pub fn fail(lines: Vec<String>) -> Self {
        Self {
            failed: 1,
            lines,
            ..Self::default()
        }
    }

    /// Returns one check that this machine cannot run, with its name and the reason.
    pub fn skip(why: String) -> Self {
        Self {
            skipped: 1,
            lines: vec![format!("skipped {why}")],
            ..Self::default()
        }
    }

    /// Returns one failed check that could not run because of `error`.
    pub fn from_error(error: anyhow::Error) -> Self {
        Self::fail(vec![format!("{error:#}")])
    }

    /// Returns the counts for the closing line: `N passed, N failed`, and skipped checks, if any.
    pub fn counts(&self) -> String {
        let skipped = match self.skipped {
            0 => String::new(),
            skipped => format!(", {skipped} skipped"),
        };
        format!("{} passed, {} failed{skipped}", self.passed, self.failed)
    }

    /// Counts skipped checks as failures.
    pub fn fail_skipped(&mut self) {
        self.failed += std::mem::take(&mut self.skipped);
    }

    /// Adds the result of another step or check.
    pub fn add(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.skipped += other.skipped;
        self.lines.extend(other.lines);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_skipped_is_counted_apart() {
        let mut report = Report::pass();
        assert_eq!(report.counts(), "1 passed, 0 failed");
        report.add(Report::skip("x".to_owned()));
        assert_eq!(report.counts(), "1 passed, 0 failed, 1 skipped");
        report.fail_skipped();
        assert_eq!(report.counts(), "1 passed, 1 failed");
    }
}
