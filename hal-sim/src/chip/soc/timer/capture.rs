//! Input capture of channel 1 (RM0090 18.3.5): synchroniser, filter, edge.

use super::{Timer, bit};
use crate::chip::Cycle;

/// Timer clocks from an edge, once sampled, to the input that filter and edge
/// detector see; RM0090 18.3.5 says that up to five may pass while an input
/// settles and gives no exact figure: two flip-flops assumed.
const SYNCHRONISATION: u64 = 2;

/// The way of the pin's level to the edge detector.
#[derive(Clone, Debug, Default)]
pub(super) struct Capture {
    /// Level after the filter.
    filtered: bool,
    /// When the filter will have seen enough equal samples of the other level.
    change: Option<Cycle>,
}

impl Capture {
    /// The pin became `high` at `at`. It must hold for `filter` samples, one a
    /// timer clock (0: no filter); a shorter pulse is lost.
    pub(super) fn set(&mut self, high: bool, at: Cycle, clock: u64, filter: u64) {
        let clocks = SYNCHRONISATION + filter;
        self.change = (high != self.filtered).then(|| at.next_multiple_of(clock) + clocks * clock);
    }

    /// Takes a filtered edge at or before `to`: its cycle, and whether it rose.
    #[inline]
    pub(super) fn pop(&mut self, to: Cycle) -> Option<(Cycle, bool)> {
        let at = self.change.filter(|&at| at <= to)?;
        self.change = None;
        self.filtered = !self.filtered;
        Some((at, self.filtered))
    }

    /// Cycle of the next filtered edge.
    pub(super) fn due(&self) -> Cycle {
        self.change.unwrap_or(Cycle::MAX)
    }
}

impl Timer {
    /// Samples of the filter of channel 1: 0, 2, 4 or 8 timer clocks; other
    /// settings are refused when they are written.
    pub(super) fn filter_clocks(&self) -> u64 {
        match self.ccmr[0] >> 4 & 0xF {
            1 => 2,
            2 => 4,
            3 => 8,
            _ => 0,
        }
    }

    /// A filtered edge of channel 1: latches the counter if it is captured.
    pub(super) fn capture(&mut self, rising: bool) {
        let enabled = self.ccer & bit::CC1E != 0;
        if !self.is_input(0) || !enabled || rising != (self.ccer & bit::CC1P == 0) {
            return;
        }
        self.ccr[0] = self.count;
        if self.sr & bit::CC1IF != 0 {
            self.sr |= bit::CC1OF;
        }
        self.sr |= bit::CC1IF;
    }
}
