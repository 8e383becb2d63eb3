//! What a laboratory refuses.

use host_core::record::RecordError;
use host_core::run::{BeginError, OpenError, RunError};
use host_core::session::SessionError;
use std::fmt;

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
    /// A condition makes no session.
    #[error("E601 the condition `{condition}` makes no session that a device would arm\n{error}")]
    Condition {
        /// Its name.
        condition: String,
        /// What is wrong with its text.
        error: Box<SessionError>,
    },
    /// A field that a condition or a wearer changes is not there to be changed.
    #[error("E602 `{field}` cannot be set: {reason}")]
    Field {
        /// Its dotted path.
        field: String,
        /// Why.
        reason: String,
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
        "E609 no experiment `{name}`; there are {known}, or give a declaration's file, NAME.toml"
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
    /// The session that conditions change.
    #[error(transparent)]
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

    /// Of the whole.
    #[must_use]
    pub fn nowhere(what: String) -> Self {
        Self { line: None, what }
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
