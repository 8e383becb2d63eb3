//! Timed setpoints. On arrival they are checked against the limits that hold at all times, and
//! when they are due against all limits.

use super::Guard;
use super::amplitude::check_stimulus;
use crate::pulse::WINDOW_US;
use crate::safety::{Denial, Timed, limits};
use crate::units::{Micros, us};

impl Guard {
    /// Queues the timed setpoint `order` until it is due, in the window at `start` or later.
    ///
    /// # Errors
    /// Refuses if the device is not armed, the setpoint is too far ahead, it is due less than a
    /// window after the latest queued setpoint, or the queue is full. Also refuses what
    /// [`Self::set_amplitudes`] would refuse whatever the present amplitudes are.
    #[inline(never)]
    pub fn queue_timed_order(&mut self, order: &Timed, start: Micros) -> Result<(), Denial> {
        let setup = self.setup_for_orders()?;
        if (order.at - start).us() > limits::AHEAD_US.cast_signed() {
            return Err(Denial::TooFarAhead);
        }
        if let Some(latest) = self.waiting.last_due_time() {
            let least = latest + us(WINDOW_US);
            if order.at.is_before(least) {
                let least_us = least.elapsed_since(start);
                return Err(Denial::TimeGoesBack { least_us });
            }
        }
        if self.waiting.is_full() {
            return Err(Denial::TooManyWaiting);
        }
        for (channel, stimulus) in order.stimuli.channels() {
            check_stimulus(setup, channel, stimulus)?;
        }
        self.waiting.push(order);
        Ok(())
    }

    /// Drops all timed setpoints that are not due yet.
    pub fn clear_timed_orders(&mut self) {
        self.waiting.clear();
    }

    /// Returns whether a queued setpoint is due before `end`.
    #[inline(always)]
    #[must_use]
    pub fn is_order_due(&self, end: Micros) -> bool {
        self.waiting
            .first_due_time()
            .is_some_and(|at| at.is_before(end))
    }

    /// Removes and returns the queued setpoint that is due at `until` or before; `until` lies in
    /// the window at `start`. The result is `None` and the refill ends in a fault if the setpoint's
    /// memory has changed by itself, or if it was due in an earlier window, which should have taken
    /// it.
    #[inline(never)]
    pub fn take_due_order(&mut self, until: Micros, start: Micros) -> Option<Timed> {
        if !self.is_order_due(until + us(1)) {
            return None;
        }
        let (order, is_whole) = self.waiting.pop()?;
        if !is_whole || order.at.is_before(start) {
            self.note_checksum_mismatch();
            return None;
        }
        Some(order)
    }
}
