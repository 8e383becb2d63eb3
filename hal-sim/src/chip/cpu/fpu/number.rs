//! Represents floating-point numbers in integers: unpacking, NaNs, and one rounding for every
//! format and mode (Arm ARM A2.5, FPUnpack, FPProcessNaN, FPRound).

use super::fpscr::{AHP, DN, FZ, IDC, IOC, IXC, OFC, RMODE, UFC};

/// A binary floating-point format of IEEE 754.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Format {
    /// Number of bits of the fraction, without the leading one.
    fraction: u32,
    /// Exponent of the smallest normal number.
    least: i32,
    /// Value of the exponent field in infinities and NaNs.
    infinity: u32,
}

/// Single precision, 32 bits.
pub(super) const SINGLE: Format = Format {
    fraction: 23,
    least: -126,
    infinity: 0xFF,
};

/// Half precision, 16 bits.
pub(super) const HALF: Format = Format {
    fraction: 10,
    least: -14,
    infinity: 0x1F,
};

/// Result of an invalid operation: a quiet, positive NaN with an empty payload.
pub(super) const DEFAULT_NAN: u32 = 0x7FC0_0000;

/// Rounding mode of a result that does not fit the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rounding {
    /// To nearest, ties to even.
    Nearest,
    /// Towards plus infinity.
    Up,
    /// Towards minus infinity.
    Down,
    /// Towards zero.
    Zero,
}

impl Rounding {
    /// Returns the rounding mode that FPSCR selects.
    pub(super) const fn from_fpscr(fpscr: u32) -> Self {
        match (fpscr & RMODE) >> 22 {
            0 => Self::Nearest,
            1 => Self::Up,
            2 => Self::Down,
            _ => Self::Zero,
        }
    }

    /// Returns whether a magnitude is rounded up, away from zero, when its low bits `dropped` are
    /// dropped and `kept` is kept. `half` is the value of `dropped` that lies halfway between two
    /// results.
    const fn is_away(self, negative: bool, kept: u64, dropped: u64, half: u64) -> bool {
        match self {
            Self::Nearest => dropped > half || dropped == half && kept & 1 != 0,
            Self::Up => dropped != 0 && !negative,
            Self::Down => dropped != 0 && negative,
            Self::Zero => false,
        }
    }
}

/// A finite number: `significand` × 2^(`exponent` − 62), with a sign. The highest bit of the
/// significand is bit 62, except for zero, whose exponent is below all others.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Finite {
    pub(super) negative: bool,
    pub(super) exponent: i32,
    pub(super) significand: u64,
}

/// Exponent by which [`Finite`] represents zero, below all others.
const NOTHING: i32 = -10_000;

impl Finite {
    pub(super) const fn zero(negative: bool) -> Self {
        Self {
            negative,
            exponent: NOTHING,
            significand: 0,
        }
    }

    /// Normalises `significand` × 2^(`exponent` − 62) so that bit 62 is the highest. If a bit is
    /// lost, the lowest bit is set.
    pub(super) const fn new(negative: bool, exponent: i32, significand: u64) -> Self {
        if significand == 0 {
            return Self::zero(negative);
        }
        let zeros = significand.leading_zeros();
        let (exponent, significand) = if zeros == 0 {
            (exponent + 1, shift_sticky(significand, 1))
        } else {
            (exponent + 1 - zeros as i32, significand << (zeros - 1))
        };
        Self {
            negative,
            exponent,
            significand,
        }
    }

    pub(super) const fn is_zero(self) -> bool {
        self.significand == 0
    }
}

/// A single-precision number, taken apart.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Number {
    /// Zero, denormal or normal.
    Finite(Finite),
    /// Plus or minus infinity.
    Infinity {
        /// Whether the infinity is minus infinity.
        negative: bool,
    },
    /// Not a number.
    Nan,
}

pub(super) const fn is_nan(x: u32) -> bool {
    x & 0x7FFF_FFFF > 0x7F80_0000
}

const fn is_signalling(x: u32) -> bool {
    is_nan(x) && x & 1 << 22 == 0
}

/// Flushes a denormal input to zero if FPSCR.FZ is set.
pub(super) const fn flush(x: u32, fpscr: &mut u32) -> u32 {
    if *fpscr & FZ != 0 && x & 0x7F80_0000 == 0 && x & 0x7F_FFFF != 0 {
        *fpscr |= IDC;
        return x & 1 << 31;
    }
    x
}

/// Takes the bits `x` of a single-precision number apart; flushes a denormal to zero if FPSCR.FZ is
/// set.
pub(super) const fn unpack(x: u32, fpscr: &mut u32) -> Number {
    let x = flush(x, fpscr);
    let negative = x >> 31 != 0;
    let (biased, fraction) = ((x >> 23 & 0xFF) as i32, (x & 0x7F_FFFF) as u64);
    match (biased, fraction) {
        (0xFF, 0) => Number::Infinity { negative },
        (0xFF, _) => Number::Nan,
        (0, _) => Number::Finite(Finite::new(negative, -126, fraction << 39)),
        _ => Number::Finite(Finite {
            negative,
            exponent: biased - 127,
            significand: (fraction | 1 << 23) << 39,
        }),
    }
}

/// Returns the NaN that an operation with the NaN operand `x` gives: `x` made quiet, or the default
/// NaN if FPSCR.DN is set.
pub(super) const fn quiet(x: u32, fpscr: &mut u32) -> u32 {
    if is_signalling(x) {
        *fpscr |= IOC;
    }
    if *fpscr & DN != 0 {
        DEFAULT_NAN
    } else {
        x | 1 << 22
    }
}

/// Returns the NaN that an operation with `operands` gives: from the first signalling NaN, else
/// from the first NaN. Returns `None` if no operand is a NaN.
pub(super) fn propagate<const N: usize>(operands: [u32; N], fpscr: &mut u32) -> Option<u32> {
    let signalling = operands.into_iter().find(|x| is_signalling(*x));
    let first = || operands.into_iter().find(|x| is_nan(*x));
    signalling.or_else(first).map(|x| quiet(x, fpscr))
}

/// Sets the invalid flag, and returns the default NaN.
pub(super) const fn invalid(fpscr: &mut u32) -> u32 {
    *fpscr |= IOC;
    DEFAULT_NAN
}

/// Returns a zero with the given sign.
pub(super) const fn zero(negative: bool) -> u32 {
    (negative as u32) << 31
}

/// Returns an infinity with the given sign.
pub(super) const fn infinity(negative: bool) -> u32 {
    (negative as u32) << 31 | 0x7F80_0000
}

/// Shifts `x` right by `by` bits. If a one is lost, the lowest bit of the result is set, so that
/// rounding notices it.
pub(super) const fn shift_sticky(x: u64, by: u32) -> u64 {
    match by {
        0 => x,
        1..64 => x >> by | (x << (64 - by) != 0) as u64,
        _ => (x != 0) as u64,
    }
}

/// Drops the `drop` lowest bits of `significand` (at least one) with rounding; returns the result,
/// and whether it is inexact.
pub(super) const fn drop_bits(
    significand: u64,
    drop: u32,
    negative: bool,
    rounding: Rounding,
) -> (u64, bool) {
    let (significand, drop) = if drop > 63 {
        (shift_sticky(significand, drop - 63), 63)
    } else {
        (significand, drop)
    };
    let kept = significand >> drop;
    let dropped = significand & ((1 << drop) - 1);
    let away = rounding.is_away(negative, kept, dropped, 1 << (drop - 1));
    (kept + away as u64, dropped != 0)
}

/// Rounds to `format`, and sets the flags in FPSCR. Tininess is detected before rounding.
pub(super) const fn round(x: Finite, format: Format, rounding: Rounding, fpscr: &mut u32) -> u32 {
    let width = if format.fraction == SINGLE.fraction {
        31
    } else {
        15
    };
    let sign = (x.negative as u32) << width;
    if x.is_zero() {
        return sign;
    }
    let tiny = x.exponent < format.least;
    if tiny && *fpscr & FZ != 0 && width == 31 {
        *fpscr |= UFC;
        return sign;
    }
    let below = if tiny { format.least - x.exponent } else { 0 };
    let drop = 62 - format.fraction + below as u32;
    let (kept, inexact) = drop_bits(x.significand, drop, x.negative, rounding);
    // The significand's leading one adds 1 to the exponent field.
    let above = if tiny { 0 } else { x.exponent - format.least };
    let bits = ((above as u64) << format.fraction) + kept;
    let alternative = width == 15 && *fpscr & AHP != 0;
    if alternative && bits > 0x7FFF {
        *fpscr |= IOC;
        return sign | 0x7FFF;
    }
    if !alternative && bits >> format.fraction >= format.infinity as u64 {
        *fpscr |= OFC | IXC;
        return sign | overflowed(x.negative, format, rounding);
    }
    if inexact {
        *fpscr |= if tiny { UFC | IXC } else { IXC };
    }
    sign | bits as u32
}

/// Returns the result of an overflow without its sign: infinity or the largest finite number, as
/// the rounding mode requires.
const fn overflowed(negative: bool, format: Format, rounding: Rounding) -> u32 {
    let infinity = format.infinity << format.fraction;
    match (rounding, negative) {
        (Rounding::Nearest, _) | (Rounding::Up, false) | (Rounding::Down, true) => infinity,
        _ => infinity - 1,
    }
}
