//! Sub-word accesses of 32-bit registers.

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

/// The register value `word` after a write of `size` at `offset` into it, where the register
/// keeps what is not written.
pub const fn merged(word: u32, offset: u32, size: Size, value: u32) -> u32 {
    let (shift, mask) = match size {
        Size::Word => return value,
        Size::Half => ((offset & 2) * 8, 0xFFFF),
        Size::Byte => ((offset & 3) * 8, 0xFF),
    };
    word & !(mask << shift) | (value & mask) << shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrow_write_leaves_the_rest() {
        for (offset, size, after) in [
            (0, Size::Word, 0xAABB_CCDD),
            (0, Size::Half, 0x1122_CCDD),
            (2, Size::Half, 0xCCDD_3344),
            (0, Size::Byte, 0x1122_33DD),
            (3, Size::Byte, 0xDD22_3344),
        ] {
            let merged = merged(0x1122_3344, offset, size, 0xAABB_CCDD);
            assert_eq!(merged, after);
            let read = part(merged, offset, size);
            assert_eq!(read, part(0xAABB_CCDD, 0, size));
        }
    }
}
