//! Checksums over the guard's own memory between refills, so that a bit flip becomes a fault
//! before it becomes an amplitude, a state or a timeout.

use super::{Guard, bit};
use crate::pulse::CHANNELS;
use crate::safety::Fault;
use crate::seal::{CheckSchedule, Checksum};
use core::hash::Hash;

/// Checksums over the guard's memory, and which parts a refill has changed.
#[derive(Clone, Debug)]
pub(super) struct GuardChecksums {
    core: Checksum,
    /// Checksum over the part of the setup that concerns all channels.
    common: Checksum,
    /// Checksums of each channel: over its armed configuration, and over its changing state.
    channels: [(Checksum, Checksum); CHANNELS],
    /// Channels changed since their checksums were computed, bit i for channel i.
    open: u16,
    /// Whether a checksum did not match.
    broken: bool,
    /// Whether state and timeouts have changed since their checksum was computed.
    core_open: bool,
    /// Selects the channel whose checksums are verified next. Unused channels take their turn, too.
    turn: CheckSchedule,
}

impl Default for GuardChecksums {
    fn default() -> Self {
        Self {
            core: Checksum::default(),
            common: Checksum::default(),
            channels: [(Checksum::default(), Checksum::default()); CHANNELS],
            open: 0,
            broken: false,
            core_open: true,
            turn: CheckSchedule::new(2, CHANNELS as u8 + 1),
        }
    }
}

impl Guard {
    /// Verifies checksums at the start of a refill: in every refill those over the state and over
    /// the time of the last host frame; in turn those of one channel or of the common part of the
    /// setup.
    ///
    /// # Errors
    /// [`Fault::Memory`] if one does not match.
    pub fn check_memory(&mut self) -> Result<(), Fault> {
        let turn = self.seals.turn.next();
        let is_broken = !self.seals.core.matches(&self.core())
            || turn.is_some_and(|channel| !self.is_channel_intact(channel));
        self.seals.broken |= is_broken;
        if self.seals.broken {
            return Err(Fault::Memory);
        }
        Ok(())
    }

    /// Checks that no checksum verified since [`Self::check_memory`] failed.
    ///
    /// # Errors
    /// [`Fault::Memory`] if one did not match.
    pub const fn check_no_mismatch(&self) -> Result<(), Fault> {
        if self.seals.broken {
            return Err(Fault::Memory);
        }
        Ok(())
    }

    /// Renews the checksums of changed memory; called at the end of everything that changes it.
    #[inline]
    pub fn renew_checksums(&mut self) {
        if core::mem::take(&mut self.seals.core_open) {
            let core = Checksum::of(&self.core());
            self.seals.core = core;
        }
        let mut open = core::mem::take(&mut self.seals.open);
        while open != 0 {
            let channel = open.trailing_zeros() as usize; // below CHANNELS
            open &= open.wrapping_sub(1);
            let seal = Checksum::of(&self.amplitudes(channel));
            if let Some((_, slot)) = self.seals.channels.get_mut(channel) {
                *slot = seal;
            }
        }
    }

    /// Renews all checksums and forgets earlier mismatches: at boot, and when a setup is armed.
    pub(super) fn renew_all_checksums(&mut self) {
        self.seals.open = (1 << CHANNELS) - 1;
        (self.seals.broken, self.seals.core_open) = (false, true);
        let common = Checksum::of(&self.common());
        self.seals.common = common;
        for channel in 0..CHANNELS {
            let seal = self.armed_checksum(channel);
            if let Some((slot, _)) = self.seals.channels.get_mut(channel) {
                *slot = seal;
            }
        }
    }

    /// Verifies `channel`'s amplitudes, and returns whether they may be read and changed until the
    /// next [`Self::renew_checksums`].
    #[inline(never)]
    pub(super) fn verify_channel(&mut self, channel: u8) -> bool {
        self.verify_channel_inlined(channel)
    }

    /// Does the same as [`Self::verify_channel`], inlined where the cost of a call would be
    /// noticeable: at each burst and each setpoint.
    #[inline(always)]
    pub(super) fn verify_channel_inlined(&mut self, channel: u8) -> bool {
        let bit = bit(channel);
        if self.seals.open & bit != 0 {
            return true;
        }
        let index = usize::from(channel);
        let seals = self.seals.channels.get(index);
        let holds = seals.is_none_or(|(_, seal)| seal.matches(&self.amplitudes(index)));
        self.seals.broken |= !holds;
        if holds {
            self.seals.open |= bit;
        }
        holds
    }

    /// Returns whether `channel` may begin a burst: its armed configuration must be unchanged,
    /// too.
    pub(super) fn verify_channel_for_burst(&mut self, channel: u8) -> bool {
        let index = usize::from(channel);
        let seals = self.seals.channels.get(index);
        let holds = seals.is_none_or(|(seal, _)| *seal == self.armed_checksum(index));
        self.seals.broken |= !holds;
        holds && self.verify_channel_inlined(channel)
    }

    /// Renews the checksum of a channel's armed configuration, which was changed after
    /// [`Self::verify_channel_for_burst`].
    pub(super) fn renew_armed_checksum(&mut self, channel: u8) {
        let index = usize::from(channel);
        let armed = self.armed_checksum(index);
        if let Some((seal, _)) = self.seals.channels.get_mut(index) {
            *seal = armed;
        }
    }

    /// Notes that a checksum kept elsewhere did not match.
    pub(super) const fn note_checksum_mismatch(&mut self) {
        self.seals.broken = true;
    }

    /// Lets state, timeouts, held inputs or time of the last host frame change until the next
    /// [`Self::renew_checksums`].
    pub(super) const fn open_core(&mut self) {
        self.seals.core_open = true;
    }

    /// Returns whether a channel's memory is unchanged. The index behind the last channel stands
    /// for the common part of the setup and the next timed setpoint.
    #[inline]
    fn is_channel_intact(&self, channel: usize) -> bool {
        match self.seals.channels.get(channel) {
            Some((armed, seal)) => {
                *armed == self.armed_checksum(channel) && seal.matches(&self.amplitudes(channel))
            }
            None => self.seals.common.matches(&self.common()) && self.waiting.is_first_intact(),
        }
    }

    /// Verifies the whole armed configuration. If it has changed, the refill ends in a fault.
    pub(super) fn is_armed_setup_intact(&mut self) -> bool {
        self.seals.broken |= !self.is_channel_intact(CHANNELS);
        for channel in 0..CHANNELS as u8 {
            self.verify_channel_for_burst(channel);
        }
        !self.seals.broken
    }

    fn core(&self) -> impl Hash + '_ {
        (
            &self.mode,
            self.heard,
            self.held,
            self.allowance.next_count_time(),
        )
    }

    /// Returns the part of the setup that concerns all channels: the wearer's limits and timeouts,
    /// groups, sync, which channels are driven by a controller, and the sums at the common return.
    fn common(&self) -> impl Hash + '_ {
        let setup = self.setup.as_ref();
        setup.map(|setup| {
            (
                &setup.wearer,
                &setup.groups,
                setup.sync,
                setup.controlled,
                setup.sums,
            )
        })
    }

    /// Computes the checksum over a channel's armed configuration. Never inlined, because it is
    /// long and the image needs only one copy.
    #[inline(never)]
    fn armed_checksum(&self, index: usize) -> Checksum {
        let setup = self.setup.as_ref();
        let channel = setup.and_then(|setup| setup.channels.get(index)?.as_ref());
        Checksum::of(&(channel, self.loads.get(index).map_or(0, |load| load.word())))
    }

    fn amplitudes(&self, index: usize) -> impl Hash + '_ {
        // One `None` for all: each costs a word of the checksum.
        let wanted = self.wanted.get(index).zip(self.rises.get(index));
        let shown = self.in_force.get(index).zip(self.watches.get(index));
        let charge = self.allowance.charge(index);
        wanted.zip(shown).map(|pair| (pair, charge))
    }
}
