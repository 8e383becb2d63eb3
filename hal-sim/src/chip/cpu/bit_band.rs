//! Converts accesses to bit-band aliases: each word of an alias region stands for one bit of memory
//! (TRM 3.7).

use super::bus::{AccessError, Bus, Size};
use crate::chip::Cycle;

/// Alias regions, 32 MiB each, by the upper seven bits of an address: 0x2200_0000 of SRAM,
/// 0x4200_0000 of peripherals.
const ALIASES: [u32; 2] = [0x2200_0000 >> 25, 0x4200_0000 >> 25];

/// Bit of memory that an access to a bit-band alias reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bit {
    /// Address of the access to memory, aligned to its size.
    pub address: u32,
    /// Number of the bit within the accessed memory, 0 to 31.
    pub number: u32,
}

impl Bit {
    /// Returns the bit that an access of `size` to the alias at `address` reaches. Returns `None`
    /// outside the alias regions, and if the address is not that of a word: only word-aligned
    /// accesses are converted (Arm's knowledge base, article 103489860). Memory is accessed with
    /// the width of the access to the alias (Cortex-M4 Devices Generic User Guide, 2.2.5).
    #[inline]
    pub const fn from_alias(address: u32, size: Size) -> Option<Self> {
        let region = address >> 25;
        if region != ALIASES[0] && region != ALIASES[1] || address & 3 != 0 {
            return None;
        }
        let offset = address & 0x01FF_FFFF;
        let byte = address & 0xF000_0000 | offset >> 5;
        Some(Self {
            address: byte & !(size.bytes() - 1),
            number: offset >> 2 & (8 * size.bytes() - 1),
        })
    }

    /// Extracts the bit from `memory`, the contents of `address`: 0 or 1.
    pub const fn read_from(self, memory: u32) -> u32 {
        memory >> self.number & 1
    }

    /// Returns `memory` with the bit replaced by bit 0 of `value`.
    pub const fn written_to(self, memory: u32, value: u32) -> u32 {
        memory & !(1 << self.number) | (value & 1) << self.number
    }

    /// Reads memory, then writes it with the bit replaced by bit 0 of `value`, from `at` on.
    /// Returns the wait states of both accesses.
    ///
    /// # Errors
    /// Fails if the read or the write fails.
    #[inline(never)]
    pub fn write(
        self,
        bus: &mut impl Bus,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, AccessError> {
        let read = bus.read(self.address, size, at)?;
        let wait = read.wait + 1;
        let memory = self.written_to(read.value, value);
        Ok(wait + bus.write(self.address, size, memory, at + Cycle::from(wait))?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks the examples of TRM figure 3-2, and the peripheral bit through which ST's HAL
    /// switches the PLL on.
    #[test]
    fn a_word_of_an_alias_is_a_bit_in_the_width_of_its_access() {
        for (alias, size, address, number) in [
            (0x2200_0000, Size::Byte, 0x2000_0000, 0),
            (0x2200_001C, Size::Byte, 0x2000_0000, 7),
            (0x23FF_FFE0, Size::Byte, 0x200F_FFFF, 0),
            (0x23FF_FFFC, Size::Byte, 0x200F_FFFF, 7),
            (0x23FF_FFFC, Size::Half, 0x200F_FFFE, 15),
            (0x23FF_FFFC, Size::Word, 0x200F_FFFC, 31),
            (0x4247_0060, Size::Word, 0x4002_3800, 24),
            (0x4247_0060, Size::Half, 0x4002_3802, 8),
            (0x43FF_FFFC, Size::Word, 0x400F_FFFC, 31),
        ] {
            assert_eq!(Bit::from_alias(alias, size), Some(Bit { address, number }));
        }
        for none in [0x21FF_FFFC, 0x2400_0000, 0x41FF_FFFC, 0x4400_0000] {
            assert_eq!(Bit::from_alias(none, Size::Word), None);
        }
        assert_eq!(
            Bit::from_alias(0x1200_0000, Size::Word),
            None,
            "CCM has none"
        );
        assert_eq!(
            Bit::from_alias(0x2200_0001, Size::Byte),
            None,
            "beside a word"
        );
    }
}
