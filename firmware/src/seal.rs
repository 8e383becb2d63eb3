//! Checksums stored beside the data that determines the outputs, so that a bit that flips is
//! detected before it has an effect.
//!
//! A checksum covers fields, as `Hash` lists them, not bytes, so padding does not count. It does
//! not protect against an adversary. A change of one field, in any number of bits, always changes
//! the checksum, because each step is one-to-one in the checksum and in the word; changes of two
//! fields may cancel.

use core::hash::{Hash, Hasher};

/// Number of windows between two checks by one owner of checksums.
const EVERY: u8 = 8;

/// Schedule of the checks of data, whether used or not: every eighth window the next of several
/// places is checked. Owners of checksums begin in different windows.
#[derive(Clone, Copy, Debug)]
pub struct CheckSchedule {
    /// Number of windows until the next check.
    wait: u8,
    place: u8,
    places: u8,
}

impl CheckSchedule {
    /// Creates the schedule of an owner that begins with window `first`, 0–7, and has `places`
    /// places.
    pub const fn new(first: u8, places: u8) -> Self {
        Self {
            wait: first,
            place: 0,
            places,
        }
    }

    /// Returns the place to check in this window, if a check is due.
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

/// Checksum over a value at the time of its last intended change.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Checksum(u32);

impl Checksum {
    /// Computes the checksum over the present `value`.
    #[inline]
    pub fn of(value: &impl Hash) -> Self {
        let mut sum = Sum(0x5EA1_ED00);
        value.hash(&mut sum);
        Self(sum.0)
    }

    /// Returns whether `value` is unchanged since this checksum was computed.
    #[inline]
    pub fn matches(self, value: &impl Hash) -> bool {
        self == Self::of(value)
    }
}

/// Performs one step of a checksum: adds `word` after all words before.
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
        self.add(value as u32); // and the other half
        self.add((value >> 32) as u32);
    }

    #[inline(always)]
    fn write_i32(&mut self, value: i32) {
        self.add(value.cast_unsigned());
    }

    // Discriminants and lengths are small, so their low word contains the whole value.
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
