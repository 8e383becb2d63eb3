//! Stores the files of an experiment in its record, and reads them back.

use super::error::LaboratoryError;
use super::experiment::{Experiment, WORN};
use hal_sim::input;
use host_core::record::{DeclaredFile, Difference, replace_file, sha256};
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

/// Returns the names of the files, besides the trials, in which a rerun must equal the record. If
/// the record is of an interrupted run (`is_cut`), its result is left out, because it describes the
/// interruption.
#[must_use]
pub const fn compared_files(is_cut: bool) -> &'static [&'static str] {
    match is_cut {
        true => &["draws.csv"],
        false => &["draws.csv", "result.json"],
    }
}

/// Returns the first difference between the record of an experiment and its rerun in `again`, or
/// `None` if they agree. Of an interrupted run (`is_cut`), only the rows that the record contains
/// are compared.
///
/// # Errors
/// Fails if a file cannot be read.
pub fn differs(
    record: &Path,
    again: &Path,
    is_cut: bool,
) -> Result<Option<Difference>, LaboratoryError> {
    for &file in compared_files(is_cut) {
        let (mut recorded, mut other) = (lines(&record.join(file))?, lines(&again.join(file))?);
        if is_cut {
            let count = recorded
                .iter()
                .take_while(|line| line.ends_with('\n'))
                .count();
            recorded.truncate(count);
            other.truncate(count);
        }
        let mut indices = 0..recorded.len().max(other.len());
        if let Some(line) = indices.find(|&line| recorded.get(line) != other.get(line)) {
            let line = line + 1;
            return Ok(Some(Difference {
                trial: None,
                file,
                line,
            }));
        }
    }
    Ok(None)
}

/// Returns the lines of a file with their line ends; empty if the file does not exist.
fn lines(path: &Path) -> Result<Vec<String>, LaboratoryError> {
    match input::read_text(path, input::LONGEST_TABLE) {
        Ok(text) => Ok(text.split_inclusive('\n').map(str::to_owned).collect()),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(LaboratoryError::File(path.display().to_string(), error)),
    }
}

impl Experiment {
    /// Returns names and SHA-256 of the experiment's files, as the plan of a record lists them.
    #[must_use]
    pub fn declared_files(&self) -> Vec<DeclaredFile> {
        let hashes = self.hashes.iter().cloned();
        hashes
            .map(|(file, sha256)| DeclaredFile { file, sha256 })
            .collect()
    }

    /// Copies the experiment's files into the record `dir`.
    ///
    /// # Errors
    /// Fails if a file cannot be written.
    pub fn save_files(&self, dir: &Path) -> Result<(), LaboratoryError> {
        let others = self.sessions.iter().chain(&self.wearers);
        let others = others.map(|(_, text)| text);
        let texts = std::iter::once(&self.text).chain(others);
        for ((place, declared), text) in self.declared_files().iter().enumerate().zip(texts) {
            let path = dir.join(declared.copy_path(place));
            if let Some(folder) = path.parent() {
                let made = fs::create_dir_all(folder);
                made.map_err(|error| LaboratoryError::File(folder.display().to_string(), error))?;
            }
            replace_file(&path, text.as_bytes())?;
        }
        Ok(())
    }

    /// Recreates the experiment from the files in the record `dir`, which must have the SHA-256 in
    /// `declared`.
    ///
    /// # Errors
    /// Fails if a file is missing or its SHA-256 has changed.
    pub fn from_record(dir: &Path, declared: &[DeclaredFile]) -> Result<Self, LaboratoryError> {
        let mut texts = Vec::new();
        for (place, entry) in declared.iter().enumerate() {
            let path = dir.join(entry.copy_path(place));
            let refuse = |reason: String| LaboratoryError::Kept {
                file: path.display().to_string(),
                reason,
            };
            let text = input::read_text(&path, input::LONGEST_TYPED);
            let text = text.map_err(|error| refuse(error.to_string()))?;
            if sha256(text.as_bytes()) != entry.sha256 {
                return Err(refuse(
                    "its SHA-256 differs from that in the record".to_owned(),
                ));
            }
            texts.push((&*entry.file, text));
        }
        let refuse = |reason: &str| LaboratoryError::Kept {
            file: dir.display().to_string(),
            reason: reason.to_owned(),
        };
        let (first, sessions) = texts
            .split_first()
            .ok_or_else(|| refuse("it has no declaration"))?;
        let experiment = Self::new(first.0, &first.1, &|name| {
            let own = sessions.iter().find(|(file, _)| *file == name);
            let own = own.map(|(_, text)| text.clone());
            let other = "its sessions and wearer files are not those that its declaration names";
            own.ok_or_else(|| refuse(other))
        })?;
        let worn = |(file, text): &(&str, String)| {
            let file = file.strip_prefix(WORN)?;
            Some((file.to_owned(), text.clone()))
        };
        match sessions.iter().find_map(worn) {
            Some((file, text)) => experiment.with_wearer(&file, &text),
            None => Ok(experiment),
        }
    }
}
