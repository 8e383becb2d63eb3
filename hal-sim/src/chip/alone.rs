//! The chip without a board: runs a program that prints over semihosting and
//! ends by itself, as the `bench` image does.
//!
//! No pins, no USB host, no time base: the core, its memories, its clocks. In:
//! an image. Out: what it printed, instructions, cycles.

use super::Cycle;
use super::cpu::semihosting::Semihosting;
use super::cpu::{Cpu, Stop};
use super::image::Image;
use super::soc::flash::{self, Prefetched};
use super::soc::{Pace, Soc};

/// A program that goes on for longer than this will not end, cycles.
const LIMIT: Cycle = 10_000_000_000;

/// How the flash answers: what hangs on it can be shown by comparing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashWait {
    /// As the program sets it, by this reading of the manual.
    States(Prefetched),
    /// As fast as the core, whatever the program sets: no board's.
    Never,
}

impl FlashWait {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [
        Self::States(Prefetched::Cached),
        Self::States(Prefetched::NotCached),
        Self::Never,
    ];
}

impl Default for FlashWait {
    fn default() -> Self {
        Self::States(Prefetched::default())
    }
}

/// What a program that ended left behind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramResult {
    /// Everything that it printed.
    pub console: String,
    /// Instructions from reset on.
    pub instructions: u64,
    /// Cycles from reset on.
    pub cycles: Cycle,
}

/// Why a program did not end well.
#[derive(Debug, thiserror::Error)]
pub enum AloneError {
    /// The core stopped; exit codes other than 0 too.
    #[error("E545 {program} stopped on the simulated chip: {stop} (in {function})\n{console}")]
    Stopped {
        /// The file.
        program: String,
        /// Why.
        stop: Stop,
        /// Where, by symbol.
        function: String,
        /// What it had printed.
        console: String,
    },
    /// It goes on for ever.
    #[error("E546 {program} did not end within {LIMIT} cycles on the simulated chip")]
    Endless {
        /// The file.
        program: String,
    },
}

/// Runs `image` from reset, at HSI unless it sets up a clock, until it ends
/// with exit code 0.
pub fn run(image: &Image, wait: FlashWait) -> Result<ProgramResult, AloneError> {
    let mut soc = Soc::new(Pace::Lazy);
    // `Image` has checked that it fits.
    let _ = soc.flash.load(flash::BASE, &image.flash);
    match wait {
        FlashWait::States(prefetched) => soc.flash.set_prefetched(prefetched),
        FlashWait::Never => soc.flash.never_wait(),
    }
    let program = image.path().display().to_string();
    let mut cpu = Cpu::default();
    cpu.system.semihosting = Some(Semihosting::default());
    let ended = cpu.reset(&mut soc).and_then(|()| cpu.run(&mut soc, LIMIT));
    let console = cpu.system.semihosting.take().unwrap_or_default().console;
    let console = String::from_utf8_lossy(&console).into_owned();
    match ended {
        Err(Stop::Exit(0)) => Ok(ProgramResult {
            console,
            instructions: cpu.instructions,
            cycles: cpu.cycle,
        }),
        Ok(()) => Err(AloneError::Endless { program }),
        Err(stop) => Err(AloneError::Stopped {
            program,
            stop,
            function: image.symbols.describe(cpu.registers.r[15]),
            console,
        }),
    }
}
