//! Register bits that read inverted while the peripheral ignores them. Used for codes that the
//! manuals reserve or forbid, where the peripheral continues as if they were not set.

/// Register and its bits that read inverted; by default none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct IgnoredBits {
    register: u32,
    bits: u32,
}

impl IgnoredBits {
    /// Selects `bits` of the register at `register`, the address of a word.
    pub const fn new(register: u32, bits: u32) -> Self {
        Self { register, bits }
    }

    /// Returns the value that a read at `address` shows if the register holds `value`.
    #[inline]
    pub const fn apply_to_read(self, address: u32, value: u32) -> u32 {
        if self.bits == 0 || address & !3 != self.register {
            return value;
        }
        // A narrower access ignores the upper bits.
        value ^ self.bits >> (8 * (address & 3))
    }

    /// Notes a write at `address`: a write to the register ends the inversion.
    #[inline]
    pub const fn note_write(&mut self, address: u32) {
        if address & !3 == self.register {
            self.bits = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_shown_until_their_register_is_written() {
        let mut unheeded = IgnoredBits::new(0x4000_0020, 0x0000_0800);
        assert_eq!(unheeded.apply_to_read(0x4000_0020, 0x0F00), 0x0700);
        assert_eq!(unheeded.apply_to_read(0x4000_0021, 0x0F), 0x07);
        assert_eq!(unheeded.apply_to_read(0x4000_0024, 0x0F00), 0x0F00);
        unheeded.note_write(0x4000_0024);
        assert_eq!(unheeded.apply_to_read(0x4000_0020, 0), 0x0800);
        unheeded.note_write(0x4000_0020);
        assert_eq!(unheeded.apply_to_read(0x4000_0020, 0), 0);
    }
}
