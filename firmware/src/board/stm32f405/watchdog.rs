//! The independent watchdog, fed only when all three owners checked in.

use super::pac::IWDG;
use super::pac::iwdg::vals::{Key, Pr};
use core::sync::atomic::{AtomicU8, Ordering};

/// Counts from feeding to the bite. One count is 4 LSI cycles, 85–235 µs over
/// the LSI's 17–47 kHz (DS8626): 49 counts, of which the first may be cut
/// short, are 4.08–11.53 ms, within the 4–12 ms wanted.
const COUNTS: u16 = 49;

/// Of IWDG_SR, at least 5 cycles each: 1 ms and more.
const POLLS: u32 = 40_000;

/// What IWDG_KR takes to be fed (RM0090 section 21.4.1).
pub const FEED: u32 = Key::RESET.to_bits() as u32;

/// Who must check in between two feedings.
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

/// Starts the watchdog; nothing but a reset stops it (RM0090 section 21.3).
pub fn start() {
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    IWDG.rlr().write(|w| w.set_rl(COUNTS - 1));
    // The new values take up to five LSI cycles to arrive; feeding before
    // that would reload the old ones. 5 / 17 kHz = 0.3 ms; LSI start-up 40 µs. Bounded: of
    // one that stands still the self-test has told.
    let pending = || {
        let status = IWDG.sr().read();
        status.pvu() || status.rvu()
    };
    let _ = (0..POLLS).any(|_| !pending());
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}

/// `owner` is alive. Feeds the watchdog if all three have said so since it was
/// last fed.
pub fn check_in(owner: Owner) {
    let before = CHECKED_IN.fetch_or(owner as u8, Ordering::AcqRel);
    if before | owner as u8 == ALL {
        CHECKED_IN.store(0, Ordering::Release);
        IWDG.kr().write(|w| w.set_key(Key::RESET));
    }
}
