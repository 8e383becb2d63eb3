//! Ending of a run, which `summary.json` contains from the first moment of the run on.

use super::damage::{TrialCounts, is_lost};
use super::disk::replace_file_on;
use super::{RecordError, Run};
use crate::disk::Disk;
use hal_sim::input;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// How a run ended. While a run is in progress its record says "incomplete", so that a program that
/// is killed leaves a correct record.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Ending {
    /// Whether the run ended by itself, as its session or experiment says.
    pub status: Completeness,
    /// Why the run was cut short, with the number of the error. For a complete run, which result
    /// could not be written. `None` if nothing was lost, or if the program could not write a
    /// reason.
    pub reason: Option<String>,
    /// Exit code of the program: 0 for a complete run with all its results, 130 for SIGINT, 143 for
    /// SIGTERM. `None` if the program could not write it.
    pub exit_code: Option<u8>,
}

/// Whether a run ended by itself, as its session or experiment says.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Completeness {
    /// The run was carried out to its end.
    Complete,
    /// The run was cut short, or is still in progress.
    #[default]
    Incomplete,
}

impl Ending {
    /// Returns the ending of a run that was carried out to its end and lost nothing.
    #[must_use]
    pub const fn complete() -> Self {
        Self {
            status: Completeness::Complete,
            reason: None,
            exit_code: Some(0),
        }
    }

    /// Returns the ending of a run that was carried out to its end, but whose page or another file
    /// could not be written. `lost` describes that file.
    #[must_use]
    pub const fn complete_with_loss(lost: String) -> Self {
        Self {
            status: Completeness::Complete,
            reason: Some(lost),
            exit_code: Some(1),
        }
    }

    /// Reads the ending from the record in `dir`; if it cannot be read, the run counts as
    /// incomplete.
    #[must_use]
    pub fn load(dir: &Path) -> Self {
        read(dir).map_or_else(|_| Self::default(), |pair| pair.0)
    }

    /// Returns the ending of a run that was cut short by `reason`, after which the program exits
    /// with `exit_code`.
    #[must_use]
    pub const fn cut_short(reason: String, exit_code: u8) -> Self {
        Self {
            status: Completeness::Incomplete,
            reason: Some(reason),
            exit_code: Some(exit_code),
        }
    }

    /// Returns whether the run was cut short or is still in progress.
    #[must_use]
    pub fn is_incomplete(&self) -> bool {
        self.status == Completeness::Incomplete
    }

    /// Returns a warning for the first line of a report page; `None` for a complete run.
    #[must_use]
    pub fn headline(&self) -> Option<String> {
        let why = match &self.reason {
            _ if !self.is_incomplete() => return None,
            Some(reason) => reason.trim_end_matches('.'),
            None => {
                "the reason was not recorded: the program was killed, lost its disk, or still runs"
            }
        };
        Some(format!("Incomplete: {why}."))
    }
}

/// Content of `summary.json` while a run is in progress.
#[derive(Serialize)]
struct Beginning<'a> {
    title: &'a str,
    device: &'a str,
    seed: Option<u64>,
    version: &'a str,
    #[serde(flatten)]
    ending: Ending,
}

/// Writes the first `summary.json` of a run, which says that the run is incomplete.
pub(super) fn write_initial_summary(
    disk: &dyn Disk,
    dir: &Path,
    run: &Run,
) -> Result<(), RecordError> {
    let beginning = Beginning {
        title: &run.title,
        device: &run.device,
        seed: run.seed,
        version: env!("CARGO_PKG_VERSION"),
        ending: Ending::default(),
    };
    write_summary(disk, dir, &beginning)
}

/// Replaces `summary.json` on `disk` as a whole.
///
/// # Errors
/// The file cannot be written; the old file stays.
pub fn write_summary(
    disk: &dyn Disk,
    dir: &Path,
    summary: &impl Serialize,
) -> Result<(), RecordError> {
    let path = dir.join("summary.json");
    let text = serde_json::to_string_pretty(summary).map_err(std::io::Error::from);
    let text = text.map_err(RecordError::write(&path))?;
    replace_file_on(disk, &path, (text + "\n").as_bytes())
}

/// Reads from `summary.json` how the run ended and how many rows its trials had. A run without this
/// file, or with a file that lacks this information, counts as incomplete.
///
/// # Errors
/// The path is not a regular file, or cannot be read.
pub(super) fn read(dir: &Path) -> Result<(Ending, Vec<TrialCounts>), RecordError> {
    #[derive(Default, Deserialize)]
    struct Counts {
        #[serde(default)]
        trials: Vec<TrialCounts>,
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
