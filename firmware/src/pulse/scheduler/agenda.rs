//! The changes of the outputs in one window, ordered by microsecond.

use super::bit_positions;
use crate::pulse::WINDOW_US;
use crate::units::Micros;

const SLOTS: usize = WINDOW_US as usize;
const _: () = assert!(SLOTS <= 256);

/// The queue of changes of the outputs' `Picture` in one window. Changes are entered in any order
/// and handed over in the order of their slots. Each operation takes the same time however many
/// changes are queued.
#[derive(Clone, Debug)]
pub(super) struct EventQueue {
    start: Micros,
    /// Bitmap of the slots that have a change: bit n of all words together stands for slot n.
    slots: [u32; SLOTS.div_ceil(32)],
    /// Bits of the picture that change at each slot; 0 in slots without a change.
    changes: [u32; SLOTS],
}

impl EventQueue {
    pub(super) const fn new() -> Self {
        Self {
            start: Micros::new(0),
            slots: [0; _],
            changes: [0; _],
        }
    }

    /// Discards all changes.
    pub(super) fn clear(&mut self) {
        self.slots.fill(0);
        self.changes.fill(0);
    }

    /// Starts the window at `start`; the changes of the previous window have been handed over.
    pub(super) const fn begin(&mut self, start: Micros) {
        self.start = start;
    }

    /// Returns the time from the window's start to `at`, µs; [`u32::MAX`] for `None`.
    #[inline]
    pub(super) fn offset_us(&self, at: Option<Micros>) -> u32 {
        match at {
            Some(at) => (at - self.start).us().cast_unsigned(),
            None => u32::MAX,
        }
    }

    /// Returns the slot of `at`, which is not before the window; `None` if it is after the window.
    #[inline]
    pub(super) fn slot(&self, at: Micros) -> Option<u32> {
        let slot = (at - self.start).us().cast_unsigned();
        if slot < WINDOW_US { Some(slot) } else { None }
    }

    /// Enters that `bits` of the picture change at `slot`. A slot outside the window is ignored.
    #[inline]
    pub(super) fn insert(&mut self, slot: u32, bits: u32) {
        if let Some(changes) = self.changes.get_mut(slot as usize)
            && let Some(slots) = self.slots.get_mut((slot / 32) as usize)
        {
            *changes ^= bits;
            *slots |= 1 << (slot % 32);
        }
    }

    /// Passes every slot that has changes, with the changes, to `change` in the order of time, and
    /// removes them. Stops at the first error.
    #[inline]
    pub(super) fn drain<E>(
        &mut self,
        mut change: impl FnMut(u8, u32) -> Result<(), E>,
    ) -> Result<(), E> {
        for (word, slots) in self.slots.iter_mut().enumerate() {
            for slot in bit_positions(core::mem::take(slots)).map(|n| (32 * word) | n) {
                if let Some(changes) = self.changes.get_mut(slot) {
                    change(slot as u8, core::mem::take(changes))?; // below 256
                }
            }
        }
        Ok(())
    }
}
