//! What changes at which microsecond of one window.

use super::bits;
use crate::pulse::WINDOW_US;
use crate::units::Micros;

const SLOTS: usize = WINDOW_US as usize;
const _: () = assert!(SLOTS <= 256);

/// Changes of the picture by slot, entered in any order, handed over in time's.
/// Every operation costs the same however much is entered.
#[derive(Debug)]
pub(super) struct Agenda {
    start: Micros,
    /// Bit n of all words together: slot n has an entry.
    slots: [u32; SLOTS.div_ceil(32)],
    /// The bits of the picture that change there; none in slots without entry.
    changes: [u32; SLOTS],
}

impl Agenda {
    pub(super) const fn new() -> Self {
        Self {
            start: Micros::new(0),
            slots: [0; _],
            changes: [0; _],
        }
    }

    /// Forgets what was entered.
    pub(super) fn clear(&mut self) {
        self.slots.fill(0);
        self.changes.fill(0);
    }

    /// Turns to the window at `start`; what was entered has been handed over.
    pub(super) const fn begin(&mut self, start: Micros) {
        self.start = start;
    }

    /// When `at` is, µs after the window's start; most without.
    #[inline]
    pub(super) fn ahead(&self, at: Option<Micros>) -> u32 {
        match at {
            Some(at) => (at - self.start).us().cast_unsigned(),
            None => u32::MAX,
        }
    }

    /// The slot of `at`, not before the window; none after it.
    #[inline]
    pub(super) fn slot(&self, at: Micros) -> Option<u32> {
        let slot = (at - self.start).us().cast_unsigned();
        if slot < WINDOW_US { Some(slot) } else { None }
    }

    /// Enters that `bits` of the picture change at `slot`; nothing outside the
    /// window.
    #[inline]
    pub(super) fn enter(&mut self, slot: u32, bits: u32) {
        if let Some(changes) = self.changes.get_mut(slot as usize)
            && let Some(slots) = self.slots.get_mut((slot / 32) as usize)
        {
            *changes ^= bits;
            *slots |= 1 << (slot % 32);
        }
    }

    /// Hands over and forgets what changes, slot by slot, until `change` fails.
    #[inline]
    pub(super) fn drain<E>(
        &mut self,
        mut change: impl FnMut(u8, u32) -> Result<(), E>,
    ) -> Result<(), E> {
        for (word, slots) in self.slots.iter_mut().enumerate() {
            for slot in bits(core::mem::take(slots)).map(|n| (32 * word) | n) {
                if let Some(changes) = self.changes.get_mut(slot) {
                    change(slot as u8, core::mem::take(changes))?; // below 256
                }
            }
        }
        Ok(())
    }
}
