//! What happens at which microsecond of one window.

use crate::pulse::WINDOW_US;
use crate::units::Micros;

const WORDS: usize = WINDOW_US.div_ceil(32) as usize;
const _: () = assert!(WINDOW_US <= 256);

/// Channels by slot. Every operation costs the same however much is entered.
#[derive(Debug)]
pub(super) struct Agenda {
    start: Micros,
    /// Bit n: slot n has an entry.
    taken: [u32; WORDS],
    /// First word of `taken` that may have a bit.
    word: usize,
    /// Channels with an edge there, bit i is channel i; valid where `taken`.
    channels: [u16; 256],
}

impl Agenda {
    pub(super) const fn new() -> Self {
        Self {
            start: Micros(0),
            taken: [0; WORDS],
            word: 0,
            channels: [0; 256],
        }
    }

    /// Empties the agenda for the window at `start`.
    pub(super) const fn begin(&mut self, start: Micros) {
        (self.start, self.taken, self.word) = (start, [0; WORDS], 0);
    }

    /// Enters an edge of `channel`, unless it lies outside the window. What is
    /// earlier than an entry taken out may stay in.
    pub(super) fn enter(&mut self, at: Micros, channel: usize) {
        let offset = at.0.wrapping_sub(self.start.0);
        let Some((word, channels)) = self.places(offset) else {
            return;
        };
        let (slot, channel) = (1u32 << (offset % 32), 1u16 << (channel % 16));
        *channels = if *word & slot == 0 { 0 } else { *channels } | channel;
        *word |= slot;
    }

    /// Takes back what was entered.
    pub(super) fn withdraw(&mut self, at: Micros, channel: usize) {
        if let Some((_, channels)) = self.places(at.0.wrapping_sub(self.start.0)) {
            *channels &= !(1 << (channel % 16)); // an empty entry does no harm
        }
    }

    /// Takes out the earliest entry: its slot and channels.
    pub(super) fn next(&mut self) -> Option<(u8, u16)> {
        loop {
            let word = self.taken.get_mut(self.word)?;
            if *word != 0 {
                let slot = self.word * 32 + word.trailing_zeros() as usize; // below 256
                *word &= word.wrapping_sub(1);
                return Some((slot as u8, *self.channels.get(slot)?));
            }
            self.word += 1;
        }
    }

    fn places(&mut self, offset: u32) -> Option<(&mut u32, &mut u16)> {
        if offset >= WINDOW_US {
            return None;
        }
        let word = self.taken.get_mut(offset as usize / 32)?;
        Some((word, self.channels.get_mut(offset as usize)?))
    }
}
