//! Used part of a wearer's allowance, in backup SRAM, which resets preserve (RM0090 section 5.1.2;
//! 4 KB). The thread writes two copies.

use super::pac::RCC;
use super::record;
use crate::link::message::ResetCause;
use crate::safety::{AllowanceWords, Entry, Ledger, UsageAtBoot};
use core::ptr::{read_volatile, write_volatile};

/// Addresses of the two copies, 1 KiB apart in backup SRAM (RM0090 section 2.3).
const COPIES: [usize; 2] = [0x4002_4000, 0x4002_4400];
const _: () = assert!(size_of::<AllowanceWords>() <= 1024);

/// Writer of the two copies.
pub struct Backup(Ledger);

/// Reads the copies, once, at boot. A power-on clears them. Must be called before
/// [`record::forget_reset_cause`].
#[must_use]
#[inline(never)]
pub fn open(cause: ResetCause) -> (Backup, UsageAtBoot) {
    enable();
    let is_power_on = cause == ResetCause::PowerOn;
    let [a, b] = COPIES.map(read);
    let (ledger, found) = Ledger::open([&a, &b], is_power_on);
    let mut backup = Backup(ledger);
    if is_power_on {
        backup.write(&Entry::default());
    }
    (backup, found)
}

/// Reads the copy at `at` word by word; the compiler would unroll one volatile array.
#[inline(never)]
fn read(at: usize) -> AllowanceWords {
    let first = at as *const u32;
    let mut words = [0; size_of::<AllowanceWords>() / 4];
    for (word, slot) in words.iter_mut().enumerate() {
        // SAFETY: the copy lies in backup SRAM, is aligned and has this many words, and only
        // `write` writes there.
        *slot = unsafe { read_volatile(first.add(word)) };
    }
    words
}

/// Enables the clock of backup SRAM and removes its write protection.
fn enable() {
    record::unlock();
    RCC.ahb1enr().modify(|w| w.set_bkpsramen(true));
    let _ = RCC.ahb1enr().read(); // ES0182: delay after clock enabling
}

impl Backup {
    /// Writes both copies of `entry`, one after the other.
    #[inline(never)]
    pub fn write(&mut self, entry: &Entry) {
        enable(); // every time, because with a lost enable bit the copies would stay unchanged
        let (order, words) = self.0.write(entry);
        for copy in order {
            let Some(&at) = COPIES.get(copy) else {
                continue;
            };
            for (word, value) in words.iter().enumerate() {
                // SAFETY: as in `read`; the reference to `self` is the only one.
                unsafe { write_volatile((at as *mut u32).add(word), *value) };
            }
        }
    }
}
