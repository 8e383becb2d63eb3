//! Options of commands that write a record.

use super::moment;
use clap::{ArgGroup, Args};
use host_core::record::{Place, RecordError, check_writable};
use std::path::{Path, PathBuf};

/// Parent folder of records without `--out`.
const BASE: &str = "out";

/// Folder of the record.
#[derive(Args, Clone, Debug)]
#[command(group = ArgGroup::new("replaced").multiple(true))]
pub struct OutArgs {
    /// Folder for the record and the report, absent or empty; default: a new one in out/, named
    /// after title, date and time
    #[arg(long, group = "replaced")]
    out: Option<PathBuf>,
    /// Replace the record, or the page, in --out
    #[arg(long, requires = "replaced")]
    overwrite: bool,
}

impl OutArgs {
    /// Returns options that use exactly this folder.
    pub const fn in_folder(dir: PathBuf) -> Self {
        Self {
            out: Some(dir),
            overwrite: false,
        }
    }

    /// Returns the folder, if the user gave one.
    pub fn dir(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    /// Returns whether the user gave a folder.
    pub const fn is_given(&self) -> bool {
        self.out.is_some()
    }

    /// Checks that the folder is not one of the records that the command reads.
    ///
    /// # Errors
    /// E586: it is one of them, by any path.
    pub fn check_not_record(&self, records: &[PathBuf]) -> Result<(), RecordError> {
        let Some(out) = &self.out else {
            return Ok(());
        };
        // A folder that does not exist is none of them.
        let Ok(real) = out.canonicalize() else {
            return Ok(());
        };
        let is_out = |record: &&PathBuf| record.canonicalize().is_ok_and(|path| path == real);
        match records.iter().find(is_out) {
            None => Ok(()),
            Some(record) => Err(RecordError::Source(
                format!("--out {}", out.display()),
                format!("the record {} itself", record.display()),
            )),
        }
    }

    /// Checks that `--vcd` may be written, as [`check_writable`] does; inside the record only under
    /// the name that belongs there.
    ///
    /// # Errors
    /// Returns the errors of [`check_writable`].
    pub fn check_vcd(&self, vcd: &Path, reads: &[&Path]) -> Result<(), RecordError> {
        let own = self.out.as_ref().map(|out| out.join("outputs.vcd"));
        match own {
            Some(own) if own == vcd => Ok(()),
            _ => check_writable(vcd, self.overwrite, reads, self.dir()),
        }
    }

    /// Returns whether a record may be replaced.
    pub const fn overwrites(&self) -> bool {
        self.overwrite
    }

    /// Claims the folder for a record called `name`.
    ///
    /// # Errors
    /// Fails if the folder is not empty, another program writes in it, or the file system refuses.
    pub fn claim_folder(&self, name: &str) -> Result<Place, RecordError> {
        match &self.out {
            Some(dir) => Place::claim(dir, self.overwrite),
            None => Place::create_new(Path::new(BASE), name, moment::now()),
        }
    }
}
