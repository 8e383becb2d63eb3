//! Detects data that a record has lost since it was closed; `summary.json` keeps how many trials
//! and rows there were.

use super::disk::trial_folder;
use super::{RecordError, Run, Trial, sha256};
use crate::session::KEPT_AS;
use hal_sim::input;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Number of rows that a trial had when its run was closed. A later difference means that data were
/// lost.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct RowCounts {
    /// Number of rows in `samples.csv`, without the header.
    #[serde(rename = "sample_rows")]
    pub samples: usize,
    /// Number of rows in `edges.csv`, without the header.
    #[serde(rename = "edge_rows")]
    pub edges: usize,
}

impl RowCounts {
    /// Counts the rows of a trial in memory.
    #[must_use]
    pub const fn from_trial(trial: &Trial) -> Self {
        Self {
            samples: trial.samples.len(),
            edges: trial.edges.len(),
        }
    }
}

/// A trial as `summary.json` lists it. Records of earlier versions do not have the numbers of rows.
#[derive(Deserialize)]
pub(super) struct TrialCounts {
    name: String,
    #[serde(flatten)]
    held: Option<RowCounts>,
}

impl Run {
    /// Returns the error that describes how the record in `dir` has changed since it was closed;
    /// `None` if the record is unchanged.
    #[must_use]
    pub fn damage_error(&self, dir: &Path) -> Option<RecordError> {
        let description = self.damage.join("; ");
        (!description.is_empty()).then(|| RecordError::Damaged(dir.to_owned(), description))
    }

    /// Returns a warning for the first line of a report page: which data the record has lost, and
    /// why the run ended early. `None` for a complete and undamaged record.
    #[must_use]
    pub fn caveat(&self) -> Option<String> {
        let lost =
            (!self.damage.is_empty()).then(|| format!("Damaged: {}.", self.damage.join("; ")));
        let sentences: Vec<String> = lost.into_iter().chain(self.ending.headline()).collect();
        (!sentences.is_empty()).then(|| sentences.join(" "))
    }
}

/// Compares the trials that `summary.json` lists (`counted`) with the folders and numbers of rows
/// that were read (`found`). Returns one phrase for each difference.
pub(super) fn find_damage(
    dir: &Path,
    counted: &[TrialCounts],
    found: &[(PathBuf, RowCounts)],
) -> Vec<String> {
    let messages = counted.iter().enumerate().flat_map(|(position, trial)| {
        let folder = trial_folder(dir, position, &trial.name);
        match found.iter().find(|(known, _)| *known == folder) {
            None => vec![describe_absent_trial(&folder)],
            Some((_, now)) => {
                let held = trial.held.iter();
                held.flat_map(|held| row_differences(&folder, held, now))
                    .collect()
            }
        }
    });
    let known = |folder: &PathBuf| {
        let mut names = counted.iter().enumerate();
        names.any(|(position, trial)| trial_folder(dir, position, &trial.name) == *folder)
    };
    let added = found.iter().filter(|(folder, _)| !known(folder));
    let added = added.map(|(folder, _)| format!("the folder {} was added", file_name(folder)));
    messages.chain(added).collect()
}

/// Compares the SHA-256 of a trial's session file and wearer file with those at the time of the
/// run, and describes each file that differs. The text of an altered session file is removed from
/// `trial`, because numbers that are computed with its pulse width or rate would be wrong.
pub(super) fn altered_files(folder: &Path, trial: &mut Trial) -> Vec<String> {
    let mut altered = Vec::new();
    let mut tell = |name: &str, text: &str| {
        let problem = match text.is_empty() {
            true => "is missing",
            false => "was changed after the run",
        };
        altered.push(format!("{}/{name} {problem}", file_name(folder)));
    };
    let is_other = |sum: &str, text: &str| sum != sha256(text.as_bytes());
    let session_sum = trial.session_sha256.as_deref();
    if session_sum.is_some_and(|sum| is_other(sum, &trial.session_text)) {
        tell("session.toml", &trial.session_text);
        trial.session_text.clear();
    }
    if let Some(wearer) = &trial.wearer
        && is_other(&wearer.sha256, &wearer.text)
    {
        tell(KEPT_AS, &wearer.text);
    }
    altered
}

/// Returns the phrase for a trial whose folder is missing or has no `trial.json`.
fn describe_absent_trial(folder: &Path) -> String {
    match folder.is_dir() {
        false => format!("the folder {} is missing", file_name(folder)),
        true => format!("{}/trial.json is missing", file_name(folder)),
    }
}

fn row_differences(folder: &Path, held: &RowCounts, now: &RowCounts) -> Vec<String> {
    let files = [
        ("samples.csv", held.samples, now.samples),
        ("edges.csv", held.edges, now.edges),
    ];
    let differing = files.into_iter().filter(|(_, held, now)| held != now);
    let messages = differing.filter_map(|(file, held, now)| {
        let path = folder.join(file);
        // A missing samples.csv was already reported when it was read.
        let name = format!("{}/{file}", file_name(folder));
        match path.is_file() {
            true => Some(format!("{name} has {now} of {held} rows")),
            false if file == "samples.csv" => None,
            false => Some(format!("{name} is missing")),
        }
    });
    messages.collect()
}

/// Returns the phrase for a missing file that every trial has, or `None` if the file exists.
///
/// # Errors
/// The file exists but cannot be opened.
pub(super) fn describe_missing_file(path: &Path) -> Result<Option<String>, RecordError> {
    match input::open(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            let folder = path.parent().unwrap_or(path);
            Ok(Some(format!(
                "{}/{} is missing",
                file_name(folder),
                file_name(path)
            )))
        }
        opened => opened.map(|_| None).map_err(RecordError::io(path)),
    }
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Returns whether an error means that a file is missing or is not text. Such a file is lost or
/// damaged, but the rest of the record can still be shown.
pub(super) fn is_lost(why: &std::io::Error) -> bool {
    use std::io::ErrorKind::{InvalidData, NotFound};
    matches!(why.kind(), NotFound | InvalidData)
}
