//! Names of the folders in a record, and replacement of its files.

use super::RecordError;
use crate::disk::{Disk, FileSystem};
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Replaces a file as a whole.
///
/// # Errors
/// The file cannot be written; the old file stays.
pub fn replace_file(path: &Path, contents: &[u8]) -> Result<(), RecordError> {
    replace_file_on(&FileSystem, path, contents)
}

/// Replaces a file on `disk` as a whole.
///
/// # Errors
/// The file cannot be written; the old file stays.
pub fn replace_file_on(disk: &dyn Disk, path: &Path, contents: &[u8]) -> Result<(), RecordError> {
    crate::disk::replace(disk, path, contents).map_err(RecordError::write(path))
}

/// Replaces a file with `value` as JSON.
pub(super) fn write_json(
    disk: &dyn Disk,
    path: &Path,
    value: &impl Serialize,
) -> Result<(), RecordError> {
    let text = serde_json::to_string_pretty(value).map_err(std::io::Error::from);
    let text = text.map_err(RecordError::write(path))?;
    replace_file_on(disk, path, (text + "\n").as_bytes())
}

/// Longest file name that file systems allow, bytes.
const LONGEST_NAME: usize = 255;

/// Returns the folder of the trial at `position` (from 0) in the run's folder, for example
/// `01-two-point` for the first trial with the name "two-point". A name that is too long is cut.
pub fn trial_folder(dir: &Path, position: usize, name: &str) -> PathBuf {
    let words = name.split(|c: char| !c.is_alphanumeric());
    let words: Vec<_> = words.filter(|word| !word.is_empty()).collect();
    let mut folder = format!("{:02}-{}", position + 1, words.join("-").to_lowercase());
    folder.truncate(folder.floor_char_boundary(LONGEST_NAME));
    dir.join(folder)
}
