//! Files in memory, where a browser has no file system.

use host_core::record::Disk;
use std::collections::BTreeMap;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// Files of one record, by path.
#[derive(Clone, Default, Debug)]
pub struct Memory(Arc<Mutex<Files>>);

impl Memory {
    fn files(&self) -> MutexGuard<'_, Files> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns path and length of each file, by ascending path.
    pub fn list(&self) -> Vec<(String, usize)> {
        let files = self.files();
        let listed = files.iter();
        listed
            .map(|(path, bytes)| (path.display().to_string(), bytes.len()))
            .collect()
    }

    /// Returns the bytes of a file; `None` if there is no such file.
    pub fn read(&self, path: &str) -> Option<Vec<u8>> {
        self.files().get(Path::new(path)).cloned()
    }
}

impl Disk for Memory {
    fn create(&self, path: &Path) -> io::Result<Box<dyn Write + Send>> {
        self.files().insert(path.to_owned(), Vec::new());
        Ok(Box::new(Writer {
            memory: self.clone(),
            path: path.to_owned(),
        }))
    }

    fn create_folder(&self, _: &Path) -> io::Result<()> {
        Ok(())
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut files = self.files();
        let bytes = files.remove(from).ok_or(ErrorKind::NotFound)?;
        files.insert(to.to_owned(), bytes);
        Ok(())
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        self.files().remove(path);
        Ok(())
    }
}

/// Appends to a file.
struct Writer {
    memory: Memory,
    path: PathBuf,
}

impl Write for Writer {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut files = self.memory.files();
        let file = files.get_mut(&self.path).ok_or(ErrorKind::NotFound)?;
        file.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
