//! How a run ended: in `summary.json` from its first moment on.

use super::damage::{Counted, is_lost};
use super::disk::replace;
use super::{RecordError, Run};
use crate::disk::FileSystem;
use hal_sim::input;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How a run ended. Until somebody says otherwise it is incomplete, so that a
/// run that was killed says so by itself.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Ending {
    /// Whether it came to its own end.
    pub status: Completeness,
    /// What cut it short, with the error's number; of a complete run what was lost
    /// of its results. `None` where nobody could write it any more, and where
    /// nothing was lost.
    pub reason: Option<String>,
    /// What the program exited with: 0 for a complete run with all its results,
    /// 130 for SIGINT, 143 for SIGTERM; `None` where nobody could write it any more.
    pub exit_code: Option<u8>,
}

/// Whether a run came to its own end.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Completeness {
    /// It did.
    Complete,
    /// It was cut short, or still runs.
    #[default]
    Incomplete,
}

impl Ending {
    /// It came to its own end.
    #[must_use]
    pub const fn complete() -> Self {
        Self {
            status: Completeness::Complete,
            reason: None,
            exit_code: Some(0),
        }
    }

    /// It came to its own end, but not all that was asked for could be written:
    /// the page, or a file beside the record.
    #[must_use]
    pub const fn complete_but(lost: String) -> Self {
        Self {
            status: Completeness::Complete,
            reason: Some(lost),
            exit_code: Some(1),
        }
    }

    /// What the record in `dir` says of itself.
    #[must_use]
    pub fn of(dir: &Path) -> Self {
        read(dir).map_or_else(|_| Self::default(), |pair| pair.0)
    }

    /// `reason` cut it short, and the program exits with `exit_code`.
    #[must_use]
    pub const fn cut_short(reason: String, exit_code: u8) -> Self {
        Self {
            status: Completeness::Incomplete,
            reason: Some(reason),
            exit_code: Some(exit_code),
        }
    }

    /// Whether it was cut short, or still runs.
    #[must_use]
    pub fn is_incomplete(&self) -> bool {
        self.status == Completeness::Incomplete
    }

    /// For the first line of a page: nothing for a complete run.
    #[must_use]
    pub fn headline(&self) -> Option<String> {
        let why = match &self.reason {
            _ if !self.is_incomplete() => return None,
            Some(reason) => reason.trim_end_matches('.'),
            None => {
                "nothing was written of why: the program was killed, lost its disk, or still runs"
            }
        };
        Some(format!("Incomplete: {why}."))
    }
}

/// What `summary.json` says while a run is under way.
#[derive(Serialize)]
struct Beginning<'a> {
    title: &'a str,
    device: &'a str,
    seed: Option<u64>,
    version: &'a str,
    #[serde(flatten)]
    ending: Ending,
}

/// Writes the `summary.json` of a run that has only begun.
pub(super) fn begin(dir: &Path, run: &Run) -> Result<(), RecordError> {
    let beginning = Beginning {
        title: &run.title,
        device: &run.device,
        seed: run.seed,
        version: env!("CARGO_PKG_VERSION"),
        ending: Ending::default(),
    };
    write_summary(dir, &beginning)
}

/// Replaces `summary.json` as a whole.
///
/// # Errors
/// It cannot be written; the old one stays.
pub fn write_summary(dir: &Path, summary: &impl Serialize) -> Result<(), RecordError> {
    let path = dir.join("summary.json");
    let text = serde_json::to_string_pretty(summary).map_err(std::io::Error::from);
    let text = text.map_err(RecordError::write(&path))?;
    replace(&FileSystem, &path, (text + "\n").as_bytes())
}

/// What `summary.json` says: how the run ended, and what its trials held. Without
/// one, or where it does not say, nobody came as far as writing it.
///
/// # Errors
/// It is no regular file, or cannot be read.
pub(super) fn read(dir: &Path) -> Result<(Ending, Vec<Counted>), RecordError> {
    #[derive(Default, Deserialize)]
    struct Counts {
        #[serde(default)]
        trials: Vec<Counted>,
    }
    let path = dir.join("summary.json");
    let text = match input::read_text(&path, input::LONGEST_DOCUMENT) {
        Err(why) if is_lost(&why) => String::new(),
        read => read.map_err(RecordError::io(&path))?,
    };
    let ending = serde_json::from_str(&text).unwrap_or_default();
    let counts: Counts = serde_json::from_str(&text).unwrap_or_default();
    Ok((ending, counts.trials))
}
