//! What integrators need of a number beyond [`Real`].

use super::super::real::{Micro, Real};

/// The integrators' unit of time, µs: 2^14, so that microseconds become a
/// fraction exactly in every arithmetic, and so that the time constants, A in
/// newtons per unit and force in newtons all stay within the 7 integer bits of
/// Q7.24.
pub const UNIT_US: f64 = 16_384.0;

/// All that is not a number, in one word: machines differ in its sign.
const NOT_A_NUMBER: u32 = 0x7FC0_0000;

/// A number that integrators compute with.
pub trait Arithmetic: Real {
    /// What tables of this arithmetic are made in.
    type Design: Arithmetic;
    /// Whether numbers of any size have a place.
    const FLOATING: bool = true;
    /// `us` microseconds, below 2^21, in units of [`UNIT_US`]; exact.
    fn from_micros(us: u32) -> Self;
    /// Whole part and the rest of self·2^`shift`. Numbers below zero and
    /// beyond 32 bits have no meaning here and give any index.
    fn split_scaled(self, shift: u32) -> (usize, Self);
    /// Its bits, folded to 32.
    fn fold_bits(self) -> u32;
    /// 2 to its power.
    fn exp2(self) -> Self {
        (self * Self::from_f64(core::f64::consts::LN_2)).exp()
    }
    /// Logarithm to base 2, for positive numbers.
    fn log2(self) -> Self {
        self.ln() * Self::from_f64(core::f64::consts::LOG2_E)
    }
}

impl Arithmetic for f64 {
    type Design = Self;
    fn from_micros(us: u32) -> Self {
        Self::from(us) * (1.0 / UNIT_US)
    }
    fn split_scaled(self, shift: u32) -> (usize, Self) {
        let scaled = self * Self::from(1u32 << (shift & 31));
        let whole = scaled as u32;
        (whole as usize, scaled - Self::from(whole))
    }
    fn fold_bits(self) -> u32 {
        if self.is_nan() {
            return NOT_A_NUMBER;
        }
        let bits = self.to_bits();
        (bits >> 32) as u32 ^ bits as u32
    }
}

impl Arithmetic for f32 {
    type Design = Self;
    fn from_micros(us: u32) -> Self {
        // Below 2^24: exact.
        us as Self * (1.0 / UNIT_US as Self)
    }
    fn split_scaled(self, shift: u32) -> (usize, Self) {
        let scaled = self * (1u32 << (shift & 31)) as Self;
        let whole = scaled as u32;
        (whole as usize, scaled - whole as Self)
    }
    fn fold_bits(self) -> u32 {
        if self.is_nan() {
            NOT_A_NUMBER
        } else {
            self.to_bits()
        }
    }
}

impl Arithmetic for Micro {
    type Design = f32;
    fn from_micros(us: u32) -> Self {
        Self(<f32 as Arithmetic>::from_micros(us))
    }
    fn split_scaled(self, shift: u32) -> (usize, Self) {
        let (whole, rest) = self.0.split_scaled(shift);
        (whole, Self(rest))
    }
    fn fold_bits(self) -> u32 {
        self.0.fold_bits()
    }
}
