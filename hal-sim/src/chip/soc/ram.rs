//! Models static RAM.

use crate::chip::cpu::Size;

/// A block of RAM. It is all zero at power-on, unlike real RAM, which is random: a program that
/// depends on its contents is not detected here.
#[derive(Clone, PartialEq, Debug)]
pub struct Ram {
    base: u32,
    /// All bytes, for loaders and debuggers.
    pub(crate) bytes: Vec<u8>,
    stuck: Option<StuckCell>,
}

/// A cell that reads the same value whatever was written.
#[derive(Clone, Copy, PartialEq, Debug)]
struct StuckCell {
    /// Index of the byte in the block that contains the cell.
    at: usize,
    mask: u8,
    is_high: bool,
}

impl StuckCell {
    /// Returns `value`, read with `size` from index `at` of the block on, with the stuck bit in
    /// place if it is among those bits.
    fn force(self, value: u32, at: usize, size: Size) -> u32 {
        let Some(byte) = self
            .at
            .checked_sub(at)
            .filter(|n| *n < size.bytes() as usize)
        else {
            return value;
        };
        let mask = u32::from(self.mask) << (8 * byte);
        if self.is_high {
            value | mask
        } else {
            value & !mask
        }
    }
}

impl Ram {
    /// Creates `length` bytes from `base` on; both must be multiples of 4.
    pub fn new(base: u32, length: u32) -> Self {
        Self {
            base,
            bytes: vec![0; length as usize],
            stuck: None,
        }
    }

    /// Makes `bit` (0–7) of the byte at `address` read as 1 or 0 permanently. Only one cell can be
    /// stuck at a time.
    pub fn stick(&mut self, address: u32, bit: u8, is_high: bool) {
        self.stuck = Some(StuckCell {
            at: address.wrapping_sub(self.base) as usize,
            mask: 1 << bit,
            is_high,
        });
    }

    /// Removes the stuck cell.
    pub const fn heal(&mut self) {
        self.stuck = None;
    }

    /// Returns whether `address` lies in the block.
    #[inline]
    pub fn contains(&self, address: u32) -> bool {
        (address.wrapping_sub(self.base) as usize) < self.bytes.len()
    }

    /// Reads `size` bytes, zero-extended; `None` outside the block.
    #[inline]
    pub fn read(&self, address: u32, size: Size) -> Option<u32> {
        let at = address.wrapping_sub(self.base) as usize;
        let bytes = self.bytes.get(at..)?;
        let value = match size {
            Size::Byte => u32::from(*bytes.first()?),
            Size::Half => u32::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            Size::Word => u32::from_le_bytes(*bytes.first_chunk()?),
        };
        Some(match self.stuck {
            None => value,
            Some(stuck) => stuck.force(value, at, size),
        })
    }

    /// Writes the lower `size` bytes of `value`; `None` outside the block.
    #[inline]
    pub fn write(&mut self, address: u32, size: Size, value: u32) -> Option<()> {
        let at = address.wrapping_sub(self.base) as usize;
        let bytes = self.bytes.get_mut(at..)?;
        let value = value.to_le_bytes();
        match size {
            Size::Byte => *bytes.first_mut()? = value[0],
            Size::Half => *bytes.first_chunk_mut()? = [value[0], value[1]],
            Size::Word => *bytes.first_chunk_mut()? = value,
        }
        Some(())
    }

    /// Returns `words` words from `address` on, 4 bytes each; `None` outside the block, or if one
    /// of them has a stuck cell and they must be read individually.
    pub fn words(&self, address: u32, words: usize) -> Option<&[[u8; 4]]> {
        let at = address.wrapping_sub(self.base) as usize;
        let bytes = self.bytes.get(at..)?.get(..4 * words)?;
        let is_stuck = |stuck: StuckCell| (at..at + 4 * words).contains(&stuck.at);
        if self.stuck.is_some_and(is_stuck) {
            return None;
        }
        Some(bytes.as_chunks().0)
    }

    /// Returns `words` words from `address` on, 4 bytes each, for writing; `None` outside the
    /// block.
    pub fn words_mut(&mut self, address: u32, words: usize) -> Option<&mut [[u8; 4]]> {
        let at = address.wrapping_sub(self.base) as usize;
        let bytes = self.bytes.get_mut(at..)?.get_mut(..4 * words)?;
        Some(bytes.as_chunks_mut().0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stuck_cell_reads_the_same_whatever_is_written() {
        let mut ram = Ram::new(0x2000_0000, 64);
        ram.stick(0x2000_0012, 3, true);
        for (address, size, written, read) in [
            (0x2000_0010, Size::Word, 0, 0x0008_0000),
            (0x2000_0012, Size::Half, 0xFFF7, 0xFFFF),
            (0x2000_0012, Size::Byte, 0, 8),
            (0x2000_0011, Size::Byte, 0, 0),
            (0x2000_0013, Size::Byte, 0, 0),
            (0x2000_0014, Size::Word, 0, 0),
        ] {
            ram.write(address, size, written).unwrap();
            assert_eq!(ram.read(address, size), Some(read), "{address:#x}");
        }
        assert!(ram.words(0x2000_0014, 4).is_some());
        assert!(ram.words(0x2000_000C, 2).is_none());
        ram.stick(0x2000_0012, 3, false);
        ram.write(0x2000_0010, Size::Word, u32::MAX).unwrap();
        assert_eq!(ram.read(0x2000_0010, Size::Word), Some(0xFFF7_FFFF));
    }
}
