//! The independent watchdog, fed only after all three owners have checked in.

use super::pac::IWDG;
use super::pac::iwdg::vals::{Key, Pr};
use core::sync::atomic::{AtomicU8, Ordering};

/// Counts from feeding to the reset. One count is 4 LSI cycles, 85–235 µs over the LSI's 17–47 kHz
/// (DS8626). 49 counts, of which the first may be cut short, are 4.08–11.53 ms, within the
/// specified 4–12 ms.
const COUNTS: u16 = 49;

/// Largest number of polls of IWDG_SR, at least 5 cycles each: 1 ms or more.
const POLLS: u32 = 40_000;

/// Value for IWDG_KR that feeds the watchdog (RM0090 section 21.4.1).
#[cfg(not(feature = "breadboard"))]
pub const FEED: u32 = Key::RESET.to_bits() as u32;

/// Owners that must check in between two feedings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Owner {
    /// The refill interrupt.
    Pulser = 1,
    /// The control tick.
    Controller = 2,
    /// The thread.
    Session = 4,
}

const ALL: u8 = Owner::Pulser as u8 | Owner::Controller as u8 | Owner::Session as u8;

static CHECKED_IN: AtomicU8 = AtomicU8::new(0);

/// Starts the watchdog; only a reset stops it (RM0090 section 21.3).
pub fn start() {
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    IWDG.rlr().write(|w| w.set_rl(COUNTS - 1));
    // The new values take up to five LSI cycles to arrive, 5 / 17 kHz = 0.3 ms, after an LSI
    // start-up of 40 µs; feeding earlier would reload the old values. The wait is bounded; the
    // self-test has already reported an LSI that stands still.
    let pending = || {
        let status = IWDG.sr().read();
        status.pvu() || status.rvu()
    };
    let _ = (0..POLLS).any(|_| !pending());
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}

/// Notes that `owner` is alive, and feeds the watchdog if all three owners have checked in since it
/// was last fed.
pub fn check_in(owner: Owner) {
    let before = CHECKED_IN.fetch_or(owner as u8, Ordering::AcqRel);
    if before | owner as u8 == ALL {
        CHECKED_IN.store(0, Ordering::Release);
        IWDG.kr().write(|w| w.set_key(Key::RESET));
    }
}
