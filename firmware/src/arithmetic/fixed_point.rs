//! Number format of the controllers, and its exact operations.

use fixed::types::{I16F16, I40F24};

/// Number format inside the controllers: Q39.24, resolution 6e-8, range ±5.5e11.
///
/// 24 fraction bits represent the smallest relevant coefficient (h²·b·k2, about 6e-4 at 1 ms) with
/// a relative error of 1e-4; products saturate and round towards −∞.
pub type Q = I40F24;

/// Constant π/180 in [`Q`]: 0.017453292, with a relative error of 1.4e-6.
pub(crate) const RAD_PER_DEG: Q = Q::from_bits(292_819);

/// Computes `numerator` / `denominator` in [`Q`], rounded to nearest, for gains at construction.
/// The caller must keep the numerator below 2^63 and the quotient below 2^38.
pub(crate) fn ratio(numerator: u64, denominator: u64) -> Q {
    let n = u128::from(numerator) << Q::FRAC_NBITS;
    let d = u128::from(denominator.max(1));
    // 2^87 / d fits i64 if the caller keeps the bound; the clamp ensures it.
    Q::from_bits(((n + d / 2) / d).min(i64::MAX as u128) as i64)
}

/// Computes a·b, rounded towards −∞, for |b| <= 128 and |a·b| < 2^39, with two short products in
/// place of a 128-bit one.
pub(crate) const fn product(a: Q, b: Q) -> Q {
    let (a, b) = (a.to_bits(), b.to_bits());
    // a = upper·2^32 + lower. lower · b < 2^32 · 2^31; everything else is exact modulo 2^64, and
    // the sum fits by the caller's bound.
    let (upper, lower) = (a >> 32, a & 0xFFFF_FFFF);
    let fine = lower.wrapping_mul(b) >> Q::FRAC_NBITS;
    let coarse = upper.wrapping_mul(b) << (32 - Q::FRAC_NBITS);
    Q::from_bits(coarse.wrapping_add(fine))
}

/// Returns `x`, or the nearest 32-bit number.
#[inline(always)]
pub(crate) const fn saturated(x: i64) -> i32 {
    let low = x as i32;
    if low as i64 == x {
        low
    } else {
        (x >> 63) as i32 ^ i32::MAX
    }
}

/// Converts ° to rad in bits of [`Q`], within ±72; angles beyond ±4096° are clamped to that.
#[inline(always)]
pub(crate) fn radians(degrees: I16F16) -> i32 {
    /// Constant π/180 in 2^-30.
    const RAD_PER_DEG_Q30: i64 = 18_740_330;
    let degrees = degrees.to_bits().clamp(-(1 << 28), (1 << 28) - 1);
    // 2^28 · 2^24.2; 16 + 30 − 22 = 24 fraction bits, below 2^30.2.
    (i64::from(degrees).wrapping_mul(RAD_PER_DEG_Q30) >> 22) as i32
}
