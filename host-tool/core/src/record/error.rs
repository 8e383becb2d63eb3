//! What can go wrong with a record, and what to do about it.

use super::FORMAT;
use std::path::PathBuf;

/// Why a run could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file system refused this file or folder.
    #[error("E583 {0} cannot be used: {1}; mend that, or give another folder")]
    Io(PathBuf, std::io::Error),
    /// The disk is full, or the file system refused otherwise.
    #[error(
        "E582 cannot write {path}: {why}; make room there or choose another --out; what was \
         recorded before is kept"
    )]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        why: std::io::Error,
    },
    /// The folder for a new record holds something.
    #[error(
        "E590 {0} is not empty: it holds {1}; choose another --out; where a command has \
         --overwrite, that replaces a record"
    )]
    Taken(PathBuf, String),
    /// Another program writes the record in this folder.
    #[error("E591 another flexor writes in {0}: wait for its end, or choose another folder")]
    Busy(PathBuf),
    /// A folder that is no record, but holds this, was to be replaced.
    #[error(
        "E592 {0} is no record, so --overwrite leaves it alone: it holds {1} and no run.json \
         of flexor's; choose another --out"
    )]
    NotOurs(PathBuf, String),
    /// A folder without a record.
    #[error("E593 {0} is no record: it has no run.json; give a folder that flexor run wrote")]
    Absent(PathBuf),
    /// A record of this later format, which this version of the program wrote.
    #[error(
        "E594 the record in {0} has format {1}, and this flexor knows formats up to \
         {FORMAT}: use the flexor that wrote it ({2}), or a later one"
    )]
    Newer(PathBuf, u64, String),
    /// A closed record has lost this.
    #[error("E585 the record in {0} is damaged: {1}; take it from where it was kept whole")]
    Damaged(PathBuf, String),
    /// The place for something new, with its option where that needs naming, is this
    /// of what is read or recorded.
    #[error("E586 {0} is {1}, which is to be read and not replaced: choose another place")]
    Source(String, String),
    /// The file for something new is there.
    #[error("E587 {0} is there already: choose another name; --overwrite replaces it")]
    FileTaken(PathBuf),
    /// A file is not what this program writes: its line, from 1 for the header, and
    /// the column with the reason.
    #[error(
        "E584 {0}, line {1}: {2}; flexor does not write it so: take the record from where \
         it was kept unchanged"
    )]
    Format(PathBuf, usize, String),
}

impl RecordError {
    /// What became of writing `path`.
    pub fn write(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |why| RecordError::Write {
            path: path.to_owned(),
            why,
        }
    }

    /// What became of reading `path`.
    pub fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |why| Self::Io(path.to_owned(), why)
    }
}
