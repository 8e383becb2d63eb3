//! What a record has lost since it was closed: `summary.json` keeps how many
//! trials and rows there were.

use super::disk::trial_folder;
use super::{RecordError, Run, Trial, sha256};
use crate::session::KEPT_AS;
use hal_sim::input;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// How much a trial held when its run was closed.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Held {
    /// Rows of `samples.csv` without the header.
    #[serde(rename = "sample_rows")]
    pub samples: usize,
    /// Rows of `edges.csv` without the header.
    #[serde(rename = "edge_rows")]
    pub edges: usize,
}

impl Held {
    /// Of a trial in memory.
    #[must_use]
    pub const fn by(trial: &Trial) -> Self {
        Self {
            samples: trial.samples.len(),
            edges: trial.edges.len(),
        }
    }
}

/// What `summary.json` says of a trial; rows since there are counts of them.
#[derive(Deserialize)]
pub(super) struct Counted {
    name: String,
    #[serde(flatten)]
    held: Option<Held>,
}

impl Run {
    /// That the record in `dir` is not what was closed; nothing for a whole one.
    #[must_use]
    pub fn damaged(&self, dir: &Path) -> Option<RecordError> {
        let what = self.damage.join("; ");
        (!what.is_empty()).then(|| RecordError::Damaged(dir.to_owned(), what))
    }

    /// For the first line of a page: what is missing of it, and what cut it
    /// short. Nothing for a complete and whole one.
    #[must_use]
    pub fn caveat(&self) -> Option<String> {
        let lost =
            (!self.damage.is_empty()).then(|| format!("Damaged: {}.", self.damage.join("; ")));
        let both: Vec<String> = lost.into_iter().chain(self.ending.headline()).collect();
        (!both.is_empty()).then(|| both.join(" "))
    }
}

/// What is missing or more than it was: `counted` by `summary.json` against
/// `found`, the trials' folders and what was read of them.
pub(super) fn of(dir: &Path, counted: &[Counted], found: &[(PathBuf, Held)]) -> Vec<String> {
    let each = counted.iter().enumerate().flat_map(|(position, trial)| {
        let folder = trial_folder(dir, position, &trial.name);
        match found.iter().find(|(known, _)| *known == folder) {
            None => vec![absent(&folder)],
            Some((_, now)) => {
                let held = trial.held.iter();
                held.flat_map(|held| rows(&folder, held, now)).collect()
            }
        }
    });
    let known = |folder: &PathBuf| {
        let mut names = counted.iter().enumerate();
        names.any(|(position, trial)| trial_folder(dir, position, &trial.name) == *folder)
    };
    let added = found.iter().filter(|(folder, _)| !known(folder));
    let added = added.map(|(folder, _)| format!("the folder {} was added", last(folder)));
    each.chain(added).collect()
}

/// Files of a trial that are not those it was run with, by their SHA-256. A session file that
/// is another is left out: its width or rate would make numbers that were never played.
pub(super) fn altered(folder: &Path, trial: &mut Trial) -> Vec<String> {
    let mut altered = Vec::new();
    let mut tell = |name: &str, text: &str| {
        let what = match text.is_empty() {
            true => "is missing",
            false => "was changed since it was run",
        };
        altered.push(format!("{}/{name} {what}", last(folder)));
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

/// Of a trial whose folder is not that of a trial any more.
fn absent(folder: &Path) -> String {
    match folder.is_dir() {
        false => format!("the folder {} is missing", last(folder)),
        true => format!("{}/trial.json is missing", last(folder)),
    }
}

fn rows(folder: &Path, held: &Held, now: &Held) -> Vec<String> {
    let both = [
        ("samples.csv", held.samples, now.samples),
        ("edges.csv", held.edges, now.edges),
    ];
    let differing = both.into_iter().filter(|(_, held, now)| held != now);
    let told = differing.filter_map(|(file, held, now)| {
        let path = folder.join(file);
        // A missing samples.csv is told where it was to be read.
        let name = format!("{}/{file}", last(folder));
        match path.is_file() {
            true => Some(format!("{name} has {now} of {held} rows")),
            false if file == "samples.csv" => None,
            false => Some(format!("{name} is missing")),
        }
    });
    told.collect()
}

/// That a file which every trial has is missing; nothing if it is there.
///
/// # Errors
/// It is there, and cannot be opened.
pub(super) fn missing(path: &Path) -> Result<Option<String>, RecordError> {
    match input::open(path) {
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            let folder = path.parent().unwrap_or(path);
            Ok(Some(format!("{}/{} is missing", last(folder), last(path))))
        }
        opened => opened.map(|_| None).map_err(RecordError::io(path)),
    }
}

fn last(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// Whether a file is missing or no text: lost or damaged, but harmless to look at.
pub(super) fn is_lost(why: &std::io::Error) -> bool {
    use std::io::ErrorKind::{InvalidData, NotFound};
    matches!(why.kind(), NotFound | InvalidData)
}
