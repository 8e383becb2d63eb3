//! What a step found.

/// Counts, and lines for people.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Report {
    /// Tests or checks that passed.
    pub passed: u32,
    /// Those that failed.
    pub failed: u32,
    /// Checks that could not be made here, each named in a line.
    pub skipped: u32,
    /// What a person should read: problems, measured values, notes.
    pub lines: Vec<String>,
}

impl Report {
    /// One check that passed.
    pub fn pass() -> Self {
        Self {
            passed: 1,
            ..Self::default()
        }
    }

    /// One check that failed, and why.
    pub fn fail(lines: Vec<String>) -> Self {
        Self {
            failed: 1,
            lines,
            ..Self::default()
        }
    }

    /// One check that this machine cannot make: which, and why.
    pub fn skip(why: String) -> Self {
        Self {
            skipped: 1,
            lines: vec![format!("skipped {why}")],
            ..Self::default()
        }
    }

    /// One check that could not even be made.
    pub fn from_error(error: anyhow::Error) -> Self {
        Self::fail(vec![format!("{error:#}")])
    }

    /// As the closing line has it: `N passed, N failed`, and what was skipped, if anything.
    pub fn counts(&self) -> String {
        let skipped = match self.skipped {
            0 => String::new(),
            skipped => format!(", {skipped} skipped"),
        };
        format!("{} passed, {} failed{skipped}", self.passed, self.failed)
    }

    /// Adds another step's or check's findings.
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
    }
}
