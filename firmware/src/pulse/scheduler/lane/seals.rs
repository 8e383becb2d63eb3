//! Checksums over a lane's memory: its configuration, and its changing state.

use super::Lane;
use crate::seal::Checksum;
use core::hash::Hash;

impl Lane {
    /// Renews the checksum over train, stretches and tail, which are set once.
    pub(in crate::pulse::scheduler) fn renew_train_checksum(&mut self) {
        let seal = Checksum::of(&self.fixed());
        self.train_seal = seal;
    }

    /// Renews the checksum over the state that changes from edge to edge.
    #[inline]
    pub(in crate::pulse::scheduler) fn renew_checksum(&mut self) {
        let seal = Checksum::of(&self.moving());
        self.seal = seal;
    }

    /// Returns whether the checksum over the state that changes from edge to edge matches.
    #[inline]
    pub(in crate::pulse::scheduler) fn is_state_intact(&self) -> bool {
        self.seal.matches(&self.moving())
    }

    /// Returns whether both checksums match.
    pub(in crate::pulse::scheduler) fn is_intact(&self) -> bool {
        self.is_state_intact() && self.train_seal.matches(&self.fixed())
    }

    pub(super) fn fixed(&self) -> impl Hash + '_ {
        (&self.train, &self.stretches, self.tail_us)
    }

    // The recent pulses are not included: they only determine the residual charge that a fault
    // reports.
    fn moving(&self) -> impl Hash + '_ {
        let place = (self.phase, self.shows, self.stretch, self.due);
        let burst = (self.burst_start, self.period_us, self.since_burst_us);
        let left = (self.pulse, self.code, self.bursts_left, self.next_us);
        (place, burst, left)
    }
}
