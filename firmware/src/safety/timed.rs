//! The queue of timed setpoints.

use super::Stimuli;
use crate::seal::Checksum;
use crate::units::Micros;
use heapless::Deque;

/// Largest number of timed setpoints in the queue.
pub const MAX_TIMED: usize = 16;

/// A setpoint that takes effect at a given time.
#[derive(Clone, Copy, Hash, Debug)]
pub struct Timed {
    /// Sequence number of the host's request, for its answer.
    pub seq: u16,
    /// Device time at which the setpoint takes effect.
    pub at: Micros,
    /// Amplitudes and widths that become the wanted ones at that time.
    pub stimuli: Stimuli,
}

/// The queued setpoints in the order of their times, each with a checksum.
#[derive(Clone, Debug)]
pub(super) struct TimedOrders(Deque<(Timed, Checksum), MAX_TIMED>);

impl TimedOrders {
    /// The empty queue.
    pub(super) const NONE: Self = Self(Deque::new());

    /// Drops all queued setpoints.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Returns whether the queue holds [`MAX_TIMED`] setpoints.
    pub(super) fn is_full(&self) -> bool {
        self.0.is_full()
    }

    /// Returns when the last setpoint in the queue is due; `None` if the queue is empty.
    pub(super) fn last_due_time(&self) -> Option<Micros> {
        self.0.back().map(|(order, _)| order.at)
    }

    /// Returns when the first setpoint in the queue is due; `None` if the queue is empty.
    #[inline(always)]
    pub(super) fn first_due_time(&self) -> Option<Micros> {
        self.0.front().map(|(order, _)| order.at)
    }

    /// Appends `order` to the queue; if the queue is full, nothing changes.
    pub(super) fn push(&mut self, order: &Timed) {
        let _ = self.0.push_back((*order, Checksum::of(order)));
    }

    /// Removes the first setpoint, and returns it with whether its checksum matches.
    pub(super) fn pop(&mut self) -> Option<(Timed, bool)> {
        let (order, seal) = self.0.pop_front()?;
        Some((order, seal.matches(&order)))
    }

    /// Appends an order with a changed request number and the checksum of the original.
    #[cfg(test)]
    pub(super) fn push_spoiled(&mut self, order: &Timed) {
        let seal = Checksum::of(order);
        let seq = order.seq ^ 1;
        let _ = self.0.push_back((Timed { seq, ..*order }, seal));
    }

    /// Returns whether the checksum of the first setpoint matches; also true for an empty queue.
    pub(super) fn is_first_intact(&self) -> bool {
        self.0
            .front()
            .is_none_or(|(order, seal)| seal.matches(order))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pulse::CHANNELS;
    use crate::units::Amplitude;

    const ORDER: Timed = Timed {
        seq: 7,
        at: Micros::new(u32::MAX - 3),
        stimuli: Stimuli {
            mask: 0b10_0000_0001,
            values: [Amplitude::new(20_000); CHANNELS],
            widths: [200; CHANNELS],
        },
    };

    /// Returns whether the checksum reveals `spoiled` in place of [`ORDER`], while it is queued
    /// and when it is taken.
    fn is_found(spoiled: Timed) -> bool {
        let mut waiting = TimedOrders::NONE;
        waiting.push(&ORDER);
        waiting.0.front_mut().unwrap().0 = spoiled;
        let is_found = !waiting.is_first_intact();
        let (_, is_whole) = waiting.pop().unwrap();
        assert_eq!(is_whole, !is_found);
        is_found
    }

    #[test]
    fn every_bit_of_an_order_that_waits_is_summed() {
        assert!(!is_found(ORDER));
        for bit in 0..32 {
            let at = Micros::new(ORDER.at.get() ^ 1 << bit);
            assert!(is_found(Timed { at, ..ORDER }), "time, bit {bit}");
            for n in 0..CHANNELS {
                let mut order = ORDER;
                order.stimuli.values[n] = Amplitude::new(20_000 ^ 1 << bit);
                assert!(is_found(order), "amplitude {n}, bit {bit}");
            }
        }
        for bit in 0..16 {
            let seq = ORDER.seq ^ 1 << bit;
            assert!(is_found(Timed { seq, ..ORDER }), "number, bit {bit}");
            let mut order = ORDER;
            order.stimuli.mask ^= 1 << bit;
            assert!(is_found(order), "mask, bit {bit}");
            for n in 0..CHANNELS {
                let mut order = ORDER;
                order.stimuli.widths[n] ^= 1 << bit;
                assert!(is_found(order), "width {n}, bit {bit}");
            }
        }
    }
}
