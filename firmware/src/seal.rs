//! Sums over what decides the outputs, kept beside it: a bit that changes by itself
//! is found before anything comes of it.
//!
//! A sum is of fields, as `Hash` names them, not of bytes: padding does not count. It
//! is no secret and no code against an adversary; one changed field always changes
//! it, for each step is one to one in the sum and in the word.

use core::hash::{Hash, Hasher};

/// The sum over a value when it was last changed on purpose.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Seal(u32);

impl Seal {
    /// Over `value` as it is.
    #[inline]
    pub fn of(value: &impl Hash) -> Self {
        let mut sum = Sum(0x5EA1_ED00);
        value.hash(&mut sum);
        Self(sum.0)
    }

    /// Whether `value` is as it was.
    #[inline]
    pub fn holds(self, value: &impl Hash) -> bool {
        self == Self::of(value)
    }
}

struct Sum(u32);

impl Sum {
    #[inline(always)]
    const fn add(&mut self, word: u32) {
        // An odd factor and a rotation: one to one.
        self.0 = (self.0 ^ word).wrapping_mul(0x9E37_79B1).rotate_left(15);
    }
}

impl Hasher for Sum {
    fn finish(&self) -> u64 {
        self.0.into()
    }

    #[inline]
    fn write(&mut self, bytes: &[u8]) {
        let (words, rest) = bytes.as_chunks::<4>();
        for word in words {
            self.add(u32::from_le_bytes(*word));
        }
        for &byte in rest {
            self.add(byte.into());
        }
    }

    #[inline(always)]
    fn write_u8(&mut self, value: u8) {
        self.add(value.into());
    }

    #[inline(always)]
    fn write_u16(&mut self, value: u16) {
        self.add(value.into());
    }

    #[inline(always)]
    fn write_u32(&mut self, value: u32) {
        self.add(value);
    }

    #[inline(always)]
    fn write_i32(&mut self, value: i32) {
        self.add(value.cast_unsigned());
    }

    // Discriminants and lengths: few, so their low word says all.
    #[inline(always)]
    fn write_usize(&mut self, value: usize) {
        self.add(value as u32);
    }

    #[inline(always)]
    fn write_isize(&mut self, value: isize) {
        self.add(value as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_breaks_the_seal() {
        let value = [0xDEAD_BEEF_u32, 0, u32::MAX, 7];
        let seal = Seal::of(&value);
        assert!(seal.holds(&value));
        for bit in 0..128 {
            let mut flipped = value;
            flipped[bit / 32] ^= 1 << (bit % 32);
            assert!(!seal.holds(&flipped), "bit {bit}");
        }
    }
}
