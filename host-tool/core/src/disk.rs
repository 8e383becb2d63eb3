//! Where files are written: the file system, memory where there is none, or a test disk that fills
//! up. Also replaces files as a whole.

use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// Destination for the files of a record: the file system, memory in a browser, or in tests a disk
/// that is full after a given number of bytes. Folders and names are those of the file system,
/// unless an implementation replaces them.
pub trait Disk: fmt::Debug + Send {
    /// Creates a file at `path`, replacing an old one. The returned writer hands every write to the
    /// operating system at once, without a buffer.
    ///
    /// # Errors
    /// The file cannot be created.
    fn create(&self, path: &Path) -> io::Result<Box<dyn Write + Send>>;

    /// Creates a folder, and the folders above it, if they do not exist.
    ///
    /// # Errors
    /// The folder cannot be created.
    fn create_folder(&self, path: &Path) -> io::Result<()> {
        std::fs::create_dir_all(path)
    }

    /// Gives the file `from` the name `to`, replacing a file of that name.
    ///
    /// # Errors
    /// The file cannot be renamed.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        std::fs::rename(from, to)
    }

    /// Removes a file.
    ///
    /// # Errors
    /// The file cannot be removed.
    fn remove(&self, path: &Path) -> io::Result<()> {
        std::fs::remove_file(path)
    }
}

/// Destination that writes to the computer's own file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct FileSystem;

impl Disk for FileSystem {
    fn create(&self, path: &Path) -> io::Result<Box<dyn Write + Send>> {
        Ok(Box::new(File::create(path)?))
    }
}

/// Replaces a file as a whole. A reader never sees half of the new file, even after a crash or on a
/// full disk: the old file stays until the new one is complete.
///
/// # Errors
/// The file cannot be written; the old file stays.
pub fn replace(disk: &dyn Disk, path: &Path, contents: &[u8]) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    let partial = path.with_file_name(name);
    let written = disk
        .create(&partial)
        .and_then(|mut file| file.write_all(contents).and_then(|()| file.flush()))
        .and_then(|()| disk.rename(&partial, path));
    written.inspect_err(|_| {
        let _ = disk.remove(&partial); // what is on it is of no use
    })
}
