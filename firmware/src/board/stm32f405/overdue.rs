//! The second clock: SysTick, which the core clocks and every refill restarts. Device time
//! and the refill's interrupt hang on TIM1 and TIM2; what slows or stops these, nothing
//! else would show before the watchdog bites, 4 to 12 ms later, and a phase that is
//! driven lasts that long.

use crate::board::wiring::BOARD;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// From a refill to when the next is overdue, core cycles: 300 µs. One comes
/// every 250 µs, late by what masks interrupts, a few µs.
const CYCLES: u32 = 300 * BOARD.clocks.cycles_per_us();

/// Starts it.
pub fn start(clock: &mut SYST) {
    clock.set_clock_source(SystClkSource::Core);
    clock.set_reload(CYCLES - 1);
    clock.clear_current();
    clock.enable_interrupt();
    clock.enable_counter();
}
