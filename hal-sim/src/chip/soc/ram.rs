//! Static RAM.

use crate::chip::cpu::Size;

/// A block of RAM. All zero at power-on: silicon's is random, so a program that
/// depends on it is not found out here.
#[derive(Clone, Debug)]
pub struct Ram {
    base: u32,
    /// All bytes, for loaders and debuggers.
    pub(crate) bytes: Vec<u8>,
}

impl Ram {
    /// `length` bytes from `base` on; both multiples of 4.
    pub fn new(base: u32, length: u32) -> Self {
        Self {
            base,
            bytes: vec![0; length as usize],
        }
    }

    /// Whether `address` lies in it.
    #[inline]
    pub fn contains(&self, address: u32) -> bool {
        (address.wrapping_sub(self.base) as usize) < self.bytes.len()
    }

    /// Reads `size` bytes, zero-extended; `None` outside.
    #[inline]
    pub fn read(&self, address: u32, size: Size) -> Option<u32> {
        let at = address.wrapping_sub(self.base) as usize;
        let bytes = self.bytes.get(at..)?;
        Some(match size {
            Size::Byte => u32::from(*bytes.first()?),
            Size::Half => u32::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            Size::Word => u32::from_le_bytes(*bytes.first_chunk()?),
        })
    }

    /// Writes the lower `size` bytes of `value`; `None` outside.
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

    /// `words` words from `address` on, 4 bytes each; `None` outside.
    pub fn words(&self, address: u32, words: usize) -> Option<&[[u8; 4]]> {
        let at = address.wrapping_sub(self.base) as usize;
        let bytes = self.bytes.get(at..)?.get(..4 * words)?;
        Some(bytes.as_chunks().0)
    }

    /// As [`Self::words`].
    pub fn words_mut(&mut self, address: u32, words: usize) -> Option<&mut [[u8; 4]]> {
        let at = address.wrapping_sub(self.base) as usize;
        let bytes = self.bytes.get_mut(at..)?.get_mut(..4 * words)?;
        Some(bytes.as_chunks_mut().0)
    }
}
