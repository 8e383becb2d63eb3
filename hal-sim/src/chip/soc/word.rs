//! Accesses to a part of a 32-bit register.

use crate::chip::cpu::Size;

/// Returns the part of the register value `word` that a read of `size` at `offset` gives,
/// zero-extended (RM0090 section 2.1: APB and AHB slaves drive all lanes).
#[inline]
pub const fn read_part(word: u32, offset: u32, size: Size) -> u32 {
    match size {
        Size::Word => word,
        Size::Half => word >> ((offset & 2) * 8) & 0xFFFF,
        Size::Byte => word >> ((offset & 3) * 8) & 0xFF,
    }
}

/// Data of a write to a word or part of it, with a mask of the bytes that are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lanes {
    /// Value on all lanes; invalid lanes are 0.
    pub value: u32,
    mask: u32,
}

impl Lanes {
    /// Creates a write of all four bytes.
    pub const fn whole(value: u32) -> Self {
        let mask = u32::MAX;
        Self { value, mask }
    }

    /// Creates a write of `size` at `offset`, in bytes, with the lowest bits of `value`.
    pub const fn from_access(offset: u32, size: Size, value: u32) -> Self {
        let (shift, mask) = match size {
            Size::Word => (0, u32::MAX),
            Size::Half => ((offset & 2) * 8, 0xFFFF),
            Size::Byte => ((offset & 3) * 8, 0xFF),
        };
        Self {
            value: (value & mask) << shift,
            mask: mask << shift,
        }
    }

    /// Returns whether all bytes are written.
    pub const fn is_whole(self) -> bool {
        self.mask == u32::MAX
    }

    /// Returns the new value of a register: the bytes written, and the others from its present
    /// value `old`.
    pub const fn merge_into(self, old: u32) -> u32 {
        old & !self.mask | self.value
    }
}
