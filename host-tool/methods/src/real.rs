//! The floating-point arithmetics: f64, f32 with the functions of libm, f32 with the approximations
//! of micromath.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A number type in which integrators and control laws can compute.
pub trait Real:
    Copy
    + Debug
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    const ZERO: Self;
    const ONE: Self;
    /// Converts a constant to the nearest number of this type.
    fn from_f64(x: f64) -> Self;
    /// Converts a result to `f64`, exactly or to the nearest number.
    fn to_f64(self) -> f64;
    /// Returns e to the power of this number.
    fn exp(self) -> Self;
    /// Returns the natural logarithm of this number, which must be positive.
    fn ln(self) -> Self;
    /// Returns the square root of this number, which must not be negative.
    fn sqrt(self) -> Self;
    fn abs(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }
}

/// Implements [`Real`] with the functions of libm, whose error is about one unit in the last place.
macro_rules! float {
    ($float:ident, $exp:ident, $ln:ident, $sqrt:ident) => {
        impl Real for $float {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            fn from_f64(x: f64) -> Self {
                x as Self
            }
            fn to_f64(self) -> f64 {
                self.into()
            }
            fn exp(self) -> Self {
                libm::$exp(self)
            }
            fn ln(self) -> Self {
                libm::$ln(self)
            }
            fn sqrt(self) -> Self {
                libm::$sqrt(self)
            }
        }
    };
}
float!(f64, exp, log, sqrt);
float!(f32, expf, logf, sqrtf);

/// 32-bit floating point with the approximations of the crate micromath. They are fast, but have
/// errors of up to 0.24 % (exp) or 6 % (square root).
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug)]
pub struct Micro(pub f32);

macro_rules! like_f32 {
    ($trait:ident, $name:ident) => {
        impl $trait for Micro {
            type Output = Self;
            fn $name(self, other: Self) -> Self {
                Self($trait::$name(self.0, other.0))
            }
        }
    };
}
like_f32!(Add, add);
like_f32!(Sub, sub);
like_f32!(Mul, mul);
like_f32!(Div, div);

impl Neg for Micro {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Real for Micro {
    const ZERO: Self = Self(0.0);
    const ONE: Self = Self(1.0);
    fn from_f64(x: f64) -> Self {
        Self(x as f32)
    }
    fn to_f64(self) -> f64 {
        self.0.into()
    }
    fn exp(self) -> Self {
        Self(micromath::F32(self.0).exp().0)
    }
    fn ln(self) -> Self {
        Self(micromath::F32(self.0).ln().0)
    }
    fn sqrt(self) -> Self {
        Self(micromath::F32(self.0).sqrt().0)
    }
}
