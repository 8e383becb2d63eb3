//! Start-up of a benchmark on an STM32F405: cycle counter, and flash with the caches and wait
//! states of the board. The PLL stays off, because cycle counts do not depend on the clock
//! frequency (16 MHz here). Prints over semihosting, so it runs in the chip simulator, in QEMU
//! (whose counter reads 0) and under a debugger.

use super::wiring::BOARD;
use crate::bench::Clock;
use crate::device::MuscleTables;
use core::fmt::{Display, Write};
use cortex_m::Peripherals;
use cortex_m::peripheral::DWT;
use cortex_m_semihosting::{debug, hio};
use static_cell::ConstStaticCell;

/// Address of FLASH_ACR (RM0090, section 3.9.1).
const FLASH_ACR: *mut u32 = 0x4002_3C00 as *mut u32;
/// FLASH_ACR as the stimulator sets it: the board's wait states, prefetch and both caches.
const WAIT_STATES_ALL_CACHES: u32 = BOARD.clocks.wait_states() | 1 << 8 | 1 << 9 | 1 << 10;

/// Cycle counter of the core (DWT CYCCNT).
pub struct CycleCounter(());

impl CycleCounter {
    /// Configures flash and starts the counter. The FPU is on since reset (cortex-m-rt, before
    /// `main`).
    #[must_use]
    pub fn start() -> Self {
        // SAFETY: this runs once, before anything else uses a peripheral. FLASH_ACR belongs to this
        // chip, and more wait states than necessary are always allowed.
        let mut core = unsafe {
            FLASH_ACR.write_volatile(WAIT_STATES_ALL_CACHES);
            Peripherals::steal()
        };
        core.DCB.enable_trace();
        core.DWT.set_cycle_count(0);
        core.DWT.enable_cycle_counter();
        Self(())
    }
}

impl Clock for CycleCounter {
    fn cycles(&self) -> u32 {
        DWT::cycle_count()
    }
}

/// Runs every algorithm, prints one line for each, and ends the program.
pub fn run() -> ! {
    static TABLES: ConstStaticCell<MuscleTables> = ConstStaticCell::new(MuscleTables::NONE);
    let tables = TABLES.take();
    print(|clock, row| crate::bench::run(clock, tables, |r| row(r)))
}

/// Prints a heading and the lines that `all` emits, and ends the program.
pub fn print(all: impl FnOnce(&CycleCounter, &mut dyn FnMut(&dyn Display))) -> ! {
    let clock = CycleCounter::start();
    let mut out = hio::hstdout().ok();
    let mut line = |row: &dyn Display| {
        if let Some(out) = &mut out {
            // Without a listening host the lines are lost, and nothing can be done about that.
            let _ = writeln!(out, "{row}");
        }
    };
    line(&"name runs checksum min mean max");
    all(&clock, &mut line);
    end()
}

/// Exits through semihosting with status 0.
pub fn end() -> ! {
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}
