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
    #[error("E600 the declaration {file} has mistakes: {}", list(mistakes))]
    Declaration {
        /// Name of the declaration file.
        file: String,
        /// All mistakes of the declaration, sorted by line.
        mistakes: Vec<Mistake>,
    },
    /// The sessions of some conditions are invalid.
    #[error(
        "E601 the declaration {file} has invalid conditions: {}",
        list(mistakes)
    )]
    Condition {
        /// Name of the declaration file.
        file: String,
        /// The mistakes of these sessions, each with the names of the conditions that have it.
        mistakes: Vec<Mistake>,
    },
    /// A level, a draw or a grid sets a session field that does not exist, or to a value that no
    /// device would accept.
    #[error(
        "E602 the declaration {file} changes fields wrongly: {}",
        list(mistakes)
    )]
    Fields {
        /// Name of the declaration file.
        file: String,
        /// All mistakes about such fields.
        mistakes: Vec<Mistake>,
    },
    /// The wearer file given on the command line cannot replace that of the session.
    #[error(
        "E663 {file} does not fit this experiment: {why}; give another wearer file, or omit --wearer"
    )]
    NotWorn {
        /// Name of the given wearer file.
        file: String,
        /// Reason why the file cannot be used.
        why: String,
    },
    /// The output folder contains another sweep.
    #[error(
        "E603 {folder} holds {found}, but the command asks for {wanted}; give another --out, \
         or the same arguments"
    )]
    Other {
        folder: String,
        /// Description of the sweep in the folder.
        found: String,
        /// Description of the requested sweep.
        wanted: String,
    },
    /// The given folders are not the complete set of shards of one sweep.
    #[error("E604 these folders are not all shards of one sweep: {0}")]
    Merge(String),
    /// The argument of `--shard` is invalid.
    #[error("E605 --shard is `{0}`; allowed: I/N with 1 ≤ I ≤ N ≤ 10000, as in 3/8")]
    Shard(String),
    /// The simulation of a random wearer failed.
    #[error("E606 the simulation of draw {draw}, condition `{condition}`, failed: {error}")]
    Draw {
        /// Index of the unit, from 0.
        draw: u64,
        condition: String,
        /// Message of the error that ended the simulation.
        error: String,
    },
    /// A file of the sweep cannot be read or written.
    #[error("E607 cannot read or write {0}: {1}; check path, permissions and free space")]
    File(String, std::io::Error),
    /// A file of the sweep contains something that no sweep writes.
    #[error("E608 {file} is damaged: {reason}")]
    Damaged {
        /// Path of the damaged file.
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
        name: String,
        /// Names of all experiments, separated by commas.
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
        /// Number of trials that were started before the end.
        done: usize,
        /// Number of trials in the protocol.
        of: usize,
    },
    /// The protocol keeps one wearer for all trials, but the conditions differ in a property of
    /// wearer or board.
    #[error(
        "E611 protocol: wearer is \"same\", but `{field}` differs between conditions, and one \
         wearer on one board has only one value; give all conditions the same value, or set \
         wearer = \"rested\""
    )]
    Unlike {
        /// The session field that differs.
        field: &'static str,
    },
    /// A stop limit refers to a measurement that no sample of the session contains.
    #[error(
        "E614 protocol: stop uses {0}; the criterion could never stop the protocol: add what is \
         missing to the session, or remove the criterion"
    )]
    Unmet(String),
    /// A unit that was simulated without the device has another result than the same unit with the
    /// whole device.
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
        /// Description of the first difference.
        what: String,
    },
    /// A file in an experiment's record is missing or no longer the one with which the record was
    /// made.
    #[error(
        "E613 {file} differs from what the record was made with: {reason}; use an unchanged copy \
         of the folder"
    )]
    Kept {
        /// Path of the file in the record.
        file: String,
        /// Whether the file is missing or has changed.
        reason: String,
    },
    /// The session that the conditions modify is invalid.
    #[error("{}", .0.lines())]
    Session(#[from] SessionError),
    /// The device for a trial could not be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A trial could not be started.
    #[error(transparent)]
    Begin(#[from] BeginError),
    /// A trial ended early.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The record of a trial could not be written or read.
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

    /// Creates the error for conditions of the declaration `file` whose sessions are invalid.
    /// `refused` contains the name of each such condition and the reason.
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
            let message = format!("{make} that no device would arm: {reason}");
            Mistake::at(None, &message)
        };
        Self::Condition {
            file: file.to_owned(),
            mistakes: reasons.iter().map(mistake).collect(),
        }
    }

    /// Creates the error for a declaration file at `path` that cannot be read.
    pub(crate) fn unreadable(path: &Path, error: &Self) -> Self {
        let message = format!("the file cannot be read: {}", error.reason());
        let file = path.file_name().unwrap_or(path.as_os_str());
        Self::declaration(&file.to_string_lossy(), vec![Mistake::at(None, &message)])
    }

    /// Returns the message for use within another message. The error number is left out if a
    /// session file caused the error.
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

/// Joins all mistakes of a session to one text. Line numbers are left out, because the session was
/// generated and the user has no file in which to look them up.
pub(super) fn describe_mistakes(error: &SessionError) -> String {
    let summaries: Vec<String> = error.errors().map(SessionError::summary).collect();
    summaries.join("\n  ")
}

/// One mistake in a declaration, with its line if that is known.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Mistake {
    line: Option<usize>,
    what: String,
}

impl Mistake {
    /// Creates a mistake in `line`, counted from 1; `None` if the line is unknown.
    #[must_use]
    pub fn at(line: Option<usize>, message: &str) -> Self {
        let text = message.to_owned();
        Self { line, what: text }
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
    let lines: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
    lines.join("\n  ")
}
