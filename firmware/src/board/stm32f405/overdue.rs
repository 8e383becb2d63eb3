//! Refill watchdog: SysTick, which the core clocks and every refill restarts. Device time and the
//! refill interrupt depend on TIM1 and TIM2. If these slowed down or stopped, only the watchdog
//! would notice, 4 to 12 ms later, and a driven phase would last that long.

use crate::board::wiring::BOARD;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// Time from a refill until the next counts as overdue, core cycles: 300 µs. Refills come every 250
/// µs, delayed by a few µs while interrupts are masked.
const CYCLES: u32 = 300 * BOARD.clocks.cycles_per_us();

/// Starts SysTick with its interrupt.
pub fn start(clock: &mut SYST) {
    clock.set_clock_source(SystClkSource::Core);
    clock.set_reload(CYCLES - 1);
    clock.clear_current();
    clock.enable_interrupt();
    clock.enable_counter();
}
