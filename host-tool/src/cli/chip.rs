//! Options of commands that can run on the chip simulator.

use super::usage_error;
use clap::{Args, ValueEnum};
use hal_sim::chip::gdb::AfterDebugger;
use hal_sim::chip::soc::flash;
use host_core::link::Port;
use host_core::record::check_writable;
use host_core::run::{Board, ChipOptions, DeviceName, open_chip_port};
use host_core::session::Session;
use std::path::{Path, PathBuf};

/// How to read RM0090 where it is ambiguous: whether a flash line that was prefetched enters the
/// instruction cache when it is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Prefetched {
    /// Lines enter the instruction cache
    #[default]
    Cached,
    /// Lines do not enter the cache
    NotCached,
}

impl From<Prefetched> for flash::Prefetched {
    fn from(reading: Prefetched) -> Self {
        match reading {
            Prefetched::Cached => Self::Cached,
            Prefetched::NotCached => Self::NotCached,
        }
    }
}

impl std::fmt::Display for Prefetched {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Cached => "cached",
            Self::NotCached => "not-cached",
        })
    }
}

/// Name of a board for which there is an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BoardName {
    /// The reference board, with output stages
    Reference,
    /// WeAct Studio's core board with an STM32F405, a breadboard
    Weact,
    /// Adafruit's Feather STM32F405 Express, a breadboard
    Feather,
}

impl From<BoardName> for Board {
    fn from(name: BoardName) -> Self {
        match name {
            BoardName::Reference => Self::Reference,
            BoardName::Weact => Self::Weact,
            BoardName::Feather => Self::Feather,
        }
    }
}

/// Options that need `--device chip`.
#[derive(Args, Debug)]
pub struct ChipArgs {
    /// Board to simulate, with its image (chip): weact and feather are breadboards
    #[arg(long, value_enum)]
    board: Option<BoardName>,
    /// ELF to flash instead of the board's own image (chip)
    #[arg(long)]
    image: Option<PathBuf>,
    /// Halt the core at reset and serve gdb at this port (chip; 0: any port): one debugger at a
    /// time, which may detach and return
    #[arg(long)]
    gdb: Option<u16>,
    /// Write the image's log to this file, - for standard error (chip); --overwrite replaces an
    /// existing file
    #[arg(long, group = "replaced")]
    log: Option<PathBuf>,
}

impl ChipArgs {
    /// Returns whether gdb may stop the device at any time.
    pub const fn is_debugged(&self) -> bool {
        self.gdb.is_some()
    }

    /// Returns whether the simulated board is a breadboard.
    pub fn is_breadboard(&self) -> bool {
        let board = self.board.map(Board::from);
        board.is_some_and(|board| board.pins().breadboard.is_some())
    }

    /// Returns options with only an image.
    pub fn with_image(image: Option<PathBuf>) -> Self {
        let (board, gdb, log) = (None, None, None);
        Self {
            board,
            image,
            gdb,
            log,
        }
    }

    /// Returns the image that replaces the board's own.
    pub fn image(&self) -> Option<&Path> {
        self.image.as_deref()
    }

    /// Opens `device` for `session` with these options. `replaces` allows an existing log to be
    /// replaced; `outlives` decides what happens after a debugger leaves.
    ///
    /// # Errors
    /// Fails if the options do not belong to the device, the log exists and must stay, or the
    /// device does not open.
    pub fn open(
        &self,
        device: &DeviceName,
        session: &Session,
        seed: u64,
        replaces: bool,
        outlives: AfterDebugger,
    ) -> anyhow::Result<Box<dyn Port>> {
        let options = ChipOptions {
            board: self.board.map_or(Board::Reference, Board::from),
            image: self.image.clone(),
            pins: None,
            gdb: self.gdb,
            log: self.log.clone(),
            outlives,
        };
        if *device == DeviceName::Chip {
            if let Some(log) = self.log.as_ref().filter(|log| **log != Path::new("-")) {
                let image: Vec<&Path> = self.image().into_iter().collect();
                check_writable(log, replaces, &image, None)?;
            }
            return Ok(Box::new(open_chip_port(session, seed, &options)?));
        }
        if self.board.is_some()
            || options.image.is_some()
            || options.gdb.is_some()
            || options.log.is_some()
        {
            return usage_error("--board, --image, --gdb and --log need --device chip");
        }
        Ok(device.open(session, seed)?)
    }
}
