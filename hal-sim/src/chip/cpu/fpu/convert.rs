//! Converts integers, fixed point and half precision (Arm ARM A2.5, FPToFixed, FixedToFP,
//! FPHalfToSingle, FPSingleToHalf).

use super::fpscr::{AHP, DN, IOC, IXC};
use super::number::{
    DEFAULT_NAN, Finite, HALF, Number, Rounding, SINGLE, drop_bits, round, unpack,
};

/// A fixed-point format of the VCVT instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fixed {
    /// Whether numbers are signed (two's complement).
    pub signed: bool,
    /// Whether numbers have 16 bits, in the lower half-word of the register, instead of 32.
    pub half_word: bool,
    /// Number of bits after the binary point, at most the width of the number.
    pub fraction: u8,
}

/// Converts a 32-bit integer to single precision, rounded in the mode of FPSCR.
pub(super) fn from_integer(x: u32, signed: bool, fpscr: &mut u32) -> u32 {
    let rounding = Rounding::from_fpscr(*fpscr);
    from(wide(x, signed), 0, rounding, fpscr)
}

/// Converts fixed point to single precision, rounded to nearest.
pub(super) fn from_fixed(x: u32, fixed: Fixed, fpscr: &mut u32) -> u32 {
    let value = match (fixed.half_word, fixed.signed) {
        (true, true) => i64::from(x as u16 as i16),
        (true, false) => i64::from(x as u16),
        (false, signed) => wide(x, signed),
    };
    from(value, fixed.fraction, Rounding::Nearest, fpscr)
}

const fn wide(x: u32, signed: bool) -> i64 {
    if signed { x as i32 as i64 } else { x as i64 }
}

fn from(value: i64, fraction: u8, rounding: Rounding, fpscr: &mut u32) -> u32 {
    let exponent = 62 - i32::from(fraction);
    let exact = Finite::new(value < 0, exponent, value.unsigned_abs());
    round(exact, SINGLE, rounding, fpscr)
}

/// Converts single precision to a 32-bit integer. A value outside the range of the integer
/// saturates.
pub(super) fn to_integer(x: u32, signed: bool, truncate: bool, fpscr: &mut u32) -> u32 {
    let rounding = if truncate {
        Rounding::Zero
    } else {
        Rounding::from_fpscr(*fpscr)
    };
    to(x, 32, signed, 0, rounding, fpscr)
}

/// Converts single precision to fixed point, rounded towards zero. A value outside the range
/// saturates. A 16-bit result is extended to 32 bits.
pub(super) fn to_fixed(x: u32, fixed: Fixed, fpscr: &mut u32) -> u32 {
    let width = if fixed.half_word { 16 } else { 32 };
    to(
        x,
        width,
        fixed.signed,
        fixed.fraction,
        Rounding::Zero,
        fpscr,
    )
}

fn to(x: u32, width: u32, signed: bool, fraction: u8, rounding: Rounding, fpscr: &mut u32) -> u32 {
    let (least, greatest) = if signed {
        (-1_i64 << (width - 1), (1_i64 << (width - 1)) - 1)
    } else {
        (0, (1_i64 << width) - 1)
    };
    let (value, inexact) = match unpack(x, fpscr) {
        Number::Nan => {
            *fpscr |= IOC;
            return 0;
        }
        Number::Infinity { negative } => (if negative { i64::MIN } else { i64::MAX }, false),
        Number::Finite(x) => {
            // All values above 2^60 saturate.
            let drop = 62 - x.exponent - i32::from(fraction);
            let drop = if x.is_zero() { 63 } else { drop.max(1) };
            let (magnitude, inexact) = drop_bits(x.significand, drop as u32, x.negative, rounding);
            let magnitude = magnitude as i64;
            (if x.negative { -magnitude } else { magnitude }, inexact)
        }
    };
    let clamped = value.clamp(least, greatest);
    if clamped != value {
        *fpscr |= IOC;
    } else if inexact {
        *fpscr |= IXC;
    }
    clamped as u32
}

/// Converts half precision, in the format that FPSCR.AHP selects, to single precision; exact.
pub(super) fn half_to_single(half: u32, fpscr: &mut u32) -> u32 {
    let sign = (half & 0x8000) << 16;
    let (biased, fraction) = (half >> 10 & 0x1F, half & 0x3FF);
    match biased {
        0 => {
            let exact = Finite::new(sign != 0, -14, u64::from(fraction) << 52);
            // FZ does not apply to half precision, and none of these results is tiny.
            round(exact, SINGLE, Rounding::Nearest, fpscr)
        }
        0x1F if *fpscr & AHP == 0 && fraction == 0 => sign | 0x7F80_0000,
        0x1F if *fpscr & AHP == 0 => {
            if fraction & 0x200 == 0 {
                *fpscr |= IOC;
            }
            if *fpscr & DN != 0 {
                DEFAULT_NAN
            } else {
                sign | DEFAULT_NAN | fraction << 13
            }
        }
        _ => sign | (biased + 127 - 15) << 23 | fraction << 13,
    }
}

/// Converts single precision to half precision, in the format that FPSCR.AHP selects.
pub(super) fn single_to_half(x: u32, fpscr: &mut u32) -> u32 {
    let sign = x >> 16 & 0x8000;
    let alternative = *fpscr & AHP != 0;
    match unpack(x, fpscr) {
        Number::Nan => {
            if alternative || x & 1 << 22 == 0 {
                *fpscr |= IOC;
            }
            if alternative {
                sign
            } else if *fpscr & DN != 0 {
                0x7E00
            } else {
                sign | 0x7E00 | x >> 13 & 0x1FF
            }
        }
        Number::Infinity { .. } if alternative => {
            *fpscr |= IOC;
            sign | 0x7FFF
        }
        Number::Infinity { .. } => sign | 0x7C00,
        Number::Finite(x) => round(x, HALF, Rounding::from_fpscr(*fpscr), fpscr),
    }
}
