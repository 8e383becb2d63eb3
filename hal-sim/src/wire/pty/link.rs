//! Symbolic link to a pseudo-terminal: replaces no other file, and is removed only by the process
//! that made it.

use std::fs::{self, File, TryLockError};
use std::io;
use std::os::unix::fs::{MetadataExt, symlink};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Number of attempts to lock a folder.
const ATTEMPTS: u32 = 100;
/// Time between two attempts to lock a folder.
const ATTEMPT: Duration = Duration::from_millis(5);

/// A symbolic link to a terminal, removed on drop unless another one has replaced it.
#[derive(Debug)]
pub(super) struct Link {
    path: PathBuf,
    target: PathBuf,
    /// Identity of the link itself, not of its target.
    identity: Option<Identity>,
}

impl Link {
    /// Makes `path` a link to the terminal `target`.
    ///
    /// # Errors
    /// Returns `AlreadyExists` if the entry at `path` is not a link to a pseudo-terminal, or is a
    /// link to an existing one; otherwise the error of the system.
    pub(super) fn make(path: &Path, target: &Path) -> io::Result<Self> {
        // Without the lock, two processes could find the same stale link, and the second would
        // delete the new link of the first.
        let _alone = lock_folder_of(path);
        remove_stale(path, target)?;
        symlink(target, path)?;
        Ok(Self {
            path: path.to_owned(),
            target: target.to_owned(),
            identity: identity(path),
        })
    }

    /// Returns whether the link is still the one that was made: another process may have replaced
    /// it.
    fn is_own(&self) -> bool {
        let leads_there = fs::read_link(&self.path).is_ok_and(|target| target == self.target);
        leads_there && identity(&self.path) == self.identity
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let _alone = lock_folder_of(&self.path);
        if self.is_own() {
            let _ = fs::remove_file(&self.path); // fails if the folder has become read-only
        }
    }
}

/// Inode number of a link, which may be reused after the link is removed, and its modification
/// time, s and ns.
type Identity = (u64, i64, i64);

fn identity(path: &Path) -> Option<Identity> {
    let link = fs::symlink_metadata(path).ok()?;
    Some((link.ino(), link.mtime(), link.mtime_nsec()))
}

/// Locks the folder of `path` against other users of this lock until the returned file is dropped.
/// They hold it only briefly. Returns `None` if the file system cannot lock folders or another
/// program holds the lock; the caller then proceeds without it.
fn lock_folder_of(path: &Path) -> Option<File> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let folder = File::open(folder.unwrap_or(Path::new("."))).ok()?;
    for _ in 0..ATTEMPTS {
        match folder.try_lock() {
            Ok(()) => return Some(folder),
            Err(TryLockError::WouldBlock) => std::thread::sleep(ATTEMPT),
            Err(TryLockError::Error(_)) => return None,
        }
    }
    None
}

/// Removes the link that a crashed run left at `path`; `own` is the terminal that the new link will
/// point to.
fn remove_stale(path: &Path, own: &Path) -> io::Result<()> {
    let refused = |why: String| {
        let why = format!("{} {why}; give another path, or remove it", path.display());
        Err(io::Error::new(io::ErrorKind::AlreadyExists, why))
    };
    let target = match fs::read_link(path) {
        Ok(target) => target,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
            return refused("exists and is not a link".to_owned());
        }
        Err(error) => return Err(error),
    };
    if !are_both_terminals(&target, own) {
        let why = format!(
            "is a link to {}, which is not a pseudo-terminal",
            target.display()
        );
        return refused(why);
    }
    // The system may have reused the terminal name of the crashed run.
    if target != own && fs::symlink_metadata(&target).is_ok() {
        let why = format!(
            "is a link to {}, a terminal that is in use",
            target.display()
        );
        return refused(why);
    }
    fs::remove_file(path)
}

/// Returns whether both paths are pseudo-terminals: in the same folder, with names that differ only
/// in their numbers.
fn are_both_terminals(first: &Path, other: &Path) -> bool {
    let name = |path: &Path| {
        let name = path.file_name()?.to_str()?.to_owned();
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        (stem.len() < name.len()).then(|| stem.to_owned())
    };
    first.parent() == other.parent() && name(first).is_some() && name(first) == name(other)
}
