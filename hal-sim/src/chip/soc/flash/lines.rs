//! A fully associative memory of flash lines with least-recently-used replacement.

/// Number that stands for no line.
pub(super) const NONE: u32 = u32::MAX;
/// Number of 128-bit lines in the flash.
pub(super) const COUNT: usize = super::SIZE / 16;
const NO_SLOT: u8 = u8::MAX;

/// Marks both ends of the order of use.
const END: u8 = NO_SLOT;

/// Up to `N` retained lines (a power of two, at most 128). Looking a line up takes one table
/// access, and so does finding the line to replace.
#[derive(Clone, Debug)]
pub(super) struct Lines<const N: usize> {
    /// Slot of each line of the flash, by line number, and of the line behind the end of the flash.
    slot_of: Vec<u8>,
    line_in: [u32; N],
    /// For each slot, the slot that was used next after it. The slots form a ring through [`END`],
    /// in which empty slots come first and the others follow in the order of their use.
    later: [u8; 256],
    /// For each slot, the slot that precedes it in the ring of `later`.
    earlier: [u8; 256],
    /// Lines retained from before a change of the flash: a hit would deliver their old content.
    stale: Vec<u32>,
}

/// Two memories are equal if they hold the same lines in the same order of use; the slots do not
/// matter.
impl<const N: usize> PartialEq for Lines<N> {
    fn eq(&self, other: &Self) -> bool {
        self.stale == other.stale && self.in_order().eq(other.in_order())
    }
}

impl<const N: usize> Lines<N> {
    /// Returns the lines, the least recently used one first.
    fn in_order(&self) -> impl Iterator<Item = u32> {
        let after = |slot: u8| Some(self.later[usize::from(slot)]).filter(|value| *value != END);
        let slots = std::iter::successors(after(END), move |slot| after(*slot));
        slots.map(|slot| self.line_in[usize::from(slot)])
    }

    pub(super) fn new() -> Self {
        let mut lines = Self {
            slot_of: vec![NO_SLOT; COUNT + 1],
            line_in: [NONE; N],
            later: [END; 256],
            earlier: [END; 256],
            stale: Vec::new(),
        };
        for slot in 0..N {
            lines.link(slot as u8, lines.earlier[usize::from(END)]); // < N
        }
        lines
    }

    /// Returns whether `line` is retained; does not count as a use.
    #[inline]
    pub(super) fn holds(&self, line: u32) -> bool {
        self.slot_of[line as usize] != NO_SLOT
    }

    /// Returns whether `line` is retained, and counts this as a use.
    #[inline]
    pub(super) fn hit(&mut self, line: u32) -> bool {
        let slot = self.slot_of[line as usize];
        if slot == NO_SLOT {
            return false;
        }
        self.touch(slot);
        true
    }

    /// Makes `slot` the most recently used one.
    #[inline]
    fn touch(&mut self, slot: u8) {
        let last = self.earlier[usize::from(END)];
        if last != slot {
            self.unlink(slot);
            self.link(slot, last);
        }
    }

    #[inline]
    fn unlink(&mut self, slot: u8) {
        let (before, after) = (
            self.earlier[usize::from(slot)],
            self.later[usize::from(slot)],
        );
        self.later[usize::from(before)] = after;
        self.earlier[usize::from(after)] = before;
    }

    /// Inserts `slot` behind `before` in the order of use.
    #[inline]
    fn link(&mut self, slot: u8, before: u8) {
        let after = self.later[usize::from(before)];
        self.earlier[usize::from(slot)] = before;
        self.later[usize::from(slot)] = after;
        self.later[usize::from(before)] = slot;
        self.earlier[usize::from(after)] = slot;
    }

    /// Returns whether the cache would deliver `line` as it was before the flash changed.
    #[inline]
    pub(super) fn is_stale(&self, line: u32) -> bool {
        !self.stale.is_empty() && self.stale.contains(&line)
    }

    /// Inserts `line`, which must not be retained yet, into an empty slot or that of the least
    /// recently used line.
    pub(super) fn insert(&mut self, line: u32) {
        let slot = self.later[usize::from(END)];
        let place = &mut self.line_in[usize::from(slot) % N];
        let old = std::mem::replace(place, line);
        if old != NONE {
            self.slot_of[old as usize] = NO_SLOT;
        }
        self.slot_of[line as usize] = slot;
        self.touch(slot);
    }

    /// Removes all lines, as ICRST and DCRST do.
    pub(super) fn clear(&mut self) {
        for slot in 0..N {
            self.empty(slot);
        }
        self.stale.clear();
    }

    /// Marks retained `lines` as outdated after the flash has changed.
    pub(super) fn outdate(&mut self, lines: std::ops::Range<u32>) {
        for slot in 0..N {
            let line = self.line_in[slot];
            if lines.contains(&line) {
                self.empty(slot);
                self.stale.push(line);
            }
        }
    }

    fn empty(&mut self, slot: usize) {
        let line = std::mem::replace(&mut self.line_in[slot], NONE);
        if line != NONE {
            self.slot_of[line as usize] = NO_SLOT;
        }
        let slot = slot as u8; // < N
        self.unlink(slot);
        self.link(slot, END);
    }
}
