//! Runs a program on the chip without a board. The program prints over semihosting and ends by
//! itself, as the `bench` image does.
//!
//! Only the core, its memories and its clocks are simulated: no pins, no USB host, no time base.
//! In: an image. Out: printed text, instructions, cycles.

use super::Cycle;
use super::cpu::semihosting::Semihosting;
use super::cpu::{Cpu, Stop};
use super::image::Image;
use super::soc::flash::{self, Prefetched};
use super::soc::{Pace, Soc};

/// Largest number of cycles of a run; a program that runs longer counts as endless.
const LIMIT: Cycle = 10_000_000_000;

/// Model of the flash's wait states. A comparison of the variants shows how much a result depends
/// on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashWait {
    /// The wait states that the program sets. The manual can be read in two ways about prefetched
    /// lines; this variant selects one.
    States(Prefetched),
    /// No wait states, whatever the program sets; no real board behaves like this.
    Never,
}

impl FlashWait {
    /// All variants; the default is first.
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

/// Output and length of a program that ended with exit code 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProgramResult {
    /// Everything that the program printed.
    pub console: String,
    /// Instructions completed since reset.
    pub instructions: u64,
    /// Cycles since reset.
    pub cycles: Cycle,
}

/// Reason why a program did not end with exit code 0.
#[derive(Debug, thiserror::Error)]
pub enum AloneError {
    /// The core stopped; this includes exit codes other than 0.
    #[error("E545 {program} stopped on the simulated chip: {stop} (in {function})\n{console}")]
    Stopped {
        /// Path of the image.
        program: String,
        /// Reason why the core stopped.
        stop: Stop,
        /// Function that was running, by its symbol, with the distance from its start.
        function: String,
        /// Text that the program had printed before it stopped.
        console: String,
    },
    /// The program ran longer than the limit of 10¹⁰ cycles.
    #[error(
        "E546 {program} did not end within {LIMIT} cycles on the simulated chip; check it for an \
         endless loop"
    )]
    Endless {
        /// Path of the image.
        program: String,
    },
}

/// Runs `image` from reset until it ends with exit code 0. The clock is HSI unless the program sets
/// up another.
pub fn run(image: &Image, wait: FlashWait) -> Result<ProgramResult, AloneError> {
    let mut soc = Soc::new(Pace::Lazy);
    // `Image` has checked that the flash contents fit.
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
