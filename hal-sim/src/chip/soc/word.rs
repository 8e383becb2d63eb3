//! Sub-word reads of 32-bit registers.

use crate::chip::cpu::Size;

/// The part of the register value `word` that a read of `size` at `offset`
/// gives, zero-extended (RM0090 section 2.1: APB and AHB slaves drive all
/// lanes).
#[inline]
pub const fn part(word: u32, offset: u32, size: Size) -> u32 {
    match size {
        Size::Word => word,
        Size::Half => word >> ((offset & 2) * 8) & 0xFFFF,
        Size::Byte => word >> ((offset & 3) * 8) & 0xFF,
    }
}
