//! Waits that end: for a condition, at most for a number of core cycles.

use cortex_m::peripheral::DWT;

/// Waits until `is_so` holds, for at most `cycles` core cycles; `None` if it does not hold by then.
/// The number of polls is bounded too, because a debugger may stop the cycle counter.
pub fn within(cycles: u32, is_so: impl Fn() -> bool) -> Option<()> {
    let since = DWT::cycle_count();
    for _ in 0..cycles {
        if is_so() {
            return Some(());
        }
        if DWT::cycle_count().wrapping_sub(since) > cycles {
            break;
        }
    }
    None
}
