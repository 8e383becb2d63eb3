//! Models the signature programmed into each chip at the factory: unique number, flash size (RM0090
//! chapter 39).

use super::word::read_part;
use crate::chip::cpu::Size;

/// Address of the 96-bit unique number.
pub const UID: u32 = 0x1FFF_7A10;
/// Address of the half-word with the flash size in KiB.
pub const FLASH_SIZE: u32 = 0x1FFF_7A22;

/// Signature that is programmed into one chip at the factory. All chips have 1024 KiB of flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    /// Unique 96-bit number, as three words in address order.
    pub uid: [u32; 3],
}

impl Default for Signature {
    /// Returns the number "FLEXOR SIM 1" in ASCII.
    fn default() -> Self {
        Self {
            uid: [*b"FLEX", *b"OR S", *b"IM 1"].map(u32::from_le_bytes),
        }
    }
}

impl Signature {
    /// Reads `size` at `address`; `None` outside the unique number and the flash size.
    pub fn read(&self, address: u32, size: Size) -> Option<u32> {
        let word = match address & !3 {
            word @ UID..=0x1FFF_7A18 => self.uid[((word - UID) / 4) as usize], // at most 2
            0x1FFF_7A20 if address >= FLASH_SIZE => 1024 << 16,
            _ => return None,
        };
        Some(read_part(word, address, size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn number_and_size_are_where_the_manual_says() {
        let chip = Signature { uid: [1, 2, 3] };
        assert_eq!(chip.read(0x1FFF_7A10, Size::Word), Some(1));
        assert_eq!(chip.read(0x1FFF_7A18, Size::Word), Some(3));
        assert_eq!(chip.read(0x1FFF_7A22, Size::Half), Some(1024));
        assert_eq!(chip.read(0x1FFF_7A1C, Size::Word), None);
        assert_eq!(chip.read(0x1FFF_7A20, Size::Half), None);
    }
}
