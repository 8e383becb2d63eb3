//! Where files go: the file system, or one that fills up; and files replaced as a whole.

use std::fmt;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

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

/// Replaces a file as a whole: a reader, a crash or a full disk never leaves
/// half of it, and the old one stays until the new one is whole.
///
/// # Errors
/// It cannot be written; the old one stays.
pub fn replace(disk: &dyn Disk, path: &Path, contents: &[u8]) -> io::Result<()> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    let partial = path.with_file_name(name);
    let written = disk
        .create(&partial)
        .and_then(|mut file| file.write_all(contents).and_then(|()| file.flush()))
        .and_then(|()| std::fs::rename(&partial, path));
    written.inspect_err(|_| {
        let _ = std::fs::remove_file(&partial); // what is on it is of no use
    })
}
