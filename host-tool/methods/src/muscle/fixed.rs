//! Fixed point with a selectable number of fraction bits in a 32-bit word.

use super::super::real::Real;
use super::arithmetic::{Arithmetic, UNIT_US};
use core::ops::{Add, Div, Mul, Neg, Sub};
use firmware::arithmetic::division::quotient;
use firmware::arithmetic::exponential::{exp2_neg, log2_neg};

/// Constant log2 e with 31 fraction bits.
const LOG2_E: u64 = 3_098_164_009;
/// Constant ln 2 with 32 fraction bits.
const LN_2: i64 = 2_977_044_472;

/// A fixed-point number in a 32-bit word with `FRACTION` fraction bits, 31 − `FRACTION` integer
/// bits and a sign. Q15.16 is `Fixed<16>` and Q7.24 is `Fixed<24>`; `FRACTION` may be 14 to 30.
///
/// Products are rounded down, or to the nearest number if `NEAREST` is true. Overflow wraps, as it
/// occurs when an explicit method diverges. Quotients and exponentials are computed by the
/// functions of the device (the quotients are exact, the exponentials have an error of 3e-9). The
/// type serves to translate a floating-point program line by line, as a first version of firmware
/// would.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Fixed<const FRACTION: u32, const NEAREST: bool = false>(pub i32);

impl<const F: u32, const NEAREST: bool> Fixed<F, NEAREST> {
    /// Rounds a number with `from` fraction bits, at least F, to F fraction bits: down, or to the
    /// nearest number if `NEAREST` is true.
    fn round(bits: i64, from: u32) -> Self {
        let dropped = from.saturating_sub(F);
        let half = if NEAREST && dropped > 0 {
            1i64 << (dropped - 1)
        } else {
            0
        };
        Self((bits.wrapping_add(half) >> dropped) as i32)
    }

    /// Returns 2 to the power of `octaves`, Q32, if this number is positive, otherwise 2 to the
    /// power of −`octaves`.
    fn power(self, octaves: u64) -> Self {
        let power = Self::round(i64::from(exp2_neg(octaves)), 31);
        if self.0 <= 0 {
            power
        } else {
            Self::ONE / power
        }
    }

    /// Returns the logarithm to base 2, Q32. Zero and negative numbers are treated as the smallest
    /// positive number.
    fn octaves(self) -> i64 {
        let bits = self.0.max(1).cast_unsigned();
        let shift = bits.leading_zeros();
        // bits = m·2^(32 − shift), 1/2 ≤ m < 1; shift is 1…31, F below 32.
        let whole = i64::from(32 - shift) - i64::from(F);
        (whole << 32) - log2_neg((bits << shift) >> 1) as i64
    }
}

impl<const F: u32, const NEAREST: bool> Add for Fixed<F, NEAREST> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0.wrapping_add(other.0))
    }
}

impl<const F: u32, const NEAREST: bool> Sub for Fixed<F, NEAREST> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0.wrapping_sub(other.0))
    }
}

impl<const F: u32, const NEAREST: bool> Neg for Fixed<F, NEAREST> {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.wrapping_neg())
    }
}

impl<const F: u32, const NEAREST: bool> Mul for Fixed<F, NEAREST> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        // The product is below 2^62.
        Self::round(i64::from(self.0) * i64::from(other.0), 2 * F)
    }
}

impl<const F: u32, const NEAREST: bool> Div for Fixed<F, NEAREST> {
    type Output = Self;
    /// Divides, and rounds towards zero, or to the nearest number if `NEAREST` is true. On overflow
    /// or division by zero, the result is the largest number with the sign of the quotient.
    fn div(self, other: Self) -> Self {
        let divisor = other.0.unsigned_abs();
        let half = if NEAREST { divisor / 2 } else { 0 };
        // The dividend is below 2^62 + 2^30.
        let dividend = (u64::from(self.0.unsigned_abs()) << F) + u64::from(half);
        let size = quotient(dividend, divisor).map(i32::try_from);
        let size = size.and_then(Result::ok).unwrap_or(i32::MAX);
        Self(if (self.0 ^ other.0) < 0 { -size } else { size })
    }
}

impl<const F: u32, const NEAREST: bool> Real for Fixed<F, NEAREST> {
    const ZERO: Self = Self(0);
    const ONE: Self = Self(1 << F);
    fn from_f64(x: f64) -> Self {
        // A compiler can evaluate this for a constant; `as` saturates.
        let half = if x < 0.0 { -0.5 } else { 0.5 };
        Self((x * f64::from(1u32 << F) + half) as i32)
    }
    fn to_f64(self) -> f64 {
        f64::from(self.0) / f64::from(1u32 << F)
    }
    fn exp(self) -> Self {
        // 2^31 · 2^32; F ≥ 1 leaves Q32.
        let octaves = (u64::from(self.0.unsigned_abs()) * LOG2_E) >> (F - 1);
        self.power(octaves)
    }
    fn ln(self) -> Self {
        // |octaves| < 2^38, of which the upper 31 bits suffice; Q25 · Q32.
        Self::round(((self.octaves() >> 7) * LN_2) >> 25, 32)
    }
    fn sqrt(self) -> Self {
        let wide = u64::from(self.0.max(0).cast_unsigned()) << F;
        Self(wide.isqrt() as i32)
    }
}

impl<const F: u32, const NEAREST: bool> Arithmetic for Fixed<F, NEAREST> {
    type Design = f32;
    const FLOATING: bool = false;
    fn from_micros(us: u32) -> Self {
        // F ≥ 14 by the documentation of the type: an exact shift.
        Self((us << F.saturating_sub(14)).cast_signed() >> 14u32.saturating_sub(F))
    }
    fn split_scaled(self, shift: u32) -> (usize, Self) {
        let scaled = i64::from(self.0) << (shift & 31);
        let rest = scaled as i32 & ((1 << F) - 1);
        ((scaled >> F) as usize, Self(rest))
    }
    fn fold_bits(self) -> u32 {
        self.0.cast_unsigned()
    }
    fn exp2(self) -> Self {
        self.power(u64::from(self.0.unsigned_abs()) << (32 - F))
    }
    fn log2(self) -> Self {
        Self::round(self.octaves(), 32)
    }
}

const _: () = assert!(UNIT_US == (1u32 << 14) as f64);

#[cfg(test)]
mod tests {
    use super::*;

    fn off<const F: u32>(is: Fixed<F>, truth: f64) -> f64 {
        (is.to_f64() - truth).abs() * f64::from(1u32 << F)
    }

    #[test]
    fn functions_are_exact_to_a_few_last_places() {
        let mut worst = [0f64; 4];
        // The inverse of less than 1/128 overflows.
        for i in 10..20_000u32 {
            let x = f64::from(i) * 1e-3;
            let y = Fixed::<24>::from_f64(x);
            let is = [
                off((-y).exp(), (-y.to_f64()).exp()),
                off(y.ln(), y.to_f64().ln()),
                off(Fixed::ONE / y, 1.0 / y.to_f64()),
                off(y.sqrt(), y.to_f64().sqrt()),
            ];
            for (w, o) in worst.iter_mut().zip(is) {
                *w = w.max(o);
            }
        }
        std::println!("exp, ln, 1/x, sqrt: {worst:?} last places");
        assert!(worst.iter().all(|w| (0.9..=1.6).contains(w)), "{worst:?}");
    }

    #[test]
    fn rounding_is_what_the_type_says() {
        let (down, near) = (Fixed::<16>(3), Fixed::<16, true>(3));
        let half = 1 << 15;
        assert_eq!((down * Fixed(half)).0, 1);
        assert_eq!((near * Fixed(half)).0, 2);
        assert_eq!((-down * Fixed(half)).0, -2);
        assert_eq!((Fixed::<16>::ONE / Fixed(0)).0, i32::MAX);
        assert_eq!(Fixed::<24>::from_micros(1000).to_f64(), 1000.0 / UNIT_US);
        assert_eq!(Fixed::<16>::from_f64(2.75).split_scaled(4), (44, Fixed(0)));
        assert_eq!(Fixed::<16>::from_f64(2.3).split_scaled(0).0, 2);
    }
}
