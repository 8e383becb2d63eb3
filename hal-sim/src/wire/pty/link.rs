//! The link by which a pseudo-terminal is found: made where nothing is, removed only by
//! who made it.

use std::fs::{self, File, TryLockError};
use std::io;
use std::os::unix::fs::{MetadataExt, symlink};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Attempts at locking a folder, and the time from one to the next.
const ATTEMPTS: u32 = 100;
const ATTEMPT: Duration = Duration::from_millis(5);

/// A symbolic link to a terminal, removed on drop if it is still the one that was made.
#[derive(Debug)]
pub(super) struct Link {
    path: PathBuf,
    target: PathBuf,
    /// Which link it is, whatever it leads to.
    identity: Option<Identity>,
}

impl Link {
    /// Makes `path` a link to the terminal `target`.
    ///
    /// # Errors
    /// `AlreadyExists` if something is at `path` that is no link to a pseudo-terminal, or
    /// one to a terminal that lives; otherwise what the system says.
    pub(super) fn make(path: &Path, target: &Path) -> io::Result<Self> {
        // Of two that find the same stale link, the second would delete the first one's new one.
        let _alone = lock_folder_of(path);
        remove_stale(path, target)?;
        symlink(target, path)?;
        Ok(Self {
            path: path.to_owned(),
            target: target.to_owned(),
            identity: identity(path),
        })
    }

    /// Whether it still is what was made: somebody may have put another there.
    fn is_own(&self) -> bool {
        let leads_there = fs::read_link(&self.path).is_ok_and(|target| target == self.target);
        leads_there && identity(&self.path) == self.identity
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let _alone = lock_folder_of(&self.path);
        if self.is_own() {
            let _ = fs::remove_file(&self.path); // its folder may be read-only by now
        }
    }
}

/// A link's number on its file system, which may be given to another once it is gone, and
/// when it was made, in s and ns.
type Identity = (u64, i64, i64);

fn identity(path: &Path) -> Option<Identity> {
    let link = fs::symlink_metadata(path).ok()?;
    Some((link.ino(), link.mtime(), link.mtime_nsec()))
}

/// Keeps others who take this from looking at links in the folder of `path` until it is
/// dropped. They need no time; a file system that locks no folder, or somebody else's lock
/// on it, is done without.
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

/// Removes the link that a run which crashed left at `path`; `own` is the terminal that is
/// to be there.
fn remove_stale(path: &Path, own: &Path) -> io::Result<()> {
    let refused = |why: String| {
        let why = format!("{} {why}: give another path, or remove it", path.display());
        Err(io::Error::new(io::ErrorKind::AlreadyExists, why))
    };
    let target = match fs::read_link(path) {
        Ok(target) => target,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
            return refused("exists and is no link".to_owned());
        }
        Err(error) => return Err(error),
    };
    if !are_both_terminals(&target, own) {
        let why = format!("is a link to {}, no pseudo-terminal", target.display());
        return refused(why);
    }
    // The system may have given us the very terminal that the crashed run had.
    if target != own && fs::symlink_metadata(&target).is_ok() {
        let why = format!("is a link to {}, a terminal in use", target.display());
        return refused(why);
    }
    fs::remove_file(path)
}

/// Whether both are pseudo-terminals: of one folder, and of one name but for its number.
fn are_both_terminals(one: &Path, other: &Path) -> bool {
    let name = |path: &Path| {
        let name = path.file_name()?.to_str()?.to_owned();
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        (stem.len() < name.len()).then(|| stem.to_owned())
    };
    one.parent() == other.parent() && name(one).is_some() && name(one) == name(other)
}
