//! What changes at which microsecond of one window.

use super::{Picture, bits};
use crate::pulse::WINDOW_US;
use crate::units::Micros;

const WORDS: usize = WINDOW_US.div_ceil(32) as usize;
const _: () = assert!(WINDOW_US <= 256);

/// Changes of the picture by slot, entered in any order, handed over in time's.
/// Every operation costs the same however much is entered.
#[derive(Debug)]
pub(super) struct Agenda {
    start: Micros,
    /// Bit n: word n of `slots` is not zero.
    words: u32,
    /// Bit n: slot n has an entry; valid where `words`.
    slots: [u32; WORDS],
    /// The bits of the picture that change there; valid where `slots`.
    changes: [u32; 256],
}

impl Agenda {
    pub(super) const fn new() -> Self {
        Self {
            start: Micros(0),
            words: 0,
            slots: [0; WORDS],
            changes: [0; 256],
        }
    }

    /// Empties the agenda for the window at `start`.
    pub(super) const fn begin(&mut self, start: Micros) {
        (self.start, self.words) = (start, 0);
    }

    /// Whether `at`, not before the window, lies in it.
    pub(super) const fn holds(&self, at: Micros) -> bool {
        at.0.wrapping_sub(self.start.0) < WINDOW_US
    }

    /// Enters that a channel's part of the picture goes from `old` to `new`;
    /// nothing outside the window.
    #[inline]
    pub(super) fn enter(&mut self, at: Micros, old: Picture, new: Picture) {
        let slot = at.0.wrapping_sub(self.start.0);
        let word = slot / 32;
        if let Some(slots) = self.slots.get_mut(word as usize)
            && let Some(changes) = self.changes.get_mut(slot as usize)
        {
            // word < WORDS <= 8.
            let (in_words, in_slots) = (1 << word, 1 << (slot % 32));
            let before = if self.words & in_words == 0 {
                0
            } else {
                *slots
            };
            let other = if before & in_slots == 0 { 0 } else { *changes };
            *changes = other ^ old.0 ^ new.0;
            *slots = before | in_slots;
            self.words |= in_words;
        }
    }

    /// Hands over what changes, slot by slot, until `change` fails.
    #[inline]
    pub(super) fn in_order<E>(
        &self,
        mut change: impl FnMut(u8, u32) -> Result<(), E>,
    ) -> Result<(), E> {
        for word in bits(self.words) {
            let slots = self.slots.get(word).copied().unwrap_or(0);
            for slot in bits(slots).map(|n| 32 * word + n) {
                if let Some(&changes) = self.changes.get(slot) {
                    change(slot as u8, changes)?; // below 256
                }
            }
        }
        Ok(())
    }
}
