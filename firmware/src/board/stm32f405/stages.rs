//! Table of the board's output stages, stored in the last two flash sectors, which `memory.x`
//! reserves for this module, one copy in each.

use super::pac::{FLASH, IWDG};
use super::{memory, record, tape, watchdog};
use crate::safety::{StageTable, StageWords, Stages};
use core::ptr::{read_volatile, write_volatile};
use cortex_m::peripheral::SCB;

/// Number and start address of a sector (RM0090 table 5).
type Sector = (u8, usize);

/// Sectors of the two copies, in the order in which they are written.
const COPIES: [Sector; 2] = [(10, 0x080C_0000), (11, 0x080E_0000)];

/// Keys that unlock flash through FLASH_KEYR, in this order (RM0090 section 3.6.1).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// Returns the stage table in flash, valid only for the chip with `unique_id`.
#[must_use]
pub fn load(unique_id: [u32; 3]) -> Stages {
    // SAFETY: both copies lie in flash and are aligned; only `store` writes there, and it does not
    // return.
    let [first, second] = COPIES.map(|(_, at)| unsafe { read_volatile(at as *const StageWords) });
    Stages::from_copies([&first, &second], unique_id)
}

/// Stops everything, stores `table` and resets; the next boot reads the new table. Call from the
/// thread, with nothing armed.
pub fn store(table: &StageTable) -> ! {
    let words = table.to_words(record::unique_id());
    cortex_m::interrupt::disable();
    tape::stop();
    // SAFETY: this function ends with a reset.
    unsafe { memory::open() };
    // RM0090 section 3.6.5: the caches must be flushed after erasing; the reset does that.
    for key in KEYS {
        FLASH.keyr().write_value(key);
    }
    for (number, at) in COPIES {
        // SAFETY: interrupts are off and the tape's streams have stopped, so nothing else runs or
        // reads flash. Both sectors belong to this module.
        unsafe { write(number, at, &words) };
    }
    SCB::sys_reset()
}

/// Erases a sector and writes `words` at its start. Runs from RAM, because no instruction can be
/// fetched while the flash is busy: up to 2 s for a sector of 128 KiB at x32 (DS8626). The watchdog
/// resets after 4 ms, so it is fed here. Calls no function, because a function would lie in flash.
///
/// # Safety
/// Interrupts must be off, the flash unlocked, and nothing else may read or write it.
#[inline(never)]
#[unsafe(link_section = ".data.flash_writer")]
unsafe fn write(number: u8, at: usize, words: &StageWords) {
    // Addresses are used, because functions of the register crate may not be inlined.
    let (cr, sr) = (
        FLASH.cr().as_ptr().cast::<u32>(),
        FLASH.sr().as_ptr().cast::<u32>(),
    );
    let feed = IWDG.kr().as_ptr().cast::<u32>();
    // SAFETY: these are registers of this chip (RM0090 sections 3.9 and 21.4), and flash whose use
    // the caller guarantees.
    unsafe {
        // This is a macro, because a function or closure could stay in flash.
        macro_rules! finish {
            () => {
                while read_volatile(sr) & BSY != 0 {
                    write_volatile(feed, watchdog::FEED);
                }
            };
        }
        finish!();
        write_volatile(cr, X32 | SER | (number as u32) << SNB_SHIFT);
        write_volatile(cr, X32 | SER | (number as u32) << SNB_SHIFT | STRT);
        finish!();
        write_volatile(cr, X32 | PG);
        let (mut from, mut to) = (words.as_ptr(), at as *mut u32);
        let end = from.add(words.len());
        while from != end {
            write_volatile(to, read_volatile(from));
            finish!();
            (from, to) = (from.add(1), to.add(1));
        }
        write_volatile(cr, 0);
    }
}

// Bits of FLASH_SR and FLASH_CR (RM0090 sections 3.9.5 and 3.9.6).
const BSY: u32 = 1 << 16;
const PG: u32 = 1;
const SER: u32 = 1 << 1;
const SNB_SHIFT: u32 = 3;
const X32: u32 = 2 << 8;
const STRT: u32 = 1 << 16;
