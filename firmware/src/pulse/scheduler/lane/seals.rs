//! Seals over a lane's memory: what was armed, and where it is.

use super::Lane;
use crate::seal::Seal;
use core::hash::Hash;

impl Lane {
    /// Seals what is set once.
    pub(in crate::pulse::scheduler) fn seal_train(&mut self) {
        let seal = Seal::of(&self.fixed());
        self.train_seal = seal;
    }

    /// Seals what has changed.
    #[inline]
    pub(in crate::pulse::scheduler) fn seal(&mut self) {
        let seal = Seal::of(&self.moving());
        self.seal = seal;
    }

    /// Whether what changes is as it was left.
    #[inline]
    pub(in crate::pulse::scheduler) fn is_sealed(&self) -> bool {
        self.seal.holds(&self.moving())
    }

    /// Whether everything is.
    pub(in crate::pulse::scheduler) fn is_whole(&self) -> bool {
        self.is_sealed() && self.train_seal.holds(&self.fixed())
    }

    pub(super) fn fixed(&self) -> impl Hash + '_ {
        (&self.train, &self.stretches, self.tail_us)
    }

    // Not the recent pulses: they only say what a fault left behind.
    fn moving(&self) -> impl Hash + '_ {
        let place = (self.phase, self.shows, self.stretch, self.due);
        let burst = (self.burst_start, self.period_us, self.since_burst_us);
        let left = (self.pulse, self.code, self.bursts_left, self.next_us);
        (place, burst, left)
    }
}
