//! The chip without a board: runs a program that prints over semihosting and
//! ends by itself, as the `bench` image does.
//!
//! No pins, no USB host, no time base: the core, its memories, its clocks. In:
//! an image. Out: what it printed, instructions, cycles.

use super::Cycle;
use super::cpu::bus::{Bus, Denied, LINE_WORDS, Modelled, Read};
use super::cpu::semihosting::Semihosting;
use super::cpu::{Cpu, Size, Stop};
use super::image::Image;
use super::soc::flash::{self, Prefetched};
use super::soc::{Pace, Soc};

/// A program that goes on for longer than this will not end, cycles.
const LIMIT: Cycle = 10_000_000_000;

/// How the flash answers: what hangs on it can be shown by comparing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// As the program sets it, by this reading of the manual.
    States(Prefetched),
    /// As fast as the core, whatever the program sets: no board's.
    Never,
}

impl Wait {
    /// All of them, the default first.
    pub const ALL: [Self; 3] = [
        Self::States(Prefetched::Cached),
        Self::States(Prefetched::NotCached),
        Self::Never,
    ];
}

impl Default for Wait {
    fn default() -> Self {
        Self::States(Prefetched::default())
    }
}

/// What a program that ended left behind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ended {
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
pub fn run(image: &Image, wait: Wait) -> Result<Ended, AloneError> {
    let mut soc = Soc::new(Pace::Lazy);
    // `Image` has checked that it fits.
    let _ = soc.flash.load(flash::BASE, &image.flash);
    match wait {
        Wait::States(prefetched) => {
            soc.flash.set_prefetched(prefetched);
            run_on(image, &mut soc)
        }
        Wait::Never => run_on(image, &mut Ideal(soc)),
    }
}

fn run_on(image: &Image, bus: &mut impl Bus) -> Result<Ended, AloneError> {
    let program = image.path().display().to_string();
    let mut cpu = Cpu::default();
    cpu.system.semihosting = Some(Semihosting::default());
    let ended = cpu.reset(bus).and_then(|()| cpu.run(bus, LIMIT));
    let console = cpu.system.semihosting.take().unwrap_or_default().console;
    let console = String::from_utf8_lossy(&console).into_owned();
    match ended {
        Err(Stop::Exit(0)) => Ok(Ended {
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

/// The chip with a flash that never makes the core wait.
struct Ideal(Soc);

impl Bus for Ideal {
    #[inline]
    fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<Read, Denied> {
        let read = self.0.read(address, size, at)?;
        let wait = match address >> 24 {
            0x00 | 0x08 => 0,
            _ => read.wait,
        };
        Ok(Read { wait, ..read })
    }

    #[inline]
    fn write(&mut self, address: u32, size: Size, value: u32, at: Cycle) -> Result<u32, Denied> {
        self.0.write(address, size, value, at)
    }

    fn code(&mut self, address: u32) -> Result<u16, Denied> {
        self.0.code(address)
    }

    #[inline]
    fn fetch(&mut self, _line: u32, _at: Cycle) -> u32 {
        0
    }

    fn is_writable_code(&self, address: u32) -> bool {
        self.0.is_writable_code(address)
    }

    fn code_version(&self) -> u32 {
        self.0.code_version()
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        self.0.advance(to)
    }

    fn next_event(&self) -> Cycle {
        self.0.next_event()
    }

    fn lines(&self) -> [u32; LINE_WORDS] {
        self.0.lines()
    }

    fn request_reset(&mut self, _at: Cycle) {
        self.0.request_reset();
    }

    fn wants_reset(&self) -> bool {
        self.0.wants_reset().is_some()
    }
}
