//! The guard's own memory: sealed between refills, so that a bit that changes by
//! itself is a fault before it is an amplitude, a state or a timeout.

use super::{Guard, bit};
use crate::pulse::CHANNELS;
use crate::safety::Fault;
use crate::seal::{Seal, Turn};
use core::hash::Hash;

/// Sums over the guard's memory, and what of it a refill has changed.
#[derive(Debug)]
pub(super) struct Seals {
    core: Seal,
    /// Over what the setup says of all channels.
    common: Seal,
    /// Of each channel: over what was armed, over what changes.
    channels: [(Seal, Seal); CHANNELS],
    /// Channels changed since they were sealed.
    open: u16,
    /// A seal did not hold.
    broken: bool,
    /// State and timeouts have changed since they were sealed.
    core_open: bool,
    /// The channel whose seal is looked at, whether it is used or not.
    turn: Turn,
}

impl Default for Seals {
    fn default() -> Self {
        Self {
            core: Seal::default(),
            common: Seal::default(),
            channels: [(Seal::default(), Seal::default()); CHANNELS],
            open: 0,
            broken: false,
            core_open: true,
            turn: Turn::new(2, CHANNELS as u8 + 1),
        }
    }
}

impl Guard {
    /// Looks at the seals, at the start of a refill: state and time of the last host
    /// frame each time; one channel after the other, and timeouts, in their turn.
    ///
    /// # Errors
    /// [`Fault::Memory`].
    pub fn check_memory(&mut self) -> Result<(), Fault> {
        let turn = self.seals.turn.next();
        let is_broken = !self.seals.core.holds(&self.core())
            || turn.is_some_and(|channel| !self.holds(channel));
        self.seals.broken |= is_broken;
        if self.seals.broken {
            return Err(Fault::Memory);
        }
        Ok(())
    }

    /// Whether a seal looked at since then did not hold.
    ///
    /// # Errors
    /// [`Fault::Memory`].
    pub const fn check_seen(&self) -> Result<(), Fault> {
        if self.seals.broken {
            return Err(Fault::Memory);
        }
        Ok(())
    }

    /// Seals what has changed, at the end of whatever changes it.
    #[inline]
    pub fn seal(&mut self) {
        if core::mem::take(&mut self.seals.core_open) {
            let core = Seal::of(&self.core());
            self.seals.core = core;
        }
        let mut open = core::mem::take(&mut self.seals.open);
        while open != 0 {
            let channel = open.trailing_zeros() as usize; // below CHANNELS
            open &= open.wrapping_sub(1);
            let seal = Seal::of(&self.amplitudes(channel));
            if let Some((_, slot)) = self.seals.channels.get_mut(channel) {
                *slot = seal;
            }
        }
    }

    /// Everything is new, with a new setup or without.
    pub(super) fn renew_seals(&mut self) {
        self.seals.open = (1 << CHANNELS) - 1;
        (self.seals.broken, self.seals.core_open) = (false, true);
        let common = Seal::of(&self.common());
        self.seals.common = common;
        for channel in 0..CHANNELS {
            let seal = self.armed(channel);
            if let Some((slot, _)) = self.seals.channels.get_mut(channel) {
                *slot = seal;
            }
        }
    }

    /// Whether `channel`'s amplitudes may be read and changed until the next
    /// [`Self::seal`]: they are as they were left.
    #[inline(never)]
    pub(super) fn open(&mut self, channel: u8) -> bool {
        self.open_here(channel)
    }

    /// [`Self::open`] where a call would show: with each burst and each setpoint.
    #[inline(always)]
    pub(super) fn open_here(&mut self, channel: u8) -> bool {
        let bit = bit(channel);
        if self.seals.open & bit != 0 {
            return true;
        }
        let index = usize::from(channel);
        let seals = self.seals.channels.get(index);
        let holds = seals.is_none_or(|(_, seal)| seal.holds(&self.amplitudes(index)));
        self.seals.broken |= !holds;
        if holds {
            self.seals.open |= bit;
        }
        holds
    }

    /// Whether `channel` may begin a burst: what was armed is as it was, too.
    pub(super) fn open_burst(&mut self, channel: u8) -> bool {
        let index = usize::from(channel);
        let seals = self.seals.channels.get(index);
        let holds = seals.is_none_or(|(seal, _)| *seal == self.armed(index));
        self.seals.broken |= !holds;
        holds && self.open_here(channel)
    }

    /// Seals what is armed of `channel`, which was changed after [`Self::open_burst`].
    pub(super) fn seal_armed(&mut self, channel: u8) {
        let index = usize::from(channel);
        let armed = self.armed(index);
        if let Some((seal, _)) = self.seals.channels.get_mut(index) {
            *seal = armed;
        }
    }

    /// Something sealed elsewhere was not as it was left.
    pub(super) const fn break_seal(&mut self) {
        self.seals.broken = true;
    }

    /// State, timeouts, stop or time of the last host frame may change until the next
    /// [`Self::seal`].
    pub(super) const fn open_core(&mut self) {
        self.seals.core_open = true;
    }

    /// Whether a channel's memory is as it was left; behind the last, what the setup
    /// says of all and the next order that waits.
    #[inline]
    fn holds(&self, channel: usize) -> bool {
        match self.seals.channels.get(channel) {
            Some((armed, seal)) => {
                *armed == self.armed(channel) && seal.holds(&self.amplitudes(channel))
            }
            None => self.seals.common.holds(&self.common()) && self.waiting.is_whole(),
        }
    }

    /// Whether everything that was armed is as it was; if not, the refill ends in a
    /// fault.
    pub(super) fn is_whole(&mut self) -> bool {
        self.seals.broken |= !self.holds(CHANNELS);
        for channel in 0..CHANNELS as u8 {
            self.open_burst(channel);
        }
        !self.seals.broken
    }

    fn core(&self) -> impl Hash + '_ {
        (&self.mode, self.heard, self.held, self.allowance.due())
    }

    /// The wearer's limits and timeouts, groups, sync, which channels are controlled.
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

    /// Over what was armed of a channel. Once in the image: it is long.
    #[inline(never)]
    fn armed(&self, index: usize) -> Seal {
        let setup = self.setup.as_ref();
        let channel = setup.and_then(|setup| setup.channels.get(index)?.as_ref());
        Seal::of(&(channel, self.loads.get(index).map_or(0, |load| load.word())))
    }

    fn amplitudes(&self, index: usize) -> impl Hash + '_ {
        // One `None` for all: each costs a word of the sum.
        let wanted = self.wanted.get(index).zip(self.rises.get(index));
        let shown = self.in_force.get(index).zip(self.watches.get(index));
        let charge = self.allowance.charge(index);
        wanted.zip(shown).map(|pair| (pair, charge))
    }
}
