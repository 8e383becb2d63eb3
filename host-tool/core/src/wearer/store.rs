//! Keeps a wearer file on disk: whole or as it was, its history only ever longer.

use super::write::appendix;
use super::{DriftCheck, History, Wearer};
use crate::disk::{FileSystem, replace};
use crate::fields::SessionError;
use std::path::{Path, PathBuf};

/// Why a wearer file was not written; the old one is as it was.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The disk is full, or the file system refused otherwise.
    #[error("E664 cannot write {0}: {1}; make room there or give another name; the old file stays")]
    Disk(PathBuf, std::io::Error),
    /// What is there is no wearer file of this program.
    #[error("{0}; it stays as it was: mend it, or give another name")]
    Unreadable(String),
    /// What is there, by its name, is another person's.
    #[error("E654 {0} is the wearer file of {1}, not of {2}: give another name")]
    Another(PathBuf, String, String),
    /// What was done before is not in what was to be written.
    #[error(
        "E655 {0} tells more of what was done than what is to replace it: read it again, and \
         append to its history and checks"
    )]
    Forgets(PathBuf),
    /// What was to be written is no wearer file.
    #[error("E656 what is to be written to {0} is no wearer file: {1}")]
    Wrong(PathBuf, String),
}

fn unreadable(error: &SessionError) -> StoreError {
    StoreError::Unreadable(error.lines())
}

impl Wearer {
    /// Writes the file as a whole: a reader, a crash or a full disk never leaves half of
    /// it. What is there must be this person's, and its history and checks begin what is
    /// written; comments in it are lost ([`append`] keeps them).
    ///
    /// # Errors
    /// [`StoreError`]; the old file stays.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), StoreError> {
        let path = path.as_ref();
        if path.exists() {
            let old = Self::read(path).map_err(|e| unreadable(&e))?;
            self.follows(path, &old)?;
        }
        self.store(path, &self.to_toml())
    }

    /// Whether this may replace `old`.
    fn follows(&self, path: &Path, old: &Self) -> Result<(), StoreError> {
        if old.name != self.name {
            let (known, new) = (old.name.clone(), self.name.clone());
            return Err(StoreError::Another(path.to_owned(), known, new));
        }
        let goes_on =
            self.history.starts_with(&old.history) && self.checks.starts_with(&old.checks);
        match goes_on {
            true => Ok(()),
            false => Err(StoreError::Forgets(path.to_owned())),
        }
    }

    /// Replaces the file by a text that is read back first.
    fn store(&self, path: &Path, text: &str) -> Result<(), StoreError> {
        let name = path.display().to_string();
        let wrong = |why: String| StoreError::Wrong(path.to_owned(), why);
        let back = Self::parse(&name, text).map_err(|e| wrong(e.lines()))?;
        if back != *self {
            return Err(wrong("it reads back as another".into()));
        }
        let written = replace(&FileSystem, path, text.as_bytes());
        written.map_err(|why| StoreError::Disk(path.to_owned(), why))
    }
}

/// Appends what was done to a wearer's file, which keeps every byte that it has.
///
/// # Errors
/// [`StoreError`]; the file stays as it was.
pub fn append(
    path: impl AsRef<Path>,
    history: &[History],
    checks: &[DriftCheck],
) -> Result<Wearer, StoreError> {
    let path = path.as_ref();
    let text = Wearer::text(path).map_err(|e| unreadable(&e))?;
    let name = path.display().to_string();
    let mut wearer = Wearer::parse(&name, &text).map_err(|e| unreadable(&e))?;
    wearer.history.extend_from_slice(history);
    wearer.checks.extend_from_slice(checks);
    let end = if text.ends_with('\n') { "" } else { "\n" };
    wearer.store(path, &format!("{text}{end}{}", appendix(history, checks)))?;
    Ok(wearer)
}
