//! Keeps a wearer file on disk: it is either complete or unchanged, and its history only grows.

use super::write::entries_to_toml;
use super::{DriftCheck, History, Wearer};
use crate::disk::{FileSystem, replace};
use crate::fields::SessionError;
use std::path::{Path, PathBuf};

/// Reason why a wearer file was not written; the old file is unchanged.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file could not be written, because the disk is full or for another reason of the file
    /// system.
    #[error("E664 cannot write {0}: {1}; free disk space or use another name; the old file stays")]
    Disk(PathBuf, std::io::Error),
    /// The existing file is not a wearer file of this program.
    #[error("{0}; the file is unchanged: correct it, or use another name")]
    Unreadable(String),
    /// The existing file belongs to another person, by its name.
    #[error("E654 {0} is the wearer file of {1}, not of {2}: use another file name")]
    Another(PathBuf, String, String),
    /// The new content lacks history or checks of the existing file.
    #[error(
        "E655 {0} has entries of its history or checks that the new version lacks: read the file \
         again, and append to them"
    )]
    Forgets(PathBuf),
    /// The new content is not a wearer file.
    #[error("E656 the new content of {0} is not a valid wearer file: {1}")]
    Wrong(PathBuf, String),
}

fn unreadable(error: &SessionError) -> StoreError {
    StoreError::Unreadable(error.lines())
}

impl Wearer {
    /// Writes the file as a whole, so that a reader, a crash or a full disk never leaves half of
    /// it. An existing file must belong to the same person, and the new history and checks must
    /// begin with the existing ones. Comments in the file are lost ([`append`] keeps them).
    ///
    /// # Errors
    /// [`StoreError`]; the old file stays.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), StoreError> {
        let path = path.as_ref();
        if path.exists() {
            let old = Self::read(path).map_err(|e| unreadable(&e))?;
            self.check_may_replace(path, &old)?;
        }
        self.store(path, &self.to_toml())
    }

    /// Checks whether this wearer may replace `old`.
    fn check_may_replace(&self, path: &Path, old: &Self) -> Result<(), StoreError> {
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

    /// Replaces the file with a text that is first parsed and compared with this wearer.
    fn store(&self, path: &Path, text: &str) -> Result<(), StoreError> {
        let name = path.display().to_string();
        let wrong = |why: String| StoreError::Wrong(path.to_owned(), why);
        let back = Self::parse(&name, text).map_err(|e| wrong(e.lines()))?;
        if back != *self {
            return Err(wrong("it reads back differently".into()));
        }
        let written = replace(&FileSystem, path, text.as_bytes());
        written.map_err(|why| StoreError::Disk(path.to_owned(), why))
    }
}

/// Appends entries to a wearer's file, and keeps every byte that it already has.
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
    wearer.store(
        path,
        &format!("{text}{end}{}", entries_to_toml(history, checks)),
    )?;
    Ok(wearer)
}
