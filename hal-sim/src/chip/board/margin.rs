//! Measures how early each window of the tape is ready before DMA needs it.

use super::CYCLES_PER_US;
use crate::chip::Cycle;

/// Length of a window of the pulse tape, cycles: 250 µs (docs/how/architecture.md).
const WINDOW: Cycle = 250 * CYCLES_PER_US;

/// Address range of the tape: SRAM2, which holds nothing else.
const SRAM2: std::ops::Range<u32> = 0x2001_C000..0x2002_0000;

/// Statistics of refill margins: how long before its deadline each window of the pulse tape was
/// complete. A margin is the number of cycles from the core's last write to the tape in a window to
/// the request at which a DMA stream fetches the next window's first word. In direct mode that
/// request comes one slot early, while the last slot plays (RM0090 section 10.3.12).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Margins {
    /// Number of windows in which the core wrote to the tape.
    pub windows: u64,
    /// Smallest margin of any window, cycles; negative if a write was too late, `None` without
    /// windows.
    pub worst: Option<i64>,
    /// Number of the window with the smallest margin, counted from device time 0.
    pub worst_window: u64,
    last_window: Option<u64>,
}

impl Margins {
    /// Records a write of the core to `address`, `at` cycles after device time 0.
    #[inline]
    pub(super) fn record_write(&mut self, address: u32, at: Cycle) {
        if SRAM2.contains(&address) {
            self.record(at);
        }
    }

    fn record(&mut self, at: Cycle) {
        let window = at / WINDOW;
        if self.last_window != Some(window) {
            self.last_window = Some(window);
            self.windows += 1;
        }
        let fetch = (window + 1) * WINDOW - CYCLES_PER_US;
        // Both are within one window of each other.
        let margin = fetch.cast_signed() - at.cast_signed();
        if self.worst.is_none_or(|worst| margin < worst) {
            self.worst = Some(margin);
            self.worst_window = window;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_write_of_a_window_counts_until_the_slot_before_the_next() {
        let mut margins = Margins::default();
        margins.record_write(0x2001_BFFC, 41_999);
        assert_eq!(margins, Margins::default(), "not the tape");
        margins.record_write(0x2001_C000, 1_000);
        margins.record_write(0x2001_C004, 2_000);
        let expected = (1, Some(249 * CYCLES_PER_US.cast_signed() - 2_000));
        assert_eq!((margins.windows, margins.worst), expected);
        margins.record_write(0x2001_C008, 42_000 + 10_000);
        assert_eq!((margins.windows, margins.worst_window), (2, 1));
        margins.record_write(0x2001_C008, 2 * 42_000 - 1);
        assert_eq!(margins.worst, Some(-167));
    }
}
