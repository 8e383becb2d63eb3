//! What can go wrong with a record, and what to do about it.

use super::FORMAT;
use std::path::PathBuf;

/// Why a run could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file system refused.
    #[error("E583 {path} cannot be used: {why}; mend that, or give another folder")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        why: std::io::Error,
    },
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
        "E590 {dir} is not empty: it holds {found}; choose another --out, or leave it out for a \
         folder of its own; --overwrite replaces a record"
    )]
    Taken {
        /// The folder.
        dir: PathBuf,
        /// One thing that it holds.
        found: String,
    },
    /// Another program writes the record.
    #[error("E591 another flexor writes in {dir}: wait for its end, or choose another folder")]
    Busy {
        /// The folder.
        dir: PathBuf,
    },
    /// A folder that is no record was to be replaced.
    #[error(
        "E592 {dir} is no record, so --overwrite leaves it alone: it holds {found} and no run.json \
         of flexor's; choose another --out"
    )]
    NotOurs {
        /// The folder.
        dir: PathBuf,
        /// One thing that it holds.
        found: String,
    },
    /// A folder without a record.
    #[error("E593 {dir} is no record: it has no run.json; give a folder that flexor run wrote")]
    Absent {
        /// The folder.
        dir: PathBuf,
    },
    /// A later program's record.
    #[error(
        "E594 the record in {dir} has format {format}, and this flexor knows formats up to \
         {FORMAT}: use the flexor that wrote it ({program}), or a later one"
    )]
    Newer {
        /// The folder.
        dir: PathBuf,
        /// Its format.
        format: u64,
        /// The version of the program that wrote it.
        program: String,
    },
    /// A closed record has lost something.
    #[error("E585 the record in {dir} is damaged: {what}; take it from where it was kept whole")]
    Damaged {
        /// The folder.
        dir: PathBuf,
        /// What is missing.
        what: String,
    },
    /// The folder for something new is a record that it is made from.
    #[error(
        "E586 --out {out} is the record {record} itself, which is to be read and not replaced: \
         choose another --out"
    )]
    Source {
        /// The folder for the new.
        out: PathBuf,
        /// The record, as it was given.
        record: PathBuf,
    },
    /// A file is not what this program writes.
    #[error(
        "E584 {path}, line {line}: {what}; flexor does not write it so: take the record from where \
         it was kept unchanged"
    )]
    Format {
        /// The file.
        path: PathBuf,
        /// 1-based; the header is line 1.
        line: usize,
        /// The column and the reason.
        what: String,
    },
}

impl RecordError {
    pub(super) fn write(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |why| RecordError::Write {
            path: path.to_owned(),
            why,
        }
    }

    /// What became of reading `path`.
    pub fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |why| RecordError::Io {
            path: path.to_owned(),
            why,
        }
    }
}
