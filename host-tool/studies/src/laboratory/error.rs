//! What a laboratory refuses.

use host_core::record::RecordError;
use host_core::run::{BeginError, OpenError, RunError};
use host_core::session::{Problem, SessionError};
use host_core::suggestion::did_you_mean;
use std::fmt;
use std::path::Path;

/// Why an experiment or a sweep does not go on.
#[derive(Debug, thiserror::Error)]
pub enum LaboratoryError {
    /// The declaration is none.
    #[error("E600 {file}: {}", list(mistakes))]
    Declaration {
        /// Its file.
        file: String,
        /// Everything that is wrong.
        mistakes: Vec<Mistake>,
    },
    /// Conditions make no session.
    #[error("E601 {file}: {}", list(mistakes))]
    Condition {
        /// The declaration's file.
        file: String,
        /// What is wrong, with the names of those that it is wrong with.
        mistakes: Vec<Mistake>,
    },
    /// Fields that a level, a draw or a grid changes are not there to be changed, or
    /// become what no device would arm.
    #[error("E602 {file}: {}", list(mistakes))]
    Fields {
        /// The declaration's file.
        file: String,
        /// All of them.
        mistakes: Vec<Mistake>,
    },
    /// Another wearer cannot take the place of a session's.
    #[error("E663 {file}: {why}; give a file that fits, or leave --wearer out")]
    NotWorn {
        /// The wearer's file.
        file: String,
        /// Why not.
        why: String,
    },
    /// A folder holds a sweep of something else.
    #[error(
        "E603 {folder} holds {found}, this is {wanted}; give another --out, or the same arguments"
    )]
    Other {
        /// Where.
        folder: String,
        /// What is there.
        found: String,
        /// What was asked.
        wanted: String,
    },
    /// Parts do not make a whole.
    #[error("E604 the parts do not make a whole: {0}")]
    Merge(String),
    /// A shard that cannot be.
    #[error("E605 --shard is `{0}`, wanted I/N with 1 ≤ I ≤ N ≤ 10000, as 3/8")]
    Shard(String),
    /// A draw's device failed.
    #[error("E606 draw {draw}, {condition}: {error}")]
    Draw {
        /// From 0.
        draw: u64,
        /// Its name.
        condition: String,
        /// What happened.
        error: String,
    },
    /// A file of the sweep.
    #[error("E607 {0}: {1}")]
    File(String, std::io::Error),
    /// A file of the sweep says what no sweep writes.
    #[error("E608 {file}: {reason}")]
    Damaged {
        /// Which.
        file: String,
        /// What.
        reason: String,
    },
    /// No such experiment.
    #[error(
        "E609 no experiment `{name}`{}; there are {known}, or give a declaration's file, NAME.toml",
        did_you_mean(.name, .known.split(", "))
    )]
    Unknown {
        /// As asked.
        name: String,
        /// What there is.
        known: String,
    },
    /// A protocol that ended before its last trial.
    #[error(
        "E610 the protocol ended after {done} of {of} trials: {why}; what was recorded is kept"
    )]
    Stopped {
        /// What ended it.
        why: String,
        /// Trials begun.
        done: usize,
        /// Trials declared.
        of: usize,
    },
    /// Conditions of one wearer that one wearer cannot wear.
    #[error(
        "E611 protocol: wearer is \"same\", but `{field}` differs between conditions: one wearer \
         and one board cannot have both; set it alike, or say wearer = \"rested\""
    )]
    Unlike {
        /// Of their sessions.
        field: &'static str,
    },
    /// Stop criteria that nothing is held against.
    #[error(
        "E614 protocol: stop says {0}; it would never stop: add it to the session, or leave the \
         criterion out"
    )]
    Unmet(String),
    /// A draw that is not what it is on the whole device.
    #[error(
        "E612 unit {unit}, {condition}: body and schedule alone are not the whole device: {what} \
         differs; the sweep stops, and what was drawn this way is not to be trusted: report it \
         with the declaration"
    )]
    Unequal {
        /// From 0.
        unit: u64,
        /// Its name.
        condition: String,
        /// What differs first.
        what: String,
    },
    /// A file that an experiment's record keeps is not what was declared.
    #[error(
        "E613 {file} is not what was declared when the record was made: {reason}; take the folder \
         from where it was kept unchanged"
    )]
    Kept {
        /// Where.
        file: String,
        /// It is missing, or another.
        reason: String,
    },
    /// The session that conditions change.
    #[error("{}", .0.lines())]
    Session(#[from] SessionError),
    /// No device.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A trial could not begin.
    #[error(transparent)]
    Begin(#[from] BeginError),
    /// A trial ended early.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The record.
    #[error(transparent)]
    Record(#[from] RecordError),
}

impl LaboratoryError {
    /// Everything that is wrong with the declaration `file`, by line.
    pub(super) fn declaration(file: &str, mut mistakes: Vec<Mistake>) -> Self {
        mistakes.sort_by_key(|mistake| mistake.line.unwrap_or(usize::MAX));
        let file = file.to_owned();
        Self::Declaration { file, mistakes }
    }

    /// That no device would arm what comes of these conditions of the declaration
    /// `file`: of each its name and why.
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
                [one] => (one.clone(), "condition {} makes"),
                all => (all.join(", "), "conditions {} make"),
            };
            let make = make.replace("{}", &names);
            let what = format!("the {make} no session that a device would arm: {reason}");
            Mistake::at(None, &what)
        };
        Self::Condition {
            file: file.to_owned(),
            mistakes: reasons.iter().map(mistake).collect(),
        }
    }

    /// That no declaration can be read at `path`.
    pub(crate) fn unreadable(path: &Path, error: &Self) -> Self {
        let what = format!("it cannot be read: {}", error.reason());
        let file = path.file_name().unwrap_or(path.as_os_str());
        Self::declaration(&file.to_string_lossy(), vec![Mistake::at(None, &what)])
    }

    /// As part of another message: without a number, where it is a file's.
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

/// Every mistake of a session, without its place in a text that nobody wrote.
pub(super) fn describe_mistakes(error: &SessionError) -> String {
    let all: Vec<String> = error.errors().map(SessionError::summary).collect();
    all.join("\n  ")
}

/// One thing that is wrong with a declaration.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Mistake {
    line: Option<usize>,
    what: String,
}

impl Mistake {
    /// In this line, from 1, if one is known.
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
