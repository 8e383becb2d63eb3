//! Sums over what decides the outputs, kept beside it: a bit that changes by itself
//! is found before anything comes of it.
//!
//! A sum is of fields, as `Hash` names them, not of bytes: padding does not count. It
//! is no secret and no code against an adversary: one field that changes, in however
//! many bits, always changes it, for each step is one to one in the sum and in the
//! word; two that change may cancel.

use core::hash::{Hash, Hasher};

/// Windows from one turn of an owner to its next.
const EVERY: u8 = 8;

/// Whose turn it is to be looked at, used or not: one of a number of places every
/// eighth window; owners begin in different ones.
#[derive(Clone, Copy, Debug)]
pub struct CheckSchedule {
    /// Windows to wait.
    wait: u8,
    place: u8,
    places: u8,
}

impl CheckSchedule {
    /// Of the owner that begins with window `first`, 0–7, and has so many places.
    pub const fn new(first: u8, places: u8) -> Self {
        Self {
            wait: first,
            place: 0,
            places,
        }
    }

    /// The place to look at in this window, if it is this owner's.
    #[inline(always)]
    pub fn next(&mut self) -> Option<usize> {
        if let Some(wait) = self.wait.checked_sub(1) {
            self.wait = wait;
            return None;
        }
        self.wait = EVERY - 1;
        let place = self.place;
        let next = place.wrapping_add(1);
        self.place = if next < self.places { next } else { 0 };
        Some(place.into())
    }
}

/// The sum over a value when it was last changed on purpose.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Checksum(u32);

impl Checksum {
    /// Over `value` as it is.
    #[inline]
    pub fn of(value: &impl Hash) -> Self {
        let mut sum = Sum(0x5EA1_ED00);
        value.hash(&mut sum);
        Self(sum.0)
    }

    /// Whether `value` is as it was.
    #[inline]
    pub fn matches(self, value: &impl Hash) -> bool {
        self == Self::of(value)
    }
}

/// One step of a sum: `word` after all before it.
#[inline(always)]
#[must_use]
pub const fn fold(sum: u32, word: u32) -> u32 {
    sum.rotate_left(5) ^ word // one instruction of the core
}

struct Sum(u32);

impl Sum {
    #[inline(always)]
    const fn add(&mut self, word: u32) {
        self.0 = fold(self.0, word);
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
    fn write_u64(&mut self, value: u64) {
        self.add(value as u32); // and its other half
        self.add((value >> 32) as u32);
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
        let seal = Checksum::of(&value);
        assert!(seal.matches(&value));
        for bit in 0..128 {
            let mut flipped = value;
            flipped[bit / 32] ^= 1 << (bit % 32);
            assert!(!seal.matches(&flipped), "bit {bit}");
        }
    }
}
