//! Options of commands that write a record.

use super::moment;
use clap::{ArgGroup, Args};
use host_core::record::{Place, RecordError, check_writable};
use std::path::{Path, PathBuf};

/// Where records go of which nobody says where.
const BASE: &str = "out";

/// Where the record goes.
#[derive(Args, Clone, Debug)]
#[command(group = ArgGroup::new("replaced").multiple(true))]
pub struct OutArgs {
    /// Folder for the record and the report, absent or empty; default: a new
    /// one in out/, named after title, date and time
    #[arg(long, group = "replaced")]
    out: Option<PathBuf>,
    /// Replace the record, or the page, that --out holds
    #[arg(long, requires = "replaced")]
    overwrite: bool,
}

impl OutArgs {
    /// This very folder.
    pub const fn in_folder(dir: PathBuf) -> Self {
        Self {
            out: Some(dir),
            overwrite: false,
        }
    }

    /// The folder, if somebody said where.
    pub fn dir(&self) -> Option<&Path> {
        self.out.as_deref()
    }

    /// Whether somebody said where.
    pub const fn is_given(&self) -> bool {
        self.out.is_some()
    }

    /// Holds the folder apart from records that the command reads.
    ///
    /// # Errors
    /// E586: it is one of them, by whatever path.
    pub fn check_not_record(&self, records: &[PathBuf]) -> Result<(), RecordError> {
        let Some(out) = &self.out else {
            return Ok(());
        };
        // One that is not there yet is none of them.
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

    /// That `--vcd` may be written beside the record: as [`may_write`], and in the
    /// record itself only under its own name there.
    ///
    /// # Errors
    /// As [`may_write`].
    pub fn check_vcd(&self, vcd: &Path, reads: &[&Path]) -> Result<(), RecordError> {
        let own = self.out.as_ref().map(|out| out.join("outputs.vcd"));
        match own {
            Some(own) if own == vcd => Ok(()),
            _ => check_writable(vcd, self.overwrite, reads, self.dir()),
        }
    }

    /// Whether a record may be replaced.
    pub const fn overwrites(&self) -> bool {
        self.overwrite
    }

    /// Takes the folder for a record called `name`.
    ///
    /// # Errors
    /// It holds something, another program writes in it, or the file system.
    pub fn claim_folder(&self, name: &str) -> Result<Place, RecordError> {
        match &self.out {
            Some(dir) => Place::claim(dir, self.overwrite),
            None => Place::create_new(Path::new(BASE), name, moment::now()),
        }
    }
}
