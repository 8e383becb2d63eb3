//! Errors of experiments and sweeps.

use host_core::record::RecordError;
use host_core::run::{BeginError, OpenError, RunError};
use host_core::session::{Problem, SessionError};
use host_core::suggestion::did_you_mean;
use std::fmt;
use std::path::Path;

/// Reason why an experiment or a sweep cannot run or continue.
#[derive(Debug, thiserror::Error)]
pub enum LaboratoryError {
    /// The declaration is invalid.
    #[error("E600 {file}: {}", list(mistakes))]
    Declaration {
        /// Name of the declaration file.
        file: String,
        /// Every mistake in the declaration.
        mistakes: Vec<Mistake>,
    },
    /// Conditions yield no valid session.
    #[error("E601 {file}: {}", list(mistakes))]
    Condition {
        /// Name of the declaration file.
        file: String,
        /// The mistakes, each with the names of the conditions that have it.
        mistakes: Vec<Mistake>,
    },
    /// A level, a draw or a grid changes a field that does not exist, or sets a value that no
    /// device would accept.
    #[error("E602 {file}: {}", list(mistakes))]
    Fields {
        /// Name of the declaration file.
        file: String,
        /// Every mistake about the fields.
        mistakes: Vec<Mistake>,
    },
    /// The given wearer file cannot replace the session's.
    #[error("E663 {file} does not fit: {why}; give another wearer file, or omit --wearer")]
    NotWorn {
        /// Name of the wearer file.
        file: String,
        /// Reason for the refusal.
        why: String,
    },
    /// The folder contains another sweep.
    #[error(
        "E603 {folder} holds {found}, but the command asks for {wanted}; give another --out, \
         or the same arguments"
    )]
    Other {
        /// Path of the folder.
        folder: String,
        /// Description of the sweep in the folder.
        found: String,
        /// Description of the requested sweep.
        wanted: String,
    },
    /// The parts of a sweep do not form a whole.
    #[error("E604 these folders are not all shards of one sweep: {0}")]
    Merge(String),
    /// The argument of `--shard` is invalid.
    #[error("E605 --shard is `{0}`; allowed: I/N with 1 ≤ I ≤ N ≤ 10000, as in 3/8")]
    Shard(String),
    /// The simulation of a draw failed.
    #[error("E606 draw {draw}, condition `{condition}`: {error}")]
    Draw {
        /// Index of the draw, from 0.
        draw: u64,
        /// Name of the condition.
        condition: String,
        /// Message of the failure.
        error: String,
    },
    /// A file of the sweep cannot be read or written.
    #[error("E607 {0}: {1}")]
    File(String, std::io::Error),
    /// A file of the sweep has contents that no sweep writes.
    #[error("E608 {file}: {reason}")]
    Damaged {
        /// Path of the file.
        file: String,
        /// Description of the damage.
        reason: String,
    },
    /// E609: the name is neither a shipped experiment nor a declaration file.
    #[error(
        "E609 no experiment `{name}`{}; available: {known}; or give a declaration file, NAME.toml",
        did_you_mean(.name, .known.split(", "))
    )]
    Unknown {
        /// The requested name.
        name: String,
        /// Comma-separated names of all experiments.
        known: String,
    },
    /// The protocol ended before its last trial.
    #[error(
        "E610 the protocol ended after {done} of {of} trials: {why}; the record of these trials \
         is kept"
    )]
    Stopped {
        /// Reason for the early end.
        why: String,
        /// Number of trials that were started.
        done: usize,
        /// Number of trials in the protocol.
        of: usize,
    },
    /// The protocol keeps one wearer, but the conditions need different wearers or boards.
    #[error(
        "E611 protocol: wearer is \"same\", but `{field}` differs between conditions, and one \
         wearer on one board has only one value; give all conditions the same value, or set \
         wearer = \"rested\""
    )]
    Unlike {
        /// The session field that differs.
        field: &'static str,
    },
    /// A stop limit refers to a measurement that the session does not have.
    #[error(
        "E614 protocol: stop uses {0}; the criterion could never stop the protocol: add what is \
         missing to the session, or remove the criterion"
    )]
    Unmet(String),
    /// A unit computed with body and schedule alone differs from the same unit on the whole device.
    #[error(
        "E612 unit {unit}, {condition}: body and schedule alone give a different result than the \
         whole device ({what}); the sweep stops and its results are not reliable; report this \
         error with the declaration"
    )]
    Unequal {
        /// Index of the unit, from 0.
        unit: u64,
        /// Name of the condition.
        condition: String,
        /// The first difference.
        what: String,
    },
    /// A file in an experiment's record differs from the one that was used.
    #[error(
        "E613 {file} differs from what the record was made with: {reason}; use an unchanged copy \
         of the folder"
    )]
    Kept {
        /// Path of the file.
        file: String,
        /// Whether the file is missing or has changed.
        reason: String,
    },
    /// The session that the conditions modify is invalid.
    #[error("{}", .0.lines())]
    Session(#[from] SessionError),
    /// The device could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A trial could not start.
    #[error(transparent)]
    Begin(#[from] BeginError),
    /// A trial ended early.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The record could not be written or read.
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl LaboratoryError {
    /// Creates the error with all mistakes of the declaration `file`, sorted by line.
    pub(super) fn declaration(file: &str, mut mistakes: Vec<Mistake>) -> Self {
        mistakes.sort_by_key(|mistake| mistake.line.unwrap_or(usize::MAX));
        let file = file.to_owned();
        Self::Declaration { file, mistakes }
    }

    /// Creates the error for conditions of the declaration `file` whose sessions no device would
    /// arm. `refused` contains the name of each condition and the reason.
    pub(super) fn conditions(file: &str, refused: Vec<(String, String)>) -> Self {
        let mut reasons: Vec<(String, Vec<String>)> = Vec::new();
        for (name, reason) in refused {
            let name = format!("`{name}`");
            match reasons.iter_mut().find(|(known, _)| *known == reason) {
                Some((_, names)) => names.push(name),
                None => reasons.push((reason, vec![name])),
            }
        }
        let mistake = |(reason, names): &(String, Vec<String>)| {
            let (names, make) = match &names[..] {
                [one] => (one.clone(), "condition {} yields a session"),
                all => (all.join(", "), "conditions {} yield sessions"),
            };
            let make = make.replace("{}", &names);
            let what = format!("{make} that no device would arm: {reason}");
            Mistake::at(None, &what)
        };
        Self::Condition {
            file: file.to_owned(),
            mistakes: reasons.iter().map(mistake).collect(),
        }
    }

    /// Creates the error for a declaration at `path` that cannot be read.
    pub(crate) fn unreadable(path: &Path, error: &Self) -> Self {
        let what = format!("the file cannot be read: {}", error.reason());
        let file = path.file_name().unwrap_or(path.as_os_str());
        Self::declaration(&file.to_string_lossy(), vec![Mistake::at(None, &what)])
    }

    /// Returns the message for use within another message: without an error number if a session
    /// file caused it.
    pub(super) fn reason(&self) -> String {
        match self {
            Self::Session(error) => match error.problem() {
                Problem::Unreadable { reason } => reason.clone(),
                _ => describe_mistakes(error),
            },
            other => other.to_string(),
        }
    }
}

/// Joins every mistake of a session without line numbers, because the text is generated and nobody
/// can look the lines up.
pub(super) fn describe_mistakes(error: &SessionError) -> String {
    let all: Vec<String> = error.errors().map(SessionError::summary).collect();
    all.join("\n  ")
}

/// One mistake in a declaration.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Mistake {
    line: Option<usize>,
    what: String,
}

impl Mistake {
    /// Creates a mistake in `line`, from 1, if the line is known.
    #[must_use]
    pub fn at(line: Option<usize>, what: &str) -> Self {
        let what = what.to_owned();
        Self { line, what }
    }
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "line {line}: {}", self.what),
            None => f.write_str(&self.what),
        }
    }
}

fn list(mistakes: &[Mistake]) -> String {
    let all: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
    all.join("\n  ")
}
