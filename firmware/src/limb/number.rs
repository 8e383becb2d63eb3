//! What the geometry computes with: f32 on the device, others on hosts.

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
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// π/180.
    const RADIANS_PER_DEGREE: Self;
    /// The nearest to `numerator / denominator`, which must not be 0.
    fn ratio(numerator: i32, denominator: i32) -> Self;
    /// The nearest integer, saturating; of what is no number, 0.
    fn to_nearest(self) -> u32;
    /// Sine and cosine of an angle in radians, on the unit circle.
    fn sine_and_cosine(self) -> (Self, Self);
    /// One over the square root of a positive number; of zero anything finite.
    fn inverse_root(self) -> Self;
}

/// The most by which an angle is wrong that the device turns by, rad: what micromath's
/// sine and cosine leave (`firmware/tests/limb_numbers.rs`).
pub const TURN_ERROR: f32 = 1.1e-3;

/// Sine and cosine are micromath's, drawn onto the unit circle: turns keep lengths
/// and right angles, and only the angle is wrong, by at most [`TURN_ERROR`].
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
        // `as` saturates, and takes 0 for what is no number.
        (self + 0.5) as u32
    }

    #[inline]
    fn sine_and_cosine(self) -> (Self, Self) {
        let (sine, cosine) = (F32(self).sin().0, F32(self).cos().0);
        let inverse = (sine * sine + cosine * cosine).inverse_root();
        (sine * inverse, cosine * inverse)
    }

    /// micromath's is wrong by up to 3.5 %; three of Newton's steps leave 3e-7.
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
