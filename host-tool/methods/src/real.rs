//! The floating-point arithmetics: f64, f32 with libm's functions, f32 with
//! micromath's approximations.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

/// A number that integrators and laws compute with.
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
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// The nearest number; for constants.
    fn from_f64(x: f64) -> Self;
    /// Exactly or to the nearest, for results.
    fn to_f64(self) -> f64;
    /// e to its power.
    fn exp(self) -> Self;
    /// Natural logarithm, for positive numbers.
    fn ln(self) -> Self;
    /// Square root, for numbers not below zero.
    fn sqrt(self) -> Self;
    /// Distance from zero.
    fn abs(self) -> Self {
        if self < Self::ZERO { -self } else { self }
    }
}

/// With libm's functions: exact to about one unit in the last place.
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

/// f32 with micromath's functions: cheap, and wrong by up to 0.24 % (exp) or
/// 6 % (square root).
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
