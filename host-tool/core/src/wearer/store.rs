//! Keeps a wearer file on disk: it is either complete or unchanged, and its history only grows.

use super::write::entries_to_toml;
use super::{DriftCheck, History, Wearer};
use crate::disk::{FileSystem, replace};
use crate::fields::SessionError;
use std::path::{Path, PathBuf};

/// Reason why a wearer file was not written. The existing file is then unchanged.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system refused to write the file, for example because the disk is full.
    #[error("E664 cannot write {0}: {1}; free disk space or use another name; the old file stays")]
    Disk(PathBuf, std::io::Error),
    /// The existing file cannot be read as a wearer file, so it is not replaced. The value lists
    /// its errors.
    #[error("{0}; the file is unchanged: correct it, or use another name")]
    Unreadable(String),
    /// The existing file is that of another wearer. The values are the path, the name in the file,
    /// and the name of the new wearer.
    #[error("E654 {0} is the wearer file of {1}, not of {2}: use another file name")]
    Another(PathBuf, String, String),
    /// The new content lacks entries of the existing file's history or checks.
    #[error(
        "E655 {0} has entries of its history or checks that the new version lacks: read the file \
         again, and append to them"
    )]
    Forgets(PathBuf),
    /// The new content is not a valid wearer file, for the reason given.
    #[error("E656 the new content of {0} is not a valid wearer file: {1}; the old file stays")]
    Wrong(PathBuf, String),
}

fn unreadable(error: &SessionError) -> StoreError {
    StoreError::Unreadable(error.lines())
}

impl Wearer {
    /// Writes the wearer file as a whole. If the program crashes or the disk is full, the file is
    /// either the old or the new one, never a part. An existing file must be that of the same
    /// wearer, and the new history and checks must begin with the existing ones. Comments in the
    /// existing file are lost; [`append`] keeps them.
    ///
    /// # Errors
    /// [`StoreError`]; the existing file is then unchanged.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), StoreError> {
        let path = path.as_ref();
        if path.exists() {
            let old = Self::read(path).map_err(|e| unreadable(&e))?;
            self.check_may_replace(path, &old)?;
        }
        self.store(path, &self.to_toml())
    }

    /// Checks whether this wearer may replace `old` in the file: it must have the same name, and
    /// the history and checks of `old` at the beginning of its own.
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

    /// Replaces the file with `text`, after checking that the text reads as this wearer.
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

/// Appends entries to the history and checks of the wearer file at `path`. Every byte that the file
/// already has stays. Returns the extended wearer.
///
/// # Errors
/// [`StoreError`]; the file is then unchanged.
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
