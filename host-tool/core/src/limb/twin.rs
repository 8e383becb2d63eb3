//! The device's own geometry in other types of number: exact numbers to test it, and single
//! precision with exact functions to separate micromath's errors from rounding.

use core::ops::{Add, Div, Mul, Neg, Sub};
use firmware::limb::Number;

/// Number in double precision, with which the device's own geometry code can be tested.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
pub struct Exact(pub f64);

/// Number in single precision, like the device's, but with sine, cosine and root correct to the
/// last place. It shows which errors of the device come from its approximate functions.
#[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
pub struct Single(pub f32);

macro_rules! like_its_float {
    ($name:ident($float:ty): $($trait:ident::$method:ident),*) => {$(
        impl $trait for $name {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self($trait::$method(self.0, other.0))
            }
        }
    )*
        impl Neg for $name {
            type Output = Self;
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }
    };
}
like_its_float!(Exact(f64): Add::add, Sub::sub, Mul::mul, Div::div);
like_its_float!(Single(f32): Add::add, Sub::sub, Mul::mul, Div::div);

impl Number for Exact {
    const ZERO: Self = Self(0.0);
    const ONE: Self = Self(1.0);
    const RADIANS_PER_DEGREE: Self = Self(std::f64::consts::PI / 180.0);
    fn ratio(numerator: i32, denominator: i32) -> Self {
        Self(f64::from(numerator) / f64::from(denominator))
    }
    fn to_nearest(self) -> u32 {
        (self.0 + 0.5) as u32
    }
    fn sine_and_cosine(self) -> (Self, Self) {
        (Self(libm::sin(self.0)), Self(libm::cos(self.0)))
    }
    fn inverse_root(self) -> Self {
        match self.0 > 0.0 {
            true => Self(1.0 / self.0.sqrt()),
            false => Self::ZERO,
        }
    }
}

impl Number for Single {
    const ZERO: Self = Self(0.0);
    const ONE: Self = Self(1.0);
    const RADIANS_PER_DEGREE: Self = Self(std::f32::consts::PI / 180.0);
    fn ratio(numerator: i32, denominator: i32) -> Self {
        Self(numerator as f32 / denominator as f32)
    }
    fn to_nearest(self) -> u32 {
        (self.0 + 0.5) as u32
    }
    fn sine_and_cosine(self) -> (Self, Self) {
        (Self(libm::sinf(self.0)), Self(libm::cosf(self.0)))
    }
    fn inverse_root(self) -> Self {
        match self.0 > 0.0 {
            true => Self(1.0 / self.0.sqrt()),
            false => Self::ZERO,
        }
    }
}

/// Conversion of [`Exact`], [`Single`] or the device's `f32` to double precision, for comparison.
pub trait ToDouble {
    /// Returns the same number in double precision.
    fn to_double(self) -> f64;
}

impl ToDouble for Exact {
    fn to_double(self) -> f64 {
        self.0
    }
}

impl ToDouble for Single {
    fn to_double(self) -> f64 {
        self.0.into()
    }
}

impl ToDouble for f32 {
    fn to_double(self) -> f64 {
        self.into()
    }
}
