//! Computes addition, multiplication, division, square root, fused multiply-add and comparison (Arm
//! ARM A2.5, FPAdd … FPMulAdd, FPCompare).
//!
//! The host's floating-point unit computes where its result is provably the same: rounding to
//! nearest, nothing flushed, the inexact flag already set, and a result that is normal and above
//! the smallest normal number, so that it can set no other flag.

use super::fpscr::{DZC, FZ, IOC, IXC, RMODE};
use super::number::{
    Finite, Number, Rounding, SINGLE, flush, infinity, invalid, is_nan, propagate, round,
    shift_sticky, unpack, zero,
};
use std::cmp::Ordering;

const SIGN: u32 = 1 << 31;

/// Returns the bits of `result`, computed by the processor that runs the simulator, if they are
/// provably correct here: default rounding, the inexact flag already set, and no result near an
/// overflow or underflow.
#[inline]
fn by_host(result: f32, fpscr: u32) -> Option<u32> {
    let bits = result.to_bits();
    let may = fpscr & (RMODE | FZ | IXC) == IXC;
    let ordinary = (bits >> 23 & 0xFF).wrapping_sub(2) < 0xFD;
    (may && ordinary).then_some(bits)
}

/// Computes a + b in single precision; operands and result are bit patterns.
#[inline]
pub(super) fn add(a: u32, b: u32, fpscr: &mut u32) -> u32 {
    by_host(f32::from_bits(a) + f32::from_bits(b), *fpscr)
        .unwrap_or_else(|| exact_add([a, b], b, fpscr))
}

/// Computes a - b in single precision; operands and result are bit patterns.
#[inline]
pub(super) fn subtract(a: u32, b: u32, fpscr: &mut u32) -> u32 {
    // A NaN operand keeps its sign.
    by_host(f32::from_bits(a) - f32::from_bits(b), *fpscr)
        .unwrap_or_else(|| exact_add([a, b], b ^ SIGN, fpscr))
}

/// Adds `b` to the first of `operands` without the host's floating point. `b` is the second
/// operand, negated for a subtraction; a NaN result comes from `operands`.
fn exact_add(operands: [u32; 2], b: u32, fpscr: &mut u32) -> u32 {
    let (x, y) = (unpack(operands[0], fpscr), unpack(b, fpscr));
    match (x, y) {
        (Number::Nan, _) | (_, Number::Nan) => propagate(operands, fpscr).unwrap_or(0),
        (Number::Infinity { negative: x }, Number::Infinity { negative: y }) if x != y => {
            invalid(fpscr)
        }
        (Number::Infinity { negative }, _) | (_, Number::Infinity { negative }) => {
            infinity(negative)
        }
        (Number::Finite(x), Number::Finite(y)) => sum(x, y, fpscr),
    }
}

/// Computes x + y, rounded to single precision in the mode of FPSCR.
fn sum(x: Finite, y: Finite, fpscr: &mut u32) -> u32 {
    let rounding = Rounding::from_fpscr(*fpscr);
    let is_above = (x.exponent, x.significand) >= (y.exponent, y.significand);
    let (large, small) = if is_above { (x, y) } else { (y, x) };
    let by = large.exponent - small.exponent;
    let aligned = shift_sticky(small.significand, by as u32);
    let significand = if large.negative == small.negative {
        large.significand + aligned
    } else {
        large.significand - aligned
    };
    if significand == 0 {
        let is_negative = x.negative && y.negative;
        let none = !x.negative && !y.negative;
        return zero(is_negative || !none && rounding == Rounding::Down);
    }
    let exact = Finite::new(large.negative, large.exponent, significand);
    round(exact, SINGLE, rounding, fpscr)
}

/// Computes a × b in single precision; operands and result are bit patterns.
#[inline]
pub(super) fn multiply(a: u32, b: u32, fpscr: &mut u32) -> u32 {
    by_host(f32::from_bits(a) * f32::from_bits(b), *fpscr)
        .unwrap_or_else(|| exact_multiply(a, b, fpscr))
}

fn exact_multiply(a: u32, b: u32, fpscr: &mut u32) -> u32 {
    let negative = (a ^ b) & SIGN != 0;
    match (unpack(a, fpscr), unpack(b, fpscr)) {
        (Number::Nan, _) | (_, Number::Nan) => propagate([a, b], fpscr).unwrap_or(0),
        (Number::Infinity { .. }, Number::Finite(x))
        | (Number::Finite(x), Number::Infinity { .. })
            if x.is_zero() =>
        {
            invalid(fpscr)
        }
        (Number::Infinity { .. }, _) | (_, Number::Infinity { .. }) => infinity(negative),
        (Number::Finite(x), Number::Finite(y)) => {
            let rounding = Rounding::from_fpscr(*fpscr);
            round(product(x, y), SINGLE, rounding, fpscr)
        }
    }
}

/// Computes x × y exactly, in 48 bits.
fn product(x: Finite, y: Finite) -> Finite {
    let significand = ((x.significand >> 39) * (y.significand >> 39)) << 16;
    Finite::new(
        x.negative != y.negative,
        x.exponent + y.exponent,
        significand,
    )
}

/// Computes a / b in single precision; operands and result are bit patterns.
#[inline]
pub(super) fn divide(a: u32, b: u32, fpscr: &mut u32) -> u32 {
    by_host(f32::from_bits(a) / f32::from_bits(b), *fpscr)
        .unwrap_or_else(|| exact_divide(a, b, fpscr))
}

fn exact_divide(a: u32, b: u32, fpscr: &mut u32) -> u32 {
    let negative = (a ^ b) & SIGN != 0;
    match (unpack(a, fpscr), unpack(b, fpscr)) {
        (Number::Nan, _) | (_, Number::Nan) => propagate([a, b], fpscr).unwrap_or(0),
        (Number::Infinity { .. }, Number::Infinity { .. }) => invalid(fpscr),
        (Number::Infinity { .. }, _) => infinity(negative),
        (_, Number::Infinity { .. }) => zero(negative),
        (Number::Finite(x), Number::Finite(y)) if y.is_zero() => {
            if x.is_zero() {
                return invalid(fpscr);
            }
            *fpscr |= DZC;
            infinity(negative)
        }
        (Number::Finite(x), Number::Finite(y)) => {
            let (dividend, divisor) = (x.significand >> 39 << 40, y.significand >> 39);
            let sticky = u64::from(dividend % divisor != 0);
            let significand = (dividend / divisor) << 22 | sticky;
            let exact = if x.is_zero() {
                Finite::zero(negative)
            } else {
                Finite::new(negative, x.exponent - y.exponent, significand)
            };
            round(exact, SINGLE, Rounding::from_fpscr(*fpscr), fpscr)
        }
    }
}

/// Computes √a in single precision; operand and result are bit patterns.
#[inline]
pub(super) fn square_root(a: u32, fpscr: &mut u32) -> u32 {
    by_host(f32::from_bits(a).sqrt(), *fpscr).unwrap_or_else(|| exact_square_root(a, fpscr))
}

fn exact_square_root(a: u32, fpscr: &mut u32) -> u32 {
    match unpack(a, fpscr) {
        Number::Nan => propagate([a], fpscr).unwrap_or(0),
        Number::Finite(x) if x.is_zero() => zero(x.negative),
        Number::Infinity { negative: true } => invalid(fpscr),
        Number::Infinity { negative: false } => infinity(false),
        Number::Finite(x) if x.negative => invalid(fpscr),
        Number::Finite(x) => {
            // The exponent must be even, and the 61 or 62 bits have a root of 31 bits.
            let odd = (x.exponent & 1) as u32;
            let square = x.significand >> 39 << (37 + odd);
            let root = square.isqrt();
            let sticky = u64::from(root * root != square);
            let exact = Finite::new(false, x.exponent >> 1, root << 32 | sticky);
            round(exact, SINGLE, Rounding::from_fpscr(*fpscr), fpscr)
        }
    }
}

/// Computes addend + a × b, rounded once.
pub(super) fn multiply_add(addend: u32, a: u32, b: u32, fpscr: &mut u32) -> u32 {
    let negative = (a ^ b) & SIGN != 0;
    let (z, x, y) = (unpack(addend, fpscr), unpack(a, fpscr), unpack(b, fpscr));
    let infinite_times_zero = match (x, y) {
        (Number::Infinity { .. }, Number::Finite(f))
        | (Number::Finite(f), Number::Infinity { .. }) => f.is_zero(),
        _ => false,
    };
    if let Some(nan) = propagate([addend, a, b], fpscr) {
        // Infinity times zero is invalid even if the addend is a NaN; then it replaces a quiet NaN.
        let hides = infinite_times_zero && addend & 1 << 22 != 0;
        return if hides { invalid(fpscr) } else { nan };
    }
    if infinite_times_zero {
        return invalid(fpscr);
    }
    match (z, x, y) {
        (Number::Finite(z), Number::Finite(x), Number::Finite(y)) => sum(z, product(x, y), fpscr),
        (Number::Infinity { negative: minus }, Number::Finite(_), Number::Finite(_)) => {
            infinity(minus)
        }
        (Number::Infinity { negative: minus }, ..) if minus != negative => invalid(fpscr),
        _ => infinity(negative),
    }
}

/// Compares `a` with `b`; returns the flags N, Z, C, V at their positions in FPSCR.
#[inline]
pub(super) fn compare(a: u32, b: u32, signal: bool, fpscr: &mut u32) -> u32 {
    let (a, b) = (flush(a, fpscr), flush(b, fpscr));
    match f32::from_bits(a).partial_cmp(&f32::from_bits(b)) {
        Some(Ordering::Equal) => 0b0110 << 28,
        Some(Ordering::Less) => 0b1000 << 28,
        Some(Ordering::Greater) => 0b0010 << 28,
        None => {
            let signals = |x: u32| is_nan(x) && x & 1 << 22 == 0;
            if signal || signals(a) || signals(b) {
                *fpscr |= IOC;
            }
            0b0011 << 28
        }
    }
}
