//! Where the files of a record go: their place, and the file system or one that
//! fills up.

use super::RecordError;
use serde::Serialize;
use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Takes the files of a trial. The file system is one; tests have one that is
/// full after so many bytes.
pub trait Disk: fmt::Debug {
    /// A new file at `path`, in place of an old one. Every write is handed to
    /// the system at once.
    ///
    /// # Errors
    /// The file cannot be.
    fn create(&self, path: &Path) -> io::Result<Box<dyn Write>>;
}

/// The file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct FileSystem;

impl Disk for FileSystem {
    fn create(&self, path: &Path) -> io::Result<Box<dyn Write>> {
        Ok(Box::new(File::create(path)?))
    }
}

/// Replaces a file as a whole.
///
/// # Errors
/// It cannot be written; the old one stays.
pub fn replace_file(path: &Path, contents: &[u8]) -> Result<(), RecordError> {
    replace(&FileSystem, path, contents)
}

/// Replaces a file as a whole: a reader, a crash or a full disk never leaves
/// half of it, and the old one stays until the new one is whole.
pub(super) fn replace(disk: &dyn Disk, path: &Path, contents: &[u8]) -> Result<(), RecordError> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    let partial = path.with_file_name(name);
    let written = disk
        .create(&partial)
        .and_then(|mut file| file.write_all(contents).and_then(|()| file.flush()))
        .and_then(|()| std::fs::rename(&partial, path));
    written.map_err(|source| {
        let _ = std::fs::remove_file(&partial); // what is on it is of no use
        RecordError::write(path)(source)
    })
}

/// Replaces a file by this value.
pub(super) fn write_json(
    disk: &dyn Disk,
    path: &Path,
    value: &impl Serialize,
) -> Result<(), RecordError> {
    let text = serde_json::to_string_pretty(value).map_err(std::io::Error::from);
    let text = text.map_err(RecordError::write(path))?;
    replace(disk, path, (text + "\n").as_bytes())
}

/// The longest name that file systems have, bytes.
const LONGEST_NAME: usize = 255;

/// The folder of trial `position` (from 0) within the run's folder:
/// `01-two-point` for the first if that is its name, cut where it is too long.
pub fn trial_folder(dir: &Path, position: usize, name: &str) -> PathBuf {
    let words = name.split(|c: char| !c.is_alphanumeric());
    let words: Vec<_> = words.filter(|word| !word.is_empty()).collect();
    let mut folder = format!("{:02}-{}", position + 1, words.join("-").to_lowercase());
    folder.truncate(folder.floor_char_boundary(LONGEST_NAME));
    dir.join(folder)
}
