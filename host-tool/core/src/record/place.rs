//! The folder of a new record: a run never destroys another run.

use super::provenance::DECLARED;
use super::{RecordError, folder};
use crate::clock::Moment;
use hal_sim::input;
use std::ffi::{OsStr, OsString};
use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Name of the lock file that a program locks while it writes a record. The empty file is never
/// removed: otherwise two programs could each lock a different file of this name.
const LOCK: &str = ".lock";

/// Files that a record may have beside the folders of its trials.
const RUN_FILES: &str = "run.json summary.json report.html picture.svg image.elf outputs.vcd compare.html \
     result.json result.html declaration.toml sweep.json draws.csv faults.csv faults.jsonl \
     units.jsonl mismatch.csv studies.jsonl deciding.json arms.html";

/// File whose presence shows that a folder holds a study.
const SWEEP: &str = "sweep.json";

/// The only file in a folder that a comparison of records writes.
const COMPARE_PAGE: &str = "compare.html";

/// Files that may be in the folder of a trial.
const TRIAL_FILES: &str =
    "trial.json samples.csv edges.csv columns.csv markers.csv session.toml wearer.toml";

/// A locked folder, in which no other run of this program writes. The lock ends when this value is
/// dropped or the program ends.
#[derive(Debug)]
pub struct Place {
    dir: PathBuf,
    _lock: File,
}

impl Place {
    /// Returns the path of the folder.
    #[must_use]
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// Creates a new folder in `base` and locks it. Its name consists of `name`, the local date and
    /// time of `start`, and a number from 2 on if a folder of this name exists.
    ///
    /// # Errors
    /// The file system refuses.
    pub fn create_new(base: &Path, name: &str, start: Moment) -> Result<Self, RecordError> {
        Self::create_numbered(base, &format!("{}-{}", slug(name), start.local_stamp()))
    }

    /// Creates and locks the first of the folders `stem`, `stem-2`, `stem-3`, … that does not
    /// exist. If two programs try at the same time, they get different folders.
    fn create_numbered(base: &Path, stem: &str) -> Result<Self, RecordError> {
        std::fs::create_dir_all(base).map_err(RecordError::io(base))?;
        let mut dir = base.join(stem);
        let mut count = 1;
        loop {
            match std::fs::create_dir(&dir) {
                Ok(()) => return Self::lock(dir),
                Err(e) if e.kind() == ErrorKind::AlreadyExists => count += 1,
                Err(e) => return Err(RecordError::io(&dir)(e)),
            }
            dir = base.join(format!("{stem}-{count}"));
        }
    }

    /// Locks the folder `dir` for a new record. The folder must be absent or empty. If `overwrite`
    /// is true, it may also hold a record, whose files are removed; other files stay.
    ///
    /// # Errors
    /// E590 if the folder holds anything else; E591 if another program writes it.
    pub fn claim(dir: &Path, overwrite: bool) -> Result<Self, RecordError> {
        check_not_dangling(dir)?;
        std::fs::create_dir_all(dir).map_err(RecordError::io(dir))?;
        let found = foreign_entry(dir)?;
        if let Some(found) = found
            && !(overwrite && is_written_by_flexor(dir))
        {
            let dir = dir.to_owned();
            return Err(match overwrite {
                true => RecordError::NotOurs(dir, found),
                false => RecordError::Taken(dir, found),
            });
        }
        let place = Self::lock(dir.to_owned())?;
        if overwrite {
            remove_record_files(dir)?;
        } else if let Some(found) = foreign_entry(dir)? {
            // Another program was faster, and has already ended.
            return Err(RecordError::Taken(dir.to_owned(), found));
        }
        Ok(place)
    }

    /// Locks the folder of an existing record, to write in it again.
    ///
    /// # Errors
    /// E591 if another program writes it.
    pub fn open_existing(dir: &Path) -> Result<Self, RecordError> {
        Self::lock(dir.to_owned())
    }

    fn lock(dir: PathBuf) -> Result<Self, RecordError> {
        let path = dir.join(LOCK);
        input::check_appendable(&path).map_err(RecordError::io(&path))?;
        let mut options = File::options();
        let lock = options.create(true).truncate(false).write(true).open(&path);
        let lock = lock.map_err(RecordError::io(&path))?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { dir, _lock: lock }),
            Err(TryLockError::WouldBlock) => Err(RecordError::Busy(dir)),
            Err(TryLockError::Error(e)) => Err(RecordError::io(&path)(e)),
        }
    }
}

/// Checks that a command may write the file `path`, as far as this can be known before the command
/// begins. The file must not exist, unless `overwrite` is true. It must be neither a file that the
/// command `reads` nor part of a record, including the record that is to be written in `out`. A
/// pipe or a device may always be written, because nothing can be lost.
///
/// # Errors
/// E586 if the file is read or recorded; E587 if it exists; E583 if it cannot be created.
pub fn check_writable(
    path: &Path,
    overwrite: bool,
    reads: &[&Path],
    out: Option<&Path>,
) -> Result<(), RecordError> {
    let there = path.metadata();
    if there
        .as_ref()
        .is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir())
    {
        return Ok(());
    }
    check_not_dangling(path)?;
    let real = match path.parent().zip(path.file_name()) {
        Some((folder, name)) if there.is_err() => {
            let folder = Path::new(".").join(folder).canonicalize();
            folder.map_err(RecordError::io(path))?.join(name)
        }
        _ => path.canonicalize().map_err(RecordError::io(path))?,
    };
    let is_it = |read: &&&Path| read.canonicalize().is_ok_and(|path| path == real);
    let out = out.and_then(|out| out.canonicalize().ok());
    let is_record = |dir: &&Path| {
        let header = folder::read_header(dir);
        matches!(header, Ok(_) | Err(RecordError::Newer(..))) || out.as_deref() == Some(dir)
    };
    let kept = match reads.iter().find(is_it) {
        Some(read) => Some(format!("{} itself", read.display())),
        None => {
            let record = real.ancestors().skip(1).find(is_record);
            record.map(|dir| format!("part of the record {}", dir.display()))
        }
    };
    if let Some(kept) = kept {
        let out = path.display().to_string();
        return Err(RecordError::Source(out, kept));
    }
    if there.is_ok_and(|metadata| metadata.is_file()) && !overwrite {
        return Err(RecordError::FileTaken(path.to_owned()));
    }
    let is_new = !real.exists();
    let opened = File::options().create(true).append(true).open(&real);
    opened.map_err(RecordError::io(path))?;
    if is_new {
        std::fs::remove_file(&real).map_err(RecordError::io(path))?;
    }
    Ok(())
}

/// Checks that `path` is not a symbolic link to a missing file, which the program would neither
/// open nor create.
fn check_not_dangling(path: &Path) -> Result<(), RecordError> {
    match path.is_symlink() && !path.exists() {
        false => Ok(()),
        true => Err(RecordError::io(path)(std::io::Error::other(
            "it is a symbolic link to a missing file",
        ))),
    }
}

/// Returns the name of an entry in `dir` other than the lock file; `None` if there is none.
fn foreign_entry(dir: &Path) -> Result<Option<String>, RecordError> {
    let first = names(dir)?.into_iter().next();
    Ok(first.map(|name| name.to_string_lossy().into_owned()))
}

/// Returns the names of the entries in `dir` in alphabetical order, without the lock file.
fn names(dir: &Path) -> Result<Vec<OsString>, RecordError> {
    let entries = std::fs::read_dir(dir).map_err(RecordError::io(dir))?;
    let names = entries.flatten().map(|entry| entry.file_name());
    let mut names: Vec<_> = names.filter(|name| name != OsStr::new(LOCK)).collect();
    names.sort();
    Ok(names)
}

/// Returns whether `dir` holds a record, a study, or only a comparison page, all of which this
/// program may replace.
fn is_written_by_flexor(dir: &Path) -> bool {
    folder::read_header(dir).is_ok()
        || dir.join(SWEEP).is_file()
        || names(dir).is_ok_and(|names| names == [COMPARE_PAGE])
}

/// Removes the files of the record in `dir` and leaves all other files.
fn remove_record_files(dir: &Path) -> Result<(), RecordError> {
    for folder in folder::trial_folders(dir)? {
        if folder.is_symlink() {
            // The folder to which the link leads does not belong to this record.
            std::fs::remove_file(&folder).map_err(RecordError::io(&folder))?;
            continue;
        }
        remove(&folder, TRIAL_FILES)?;
        // A folder that holds other files stays.
        let _ = std::fs::remove_dir(&folder);
    }
    clear_declared(dir)?;
    remove(dir, RUN_FILES)
}

/// Removes the copies of a declaration and its sessions that the record of an experiment keeps.
fn clear_declared(dir: &Path) -> Result<(), RecordError> {
    let header = folder::read_header(dir).ok();
    let plan = header.and_then(|run| run.plan);
    for (place, declared) in plan.iter().flat_map(|plan| &plan.declared).enumerate() {
        remove_file(&dir.join(declared.copy_path(place)))?;
    }
    let _ = std::fs::remove_dir(dir.join(DECLARED));
    Ok(())
}

fn remove(dir: &Path, names: &str) -> Result<(), RecordError> {
    let mut paths = names.split(' ').map(|name| dir.join(name));
    paths.try_for_each(|path| remove_file(&path))
}

/// Removes a file, and the partial file that an interrupted replacement of it may have left.
fn remove_file(path: &Path) -> Result<(), RecordError> {
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    for path in [path, Path::new(&partial)] {
        match std::fs::remove_file(path) {
            Err(e) if e.kind() != ErrorKind::NotFound => {
                return Err(RecordError::io(path)(e));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Returns `name` in lower case, with its words joined by hyphens, cut to 40 characters, for the
/// name of a folder.
fn slug(name: &str) -> String {
    let words = name.split(|c: char| !c.is_alphanumeric());
    let words: Vec<_> = words.filter(|word| !word.is_empty()).collect();
    let slug: String = words.join("-").to_lowercase().chars().take(40).collect();
    match slug.trim_end_matches('-') {
        "" => "run".to_owned(),
        slug => slug.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::Run;

    fn empty(test: &str) -> PathBuf {
        let dir = std::env::temp_dir().join(format!("flexor-place-{test}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        dir
    }

    #[test]
    fn programs_of_one_second_get_a_folder_each() {
        let base = empty("second");
        let made: Vec<PathBuf> = std::thread::scope(|scope| {
            let begin = || {
                Place::create_numbered(&base, "one-1")
                    .unwrap()
                    .dir()
                    .to_owned()
            };
            let threads: Vec<_> = (0..8).map(|_| scope.spawn(begin)).collect();
            let joined = threads.into_iter().map(|thread| thread.join().unwrap());
            joined.collect()
        });
        let mut names = made.clone();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), 8, "{made:?}");
    }

    #[test]
    fn a_folder_is_written_by_one_program_at_a_time() {
        let dir = empty("lock");
        let first = Place::claim(&dir, false).unwrap();
        let second = Place::claim(&dir, false).unwrap_err().to_string();
        assert!(second.starts_with("E591"), "{second}");
        drop(first);
        // The first program wrote nothing into the folder.
        Place::claim(&dir, false).unwrap();
    }

    #[test]
    fn what_is_no_record_is_never_touched() {
        let dir = empty("foreign");
        std::fs::create_dir_all(&dir).unwrap();
        std::fs::write(dir.join("thesis.tex"), "years").unwrap();
        for (overwrite, number) in [(false, "E590"), (true, "E592")] {
            let error = Place::claim(&dir, overwrite).unwrap_err().to_string();
            assert!(error.starts_with(number), "{error}");
            assert!(error.contains("thesis.tex"), "{error}");
        }
        folder::save(&dir, &Run::default()).unwrap();
        Place::claim(&dir, false).unwrap_err();
        Place::claim(&dir, true).unwrap();
        assert!(!dir.join("run.json").exists());
        let kept = std::fs::read_to_string(dir.join("thesis.tex")).unwrap();
        assert_eq!(kept, "years");
    }

    #[test]
    fn titles_become_names() {
        assert_eq!(slug("Ten pulses, 45 ± 40°"), "ten-pulses-45-40");
        assert_eq!(slug("…"), "run");
        assert_eq!(slug(&"a b ".repeat(40)).len(), 39);
    }
}
