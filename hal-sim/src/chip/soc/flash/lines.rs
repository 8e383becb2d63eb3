//! A fully associative memory of flash lines, replaced least recently used
//! first.

/// No line.
pub(super) const NONE: u32 = u32::MAX;
/// Number of 128-bit lines in the flash.
pub(super) const COUNT: usize = super::SIZE / 16;
const NO_SLOT: u8 = u8::MAX;

/// `N` (at most 255) retained lines. A look-up is one table access; only a miss
/// searches.
#[derive(Clone, Debug)]
pub(super) struct Lines<const N: usize> {
    /// Slot of every line of the flash, and of the line behind its end.
    slot_of: Vec<u8>,
    line_in: [u32; N],
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
            used: [0; N],
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
            self.uses += 1; // a u64 outlasts any run
            self.used[slot] = self.uses;
            true
        } else {
            false
        }
    }

    /// Whether `line` would be delivered with content from before a change.
    pub(super) fn is_stale(&self, line: u32) -> bool {
        self.stale.contains(&line)
    }

    /// Copies `line`, which is not here, over an empty or the least recently
    /// used one.
    pub(super) fn insert(&mut self, line: u32) {
        let slot = (0..N).min_by_key(|slot| self.used[*slot]).unwrap_or(0);
        let old = self.line_in[slot];
        if old != NONE {
            self.slot_of[old as usize] = NO_SLOT;
        }
        self.line_in[slot] = line;
        self.slot_of[line as usize] = slot as u8; // < N, at most 255
        self.uses += 1;
        self.used[slot] = self.uses;
    }

    /// ICRST, DCRST.
    pub(super) fn clear(&mut self) {
        for line in self.line_in {
            if line != NONE {
                self.slot_of[line as usize] = NO_SLOT;
            }
        }
        self.line_in = [NONE; N];
        self.used = [0; N];
        self.stale.clear();
    }

    /// The flash changed under `lines`.
    pub(super) fn outdate(&mut self, lines: std::ops::Range<u32>) {
        for slot in 0..N {
            let line = self.line_in[slot];
            if lines.contains(&line) {
                self.slot_of[line as usize] = NO_SLOT;
                self.line_in[slot] = NONE;
                self.used[slot] = 0;
                self.stale.push(line);
            }
        }
    }
}
