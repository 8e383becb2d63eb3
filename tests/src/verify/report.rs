//! What a step found.

/// Counts, and lines for people.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Report {
    /// Tests or checks that passed.
    pub passed: u32,
    /// Those that failed.
    pub failed: u32,
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

    /// One check that could not even be made.
    pub fn from_error(error: anyhow::Error) -> Self {
        Self::fail(vec![format!("{error:#}")])
    }

    /// Adds another step's or check's findings.
    pub fn add(&mut self, other: Self) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.lines.extend(other.lines);
    }
}
