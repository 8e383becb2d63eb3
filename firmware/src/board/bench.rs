//! What a benchmark needs of an STM32F405 and nothing more: the cycle counter,
//! and flash as fast as on the board. There is no PLL: a cycle is a
//! cycle at 16 MHz too. Speaks over semihosting, so it runs in the chip
//! simulator, in QEMU (whose counter reads 0) and under a debugger.

use super::wiring::BOARD;
use crate::bench::Clock;
use core::fmt::{Display, Write};
use cortex_m::Peripherals;
use cortex_m::peripheral::DWT;
use cortex_m_semihosting::{debug, hio};

/// FLASH_ACR (RM0090, section 3.9.1).
const FLASH_ACR: *mut u32 = 0x4002_3C00 as *mut u32;
/// The board's wait states, with prefetch and both caches: what the stimulator sets.
const WAIT_STATES_ALL_CACHES: u32 = BOARD.clocks.wait_states() | 1 << 8 | 1 << 9 | 1 << 10;

/// DWT CYCCNT.
pub struct CycleCounter(());

impl CycleCounter {
    /// Sets up flash and starts counting. The FPU is on since reset
    /// (cortex-m-rt, before `main`).
    #[must_use]
    pub fn start() -> Self {
        // SAFETY: runs once, before anything else uses a peripheral; FLASH_ACR
        // is this chip's, and more wait states than needed are always allowed.
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

/// Runs every algorithm, prints a line of each, ends the machine.
pub fn run() -> ! {
    print(|clock, row| crate::bench::run(clock, |r| row(r)))
}

/// A heading and the lines of `all`.
pub fn print(all: impl FnOnce(&CycleCounter, &mut dyn FnMut(&dyn Display))) -> ! {
    let clock = CycleCounter::start();
    let mut out = hio::hstdout().ok();
    let mut line = |row: &dyn Display| {
        if let Some(out) = &mut out {
            // A host that does not listen loses lines; nothing else to be done.
            let _ = writeln!(out, "{row}");
        }
    };
    line(&"name runs checksum min mean max");
    all(&clock, &mut line);
    end()
}

/// Ends the machine with status 0.
pub fn end() -> ! {
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}
