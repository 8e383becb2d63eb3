//! Bits that a register shows and its block does not heed: all that is known of a code
//! that the manuals reserve or forbid, where a block goes on as if it were not there.

/// Which bits of which register; by default none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(super) struct IgnoredBits {
    register: u32,
    bits: u32,
}

impl IgnoredBits {
    /// Of the register at `register`, a word's address.
    pub const fn new(register: u32, bits: u32) -> Self {
        Self { register, bits }
    }

    /// `value` as it is read at `address`.
    #[inline]
    pub const fn apply_to_read(self, address: u32, value: u32) -> u32 {
        if self.bits == 0 || address & !3 != self.register {
            return value;
        }
        // Of a narrower access the upper bits go by.
        value ^ self.bits >> (8 * (address & 3))
    }

    /// Its register is written: it shows that from then on.
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
