//! Amplitudes that wait for their time: judged when they come by the limits that hold at
//! all times, and when they are due by all.

use super::Guard;
use super::amplitude::check_stimulus;
use crate::pulse::WINDOW_US;
use crate::safety::{Denied, Timed, limits};
use crate::units::{Micros, us};

impl Guard {
    /// Lets `order` wait; it is due in the window at `start` or later.
    ///
    /// # Errors
    /// Not armed, too far ahead, less than a window after the latest that waits, as many
    /// wait as may, or what [`Self::set_amplitudes`] refuses at any time.
    #[inline(never)]
    pub fn wait_for_time(&mut self, order: &Timed, start: Micros) -> Result<(), Denied> {
        let setup = self.setup_for_orders()?;
        if (order.at - start).us() > limits::AHEAD_US.cast_signed() {
            return Err(Denied::TooFarAhead);
        }
        if let Some(latest) = self.waiting.latest() {
            let least = latest + us(WINDOW_US);
            if order.at.is_before(least) {
                let least_us = least.elapsed_since(start);
                return Err(Denied::TimeGoesBack { least_us });
            }
        }
        if self.waiting.is_full() {
            return Err(Denied::TooManyWaiting);
        }
        for (channel, stimulus) in order.stimuli.channels() {
            check_stimulus(setup, channel, stimulus)?;
        }
        self.waiting.push(order);
        Ok(())
    }

    /// Forgets what waits.
    pub fn forget_waiting(&mut self) {
        self.waiting.clear();
    }

    /// Whether an order that waits is due before `end`.
    #[inline(always)]
    #[must_use]
    pub fn is_order_due(&self, end: Micros) -> bool {
        self.waiting.next().is_some_and(|at| at.is_before(end))
    }

    /// The order that waits and is due at `until` or before, which lies in the window at
    /// `start`. One whose memory is not as it was left is none, and the refill ends in a
    /// fault; so does one that was due in an earlier window, where it would have been taken.
    #[inline(never)]
    pub fn take_due(&mut self, until: Micros, start: Micros) -> Option<Timed> {
        if !self.is_order_due(until + us(1)) {
            return None;
        }
        let (order, is_whole) = self.waiting.pop()?;
        if !is_whole || order.at.is_before(start) {
            self.break_seal();
            return None;
        }
        Some(order)
    }
}
