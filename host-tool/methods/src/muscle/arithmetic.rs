//! Operations that integrators need of a number beyond [`Real`].

use super::super::real::{Micro, Real};

/// Unit of time of the integrators, µs: 2^14. In this unit, a time in µs is an exact binary
/// fraction in every arithmetic. Time constants, the parameter A in newtons per unit, and forces in
/// newtons all fit in the 7 integer bits of Q7.24.
pub const UNIT_US: f64 = 16_384.0;

/// Bits that stand for every NaN in a checksum, because machines differ in the sign of a NaN.
const NOT_A_NUMBER: u32 = 0x7FC0_0000;

/// A number type in which muscle integrators can compute.
pub trait Arithmetic: Real {
    /// Number type in which the tables of this arithmetic are computed before they are rounded to
    /// it.
    type Design: Arithmetic;
    /// Whether the type is floating point, so that intermediate results of any magnitude fit.
    const FLOATING: bool = true;
    /// Converts `us` microseconds, below 2^21, to the unit of time [`UNIT_US`]; the result is
    /// exact.
    fn from_micros(us: u32) -> Self;
    /// Multiplies this number by 2^`shift`, and returns the integer part, as an index, and the
    /// remainder. For a negative product, or one beyond 32 bits, the index is arbitrary.
    fn split_scaled(self, shift: u32) -> (usize, Self);
    /// Returns the bits of the number for a checksum, with 64 bits folded to 32 by exclusive or.
    fn fold_bits(self) -> u32;
    /// Returns 2 to the power of this number.
    fn exp2(self) -> Self {
        (self * Self::from_f64(core::f64::consts::LN_2)).exp()
    }
    /// Returns the logarithm to base 2 of this number, which must be positive.
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
        // Below 2^24, so the conversion is exact.
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
