//! Amplitudes that wait for their time.

use super::Stimuli;
use crate::seal::Seal;
use crate::units::Micros;
use heapless::Deque;

/// Most orders that wait.
pub const MAX_TIMED: usize = 16;

/// An order that holds from a time on.
#[derive(Clone, Copy, Hash, Debug)]
pub struct Timed {
    /// Number of the request.
    pub seq: u16,
    /// Device time from which it holds.
    pub at: Micros,
    /// What is ordered.
    pub stimuli: Stimuli,
}

/// The orders that wait, by rising time, each under a seal.
#[derive(Debug)]
pub(super) struct Waiting(Deque<(Timed, Seal), MAX_TIMED>);

impl Waiting {
    /// None.
    pub(super) const NONE: Self = Self(Deque::new());

    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Whether as many wait as may.
    pub(super) fn is_full(&self) -> bool {
        self.0.is_full()
    }

    /// When the last of them is due.
    pub(super) fn latest(&self) -> Option<Micros> {
        self.0.back().map(|(order, _)| order.at)
    }

    /// When the next of them is due.
    #[inline(always)]
    pub(super) fn next(&self) -> Option<Micros> {
        self.0.front().map(|(order, _)| order.at)
    }

    /// Puts `order` behind the others; without room for it nothing changes.
    pub(super) fn push(&mut self, order: &Timed) {
        let _ = self.0.push_back((*order, Seal::of(order)));
    }

    /// The next order, and whether its memory is as it was left.
    pub(super) fn pop(&mut self) -> Option<(Timed, bool)> {
        let (order, seal) = self.0.pop_front()?;
        Some((order, seal.holds(&order)))
    }

    /// Whether the memory of the next order is as it was left.
    pub(super) fn is_whole(&self) -> bool {
        self.0.front().is_none_or(|(order, seal)| seal.holds(order))
    }
}
