//! Random register contents and choices from a seed.

use hal_sim::random;
use std::ops::Range;

/// Generator of operands for instructions.
#[derive(Clone, Debug)]
pub(super) struct Random(random::Random);

impl Random {
    pub(super) const fn new(seed: u64) -> Self {
        Self(random::Random::new(seed))
    }

    pub(super) fn word(&mut self) -> u32 {
        self.0.word() as u32
    }

    /// Returns a number in `range`, which must not be empty.
    pub(super) fn within(&mut self, range: Range<u32>) -> u32 {
        range.start + self.word() % (range.end - range.start)
    }

    /// Returns `true` with a probability of 1/`n`.
    pub(super) fn once_in(&mut self, n: u32) -> bool {
        self.word().is_multiple_of(n)
    }

    pub(super) fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.word() as usize % from.len()]
    }

    /// Generates the contents of a core register, often an edge case.
    pub(super) fn integer(&mut self) -> u32 {
        const EDGES: [u32; 12] = [
            0,
            1,
            2,
            0x7F,
            0x80,
            0xFFFF,
            0x8000,
            0x7FFF_FFFF,
            0x8000_0000,
            0xFFFF_FFFF,
            0x8000_8000,
            0x7FFF_7FFF,
        ];
        let word = self.word();
        match self.within(0..6) {
            0 => self.pick(&EDGES),
            1 => word >> (word & 31),
            2 => (word as i32 >> (word & 31)) as u32,
            // As a shift amount, often about a word's width.
            3 if word & 0x100 == 0 => 30 + word % 5,
            3 => word & 0xFF,
            _ => word,
        }
    }

    /// Generates the contents of the floating-point registers. In one case of four all are edge
    /// cases, so that two or three of them meet in one instruction; in one of eight they are zero,
    /// infinity, NaNs and 1.
    pub(super) fn floats(&mut self) -> [u32; 32] {
        const FEW: [u32; 5] = [0, 0x3F80_0000, 0x7F80_0000, 0x7FC1_2345, 0x7F80_0001];
        if self.once_in(8) {
            return std::array::from_fn(|_| self.word() & 1 << 31 | self.pick(&FEW));
        }
        if self.once_in(4) {
            return std::array::from_fn(|_| self.word() & 1 << 31 | self.pick(&Self::EDGES));
        }
        std::array::from_fn(|_| self.float())
    }

    const EDGES: [u32; 12] = [
        0,
        0x0000_0001,
        0x007F_FFFF,
        0x0080_0000,
        0x3F80_0000,
        0x4F00_0000,
        0x4F80_0000,
        0x7F7F_FFFF,
        0x7F80_0000,
        0x7FC0_0000,
        0x7F80_0001,
        0x7FC1_2345,
    ];

    /// Generates a floating-point number of any kind.
    fn float(&mut self) -> u32 {
        let word = self.word();
        let sign = word & 1 << 31;
        match self.within(0..12) {
            0 | 1 => sign | self.pick(&Self::EDGES),
            2 => word,
            // Denormal, or just above.
            3 => word & 0x80FF_FFFF,
            // NaN.
            4 => word | 0x7F80_0000,
            // A small whole number, perhaps with a half or a quarter.
            5 | 6 => ((self.word() as i32 >> 20) as f32 / 4.0).to_bits(),
            // Near the largest half-precision number or integer.
            7 => sign | (0x3000_0000 + (word & 0x1FFF_FFFF)),
            // Near 1.
            _ => sign | (0x3C00_0000 + (word & 0x07FF_FFFF)),
        }
    }

    /// Generates FPSCR; in one case of two with the firmware's settings.
    pub(super) fn fpscr(&mut self) -> u32 {
        let word = self.word();
        let flags = word & 0xF000_009F;
        if self.once_in(2) {
            return flags;
        }
        flags | word & 0x07C0_0000
    }
}
