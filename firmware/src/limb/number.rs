//! Number type of the geometry: f32 on the device, other types on hosts.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};
use micromath::F32;

/// A number with the few functions that the geometry needs.
pub trait Number:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Additive identity, 0.
    const ZERO: Self;
    /// Multiplicative identity, 1.
    const ONE: Self;
    /// Factor π/180.
    const RADIANS_PER_DEGREE: Self;
    /// Returns the number nearest to `numerator / denominator`, which must not be 0.
    fn ratio(numerator: i32, denominator: i32) -> Self;
    /// Returns the nearest integer, saturating; 0 for NaN.
    fn to_nearest(self) -> u32;
    /// Returns sine and cosine of an angle in radians, on the unit circle.
    fn sine_and_cosine(self) -> (Self, Self);
    /// Returns the inverse square root of a positive number; any finite value for zero.
    fn inverse_root(self) -> Self;
}

/// Largest error of an angle by which the device rotates, rad: the error of micromath's sine and
/// cosine (`firmware/tests/limb_numbers.rs`).
pub const TURN_ERROR: f32 = 1.1e-3;

/// Sine and cosine are micromath's, normalised to the unit circle. Rotations therefore preserve
/// lengths and right angles, and only the angle has an error, of at most [`TURN_ERROR`].
impl Number for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const RADIANS_PER_DEGREE: Self = core::f32::consts::PI / 180.0;

    #[inline]
    fn ratio(numerator: i32, denominator: i32) -> Self {
        numerator as Self / denominator as Self
    }

    #[inline]
    fn to_nearest(self) -> u32 {
        // `as` saturates, and converts NaN to 0.
        (self + 0.5) as u32
    }

    #[inline]
    fn sine_and_cosine(self) -> (Self, Self) {
        let (sine, cosine) = (F32(self).sin().0, F32(self).cos().0);
        let inverse = (sine * sine + cosine * cosine).inverse_root();
        (sine * inverse, cosine * inverse)
    }

    /// Refines micromath's result, whose error is up to 3.5 %, with three Newton steps to an error
    /// of 3e-7.
    #[inline]
    fn inverse_root(self) -> Self {
        let half = 0.5 * self;
        let mut y = F32(self).invsqrt().0;
        for _ in 0..3 {
            y = y * (1.5 - half * y * y);
        }
        y
    }
}
