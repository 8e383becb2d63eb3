//! Start of the crystal, and failures that USB cannot report because it has no clock yet. They go to
//! the backup registers, the log and, on a breadboard, the light-emitting diode.
//!
//! The HAL would wait for the crystal for ever. This module waits at most 100 ms before the HAL
//! does, and measures the crystal, because with another one the PLL would drive the core and USB at
//! wrong frequencies, and nothing could report it.

use super::pac::RCC;
use super::wait::within;
use super::{clock, crystal, led, record, timebase};
pub use crate::board::boot_failure::Failure;
use crate::board::wiring::BOARD;
use crate::safety::Fault;

/// Core cycles per millisecond while the HSI clocks the core.
const MS: u32 = clock::HSI_HZ / 1_000;
/// Core cycles per millisecond while the PLL clocks the core.
const PLL_MS: u32 = timebase::CYCLES_PER_US * 1_000;
/// Time after which a crystal that has not started is reported, ms; DS8626 has 2 ms, typical.
const REPORT_MS: u32 = 25;
/// Longest wait for the crystal, ms.
const LONGEST_MS: u32 = 100;
/// Number of equal failures in a row after which the chip stays where it is.
const TRIES: u8 = 3;
/// Largest difference between measured and nominal frequency of the crystal, %: 4 % of the HSI,
/// the crystal's own error, and the measurement.
const TOLERANCE_PERCENT: u32 = 6;

/// Starts the crystal and measures its frequency. Returns the frequency, Hz, or 0 if it could not
/// be measured; the check in each window finds that later, and USB reports it. Does not return if
/// the crystal does not start, or is not the board's.
#[inline(never)]
pub fn start_crystal() -> u32 {
    RCC.cr().modify(|w| w.set_hseon(true));
    let is_ready = || RCC.cr().read().hserdy();
    if within(REPORT_MS * MS, is_ready).is_none() {
        let count = record::note_bring_up(Failure::CrystalMissing as u8, 0);
        led::set(true);
        if within((LONGEST_MS - REPORT_MS) * MS, is_ready).is_none() {
            defmt::error!("the crystal does not start, try {=u8}", count);
            if count < TRIES {
                cortex_m::peripheral::SCB::sys_reset();
            }
            rest(Failure::CrystalMissing, 0);
        }
        led::set(false);
    }
    let hz = crystal::measure().unwrap_or(0);
    let nominal = BOARD.clocks.crystal_hz;
    if hz != 0 && hz.abs_diff(nominal) > nominal / 100 * TOLERANCE_PERCENT {
        record::note_bring_up(Failure::CrystalWrong as u8, hz);
        defmt::error!("the crystal has {=u32} Hz, not {=u32} Hz", hz, nominal);
        rest(Failure::CrystalWrong, hz);
    }
    record::forget_bring_up();
    defmt::info!("crystal {=u32} Hz", hz);
    hz
}

/// Keeps the fault, and stays with the outputs disconnected until the next reset by pin or power.
fn rest(failure: Failure, detail: u32) -> ! {
    record::keep_found_at_boot(Fault::ClockFailure, detail);
    blink(failure)
}

/// Blinks the number of `failure` for ever. Uses registers only, so it runs without RAM that works.
pub fn blink(failure: Failure) -> ! {
    clock::keep_debug_bits(); // waits count cycles
    loop {
        blink_once(failure, MS, || false);
    }
}

/// Waits until `is_enough` says that the supply suffices, as long as it takes. Reports a wait of
/// more than 25 ms.
pub fn wait_for_supply(is_enough: fn() -> bool) {
    if within(REPORT_MS * PLL_MS, is_enough).is_some() {
        return;
    }
    record::note_bring_up(Failure::SupplyLow as u8, 0);
    defmt::warn!("the supply is too low to start; waiting");
    while !is_enough() {
        blink_once(Failure::SupplyLow, PLL_MS, is_enough);
    }
    led::set(false);
    record::forget_bring_up();
}

/// Blinks the number of `failure` once: 200 ms on, 200 ms off, and 800 ms more after the last. `ms`
/// is the number of core cycles in a millisecond. Ends early when `is_over` holds.
fn blink_once(failure: Failure, ms: u32, is_over: impl Fn() -> bool) {
    // Returns whether the wait ended early. At most 800 · 168 000 cycles, below 2^32.
    let wait = |n: u32| within(n * ms, &is_over).is_some();
    for _ in 0..failure as u8 {
        led::set(true);
        let is_over = wait(200);
        led::set(false);
        if is_over || wait(200) {
            return;
        }
    }
    wait(800);
}
