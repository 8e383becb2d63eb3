//! Errors of reading and writing records, each with a remedy.

use super::FORMAT;
use std::path::PathBuf;

/// Reason why a run could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The operating system refused access to this file or folder.
    #[error("E583 {0} cannot be used: {1}; correct this, or give another path")]
    Io(PathBuf, std::io::Error),
    /// A file could not be written because the disk is full, or because of another error of the
    /// file system.
    #[error(
        "E582 cannot write {path}: {why}; free space on that disk or choose another --out; \
         everything recorded so far is kept"
    )]
    Write {
        /// File or folder that could not be written.
        path: PathBuf,
        /// Error from the operating system.
        why: std::io::Error,
    },
    /// The folder for a new record is not empty. The text is the name of an entry in it.
    #[error(
        "E590 {0} is not empty: it contains {1}; choose another --out, or replace a record with \
         --overwrite if the command has that option"
    )]
    Taken(PathBuf, String),
    /// Another program writes the record in this folder.
    #[error("E591 another flexor is writing to {0}: wait until it ends, or choose another folder")]
    Busy(PathBuf),
    /// The folder whose content is to be replaced does not hold a record. The text is the name of
    /// an entry in it.
    #[error(
        "E592 {0} is not a record, so --overwrite does not replace it: it contains {1} but no \
         run.json from flexor; choose another --out"
    )]
    NotOurs(PathBuf, String),
    /// The folder contains no record.
    #[error("E593 {0} is not a record: it has no run.json; give a folder that flexor run wrote")]
    Absent(PathBuf),
    /// The record has a format that this program does not know yet. The fields are the folder, the
    /// format and the version of the program that wrote it.
    #[error(
        "E594 the record in {0} has format {1}, but this flexor reads only formats up to \
         {FORMAT}: use flexor {2}, which wrote the record, or a later version"
    )]
    Newer(PathBuf, u64, String),
    /// A closed record has lost data. The text describes which.
    #[error("E585 the record in {0} is damaged: {1}; restore it from an undamaged copy")]
    Damaged(PathBuf, String),
    /// The output file would overwrite a file that the command reads, or a part of a record. The
    /// texts are the path of the output file and what it would overwrite.
    #[error("E586 {0} is {1}, which must not be overwritten: choose another path")]
    Source(String, String),
    /// The file to be written already exists.
    #[error("E587 {0} already exists: choose another name, or replace it with --overwrite")]
    FileTaken(PathBuf),
    /// The file has a content that this program does not write. The fields are the file, the line
    /// (1 is the header), and the column with the reason.
    #[error(
        "E584 {0}, line {1}: {2}; flexor did not write this: restore the record from an \
         unchanged copy"
    )]
    Format(PathBuf, usize, String),
}

impl RecordError {
    /// Returns a function that turns an I/O error of writing `path` into a [`RecordError::Write`].
    pub fn write(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |why| RecordError::Write {
            path: path.to_owned(),
            why,
        }
    }

    /// Returns a function that turns an I/O error of reading `path` into a [`RecordError::Io`].
    pub fn io(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |why| Self::Io(path.to_owned(), why)
    }
}
