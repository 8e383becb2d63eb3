//! Changes while a train plays: the width of its phases, and its period.

use super::{Lane, Phase};
use crate::units::{Micros, us};
use core::num::NonZeroU16;

impl Lane {
    /// Returns the width of a phase of the burst in progress, or of the latest burst, µs.
    pub(in crate::pulse::scheduler) fn width_us(&self) -> u16 {
        let [first, ..] = &self.stretches;
        first.map_or(0, |first| first.length_us.get())
    }

    /// Sets the width of the phases in the burst that begins; `None` means the train's own width.
    #[inline]
    pub(super) fn set_width(&mut self, width_us: Option<NonZeroU16>) {
        let width_us = width_us.map_or(self.train.spec().width_us, NonZeroU16::get);
        if width_us != self.width_us() {
            self.change_width(width_us);
        }
    }

    #[inline(never)]
    fn change_width(&mut self, width_us: u16) {
        let Some(width_us) = NonZeroU16::new(width_us) else {
            return; // a train's own is 10 µs or more
        };
        let [first, _, second] = &mut self.stretches;
        for phase in [first, second].into_iter().flatten() {
            phase.length_us = width_us;
        }
        self.renew_train_checksum();
    }

    /// Changes the period. A burst that has not begun is moved to the new period after the
    /// previous burst, but not before `earliest`. Returns whether it was moved.
    pub(in crate::pulse::scheduler) fn set_period(
        &mut self,
        period_us: u32,
        earliest: Micros,
    ) -> bool {
        if period_us == self.period_us || !self.is_state_intact() {
            return false; // an unsealed one is found with its next edge
        }
        let moved = self.move_to_period(period_us, earliest);
        self.renew_checksum();
        moved
    }

    fn move_to_period(&mut self, period_us: u32, earliest: Micros) -> bool {
        self.period_us = period_us;
        if self.since_burst_us == 0
            || self.phase != Phase::Rest
            || self.pulse != 0
            || self.due.is_none()
        {
            return false;
        }
        let before = self.burst_start - us(self.since_burst_us);
        let next = before + us(period_us);
        self.burst_start = if next.is_before(earliest) {
            earliest
        } else {
            next
        };
        self.since_burst_us = self.burst_start.elapsed_since(before);
        self.due = Some(self.burst_start);
        true
    }
}
