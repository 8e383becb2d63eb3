//! A fully associative memory of flash lines, replaced least recently used
//! first.

/// No line.
pub(super) const NONE: u32 = u32::MAX;
/// Number of 128-bit lines in the flash.
pub(super) const COUNT: usize = super::SIZE / 16;
const NO_SLOT: u8 = u8::MAX;

/// `N` (a multiple of 4, at most 252) retained lines. A look-up is one table access; only a miss
/// searches.
#[derive(Clone, Debug)]
pub(super) struct Lines<const N: usize> {
    /// Slot of every line of the flash, and of the line behind its end.
    slot_of: Vec<u8>,
    line_in: [u32; N],
    /// When each slot was last used, 0 if empty: the count of uses, then the
    /// slot in the lower 8 bits.
    used: [u64; N],
    uses: u64,
    /// Lines retained from before the flash under them changed: they would be
    /// delivered with their old content.
    stale: Vec<u32>,
}

impl<const N: usize> Lines<N> {
    pub(super) fn new() -> Self {
        Self {
            slot_of: vec![NO_SLOT; COUNT + 1],
            line_in: [NONE; N],
            used: std::array::from_fn(|slot| slot as u64),
            uses: 0,
            stale: Vec::new(),
        }
    }

    /// Whether `line` is here; that is no use of it.
    #[inline]
    pub(super) fn holds(&self, line: u32) -> bool {
        self.slot_of[line as usize] != NO_SLOT
    }

    /// Uses `line` if it is here.
    #[inline]
    pub(super) fn hit(&mut self, line: u32) -> bool {
        let slot = usize::from(self.slot_of[line as usize]);
        if slot < N {
            self.touch(slot);
            true
        } else {
            false
        }
    }

    #[inline]
    fn touch(&mut self, slot: usize) {
        self.uses += 1; // 2^56 uses outlast any run
        self.used[slot] = self.uses << 8 | slot as u64;
    }

    /// An empty slot or the least recently used one. Four minima side by side
    /// do not wait for each other.
    fn least_recent(&self) -> usize {
        let mut least = [u64::MAX; 4];
        for four in self.used.chunks_exact(4) {
            for (least, used) in least.iter_mut().zip(four) {
                *least = (*least).min(*used);
            }
        }
        let least = least[0].min(least[1]).min(least[2].min(least[3]));
        (least & 0xFF) as usize % N
    }

    /// Whether `line` would be delivered with content from before a change.
    pub(super) fn is_stale(&self, line: u32) -> bool {
        self.stale.contains(&line)
    }

    /// Copies `line`, which is not here, over an empty or the least recently
    /// used one.
    pub(super) fn insert(&mut self, line: u32) {
        let slot = self.least_recent();
        let old = self.line_in[slot];
        if old != NONE {
            self.slot_of[old as usize] = NO_SLOT;
        }
        self.line_in[slot] = line;
        self.slot_of[line as usize] = slot as u8; // < N, at most 255
        self.touch(slot);
    }

    /// ICRST, DCRST.
    pub(super) fn clear(&mut self) {
        for line in self.line_in {
            if line != NONE {
                self.slot_of[line as usize] = NO_SLOT;
            }
        }
        self.line_in = [NONE; N];
        self.used = std::array::from_fn(|slot| slot as u64);
        self.stale.clear();
    }

    /// The flash changed under `lines`.
    pub(super) fn outdate(&mut self, lines: std::ops::Range<u32>) {
        for slot in 0..N {
            let line = self.line_in[slot];
            if lines.contains(&line) {
                self.slot_of[line as usize] = NO_SLOT;
                self.line_in[slot] = NONE;
                self.used[slot] = slot as u64;
                self.stale.push(line);
            }
        }
    }
}
