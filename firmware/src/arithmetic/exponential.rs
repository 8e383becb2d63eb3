//! Exponential and logarithm in 32-bit fixed point, for Cortex-M4's 32×32→64 multiplier: no table,
//! no division, a fixed number of multiplications.
//!
//! `Q32` below means a fraction of 1 in units of 2^-32, `Q31` of 2^-31. Polynomials are minimax
//! fits with the constant term fixed at 1, found by Remez exchange in rational arithmetic; the
//! tests verify the bound of each.

/// Constant ln 2, Q32.
pub(crate) const LN_2: u32 = 2_977_044_472;
/// Constant log2 e, Q31.
pub(crate) const LOG2_E: u32 = 3_098_164_009;

/// Coefficients of (1 − e^−z)/z on 0…0.505 for 1, z, z²…, Q32, with alternating signs. Four terms:
/// one step of a muscle needs no more, and evaluates them every time.
const DECAY: [u32; 4] = [u32::MAX, 2_146_306_263, 704_522_947, 144_587_754];

/// Coefficients of (1 − e^−z)/z on 0…0.7, for one octave, in the form of [`DECAY`].
const OCTAVE: [u32; 6] = [
    u32::MAX,
    2_147_476_910,
    715_728_741,
    178_425_745,
    34_454_819,
    4_330_953,
];

/// Coefficients of ln(1+s)/s on 0…1 for 1, s, s²…, Q32, with alternating signs.
const LOG: [u32; 9] = [
    u32::MAX,
    2_147_435_657,
    1_430_526_710,
    1_063_321_139,
    807_598_628,
    561_436_724,
    308_079_753,
    110_575_906,
    18_641_541,
];

/// Coefficients of log2(1+s)/(2s) on 0…1, in the form of [`LOG`] with fewer terms.
const LOG_COARSE: [u32; 6] = [
    3_098_164_009,
    1_546_189_193,
    999_490_046,
    629_061_111,
    289_997_139,
    64_924_728,
];

/// Returns the upper word of a product: the product of two fractions, rounded down. Formats add:
/// Q32·Q32 → Q32, Q32·Q31 → Q31.
#[inline(always)]
pub(crate) const fn mul_high(a: u32, b: u32) -> u32 {
    // A product of two 32-bit words fits 64 bits, and its upper half fits 32.
    ((a as u64 * b as u64) >> 32) as u32
}

/// Evaluates s·(c0 − s·(c1 − s·(c2 − …))), all Q32. The coefficients decrease, so each bracket
/// stays within 0…1 and the differences never wrap.
#[inline(always)]
pub(crate) fn alternating_series<const N: usize>(coefficients: &[u32; N], s: u32) -> u32 {
    let sum = coefficients
        .iter()
        .rev()
        .fold(0u32, |inner, &c| c.wrapping_sub(mul_high(s, inner)));
    mul_high(s, sum)
}

/// Computes 1 − e^−z for z in 0…0.505, both Q32. The error is below 9e-7; the result is zero at
/// zero.
#[inline(always)]
pub(crate) fn decay_fraction(z: u32) -> u32 {
    alternating_series(&DECAY, z)
}

/// Computes 1 − (1 − e^−z)/z for z in 0…0.505, both Q32: the lag of a decay behind its initial
/// rate. The error is below 0.0105·z², and below 0.0023.
#[inline(always)]
pub(crate) fn lag(z: u32) -> u32 {
    // 1/2 − 5z/32 is exact at 0.28 and at 0.
    mul_high(z, (1u32 << 31).wrapping_sub(z >> 3).wrapping_sub(z >> 5))
}

/// Computes e^−z for z in Q32, as Q31, with the error of [`exp2_neg`].
pub(crate) fn decay(z: u32) -> u32 {
    exp2_neg((u64::from(z) * u64::from(LOG2_E)) >> 31) // below 2^64
}

/// Returns the coefficients d of the decay e^(−z/2)·e^(−zs) for s of −1/2…1/2: d0 + s·(d1 + s·(d2 +
/// s·(d3 + s·d4))), Q31. z is at most 0.52 in Q32. They are those of the series, with the next term
/// distributed over the others (Chebyshev): the error is within z⁵/13,000 and a few units, and the
/// value 1 is never reached.
pub(crate) fn decay_around_middle(z: u32) -> [i32; 5] {
    // Powers of z in Q32, and times e^(−z/2) in Q31: all below 2^31.
    let z2 = mul_high(z, z);
    let z4 = mul_high(z2, z2);
    let middle = decay(z >> 1);
    // Largest excess of the series, z⁵/61,440, and the truncation errors.
    let less = mul_high(z, z4) / 61_440 + 8;
    let once = mul_high(middle, z - mul_high(z, z4) / 6144);
    let thrice = mul_high(mul_high(middle, z), mul_high(z2, (1 << 31) / 3 + z2 / 384));
    let fourth = mul_high(middle, z4 / 24);
    let [d0, d1, d2, d3, d4] = [middle, once, mul_high(middle, z2 / 2), thrice, fourth];
    [
        (d0 - less) as i32,
        -(d1 as i32),
        d2 as i32,
        -(d3 as i32),
        d4 as i32,
    ]
}

/// Computes 2^−x for x ≥ 0 in Q32, as Q31. The error is below 3e-9 plus one unit of 2^-31; the
/// result is exactly 1 at zero, and 0 from x = 32.
pub fn exp2_neg(x: u64) -> u32 {
    let (whole, fraction) = ((x >> 32) as u32, x as u32);
    if fraction == 0 {
        return (1u32 << 31).checked_shr(whole).unwrap_or(0);
    }
    let mantissa = !alternating_series(&OCTAVE, mul_high(fraction, LN_2));
    // 1 + whole >= 1, saturating for very large x; this shift converts Q32 into Q31.
    mantissa.checked_shr(whole.saturating_add(1)).unwrap_or(0)
}

/// Computes e^−x for x ≥ 0 in Q32, as Q31. The relative error is below 2e-6.
pub(crate) fn exp_neg(x: u64) -> u32 {
    // e^-32 is below 2^-31, so the result is 0 from there on. 2^37 >> 6 times 2^32 fits.
    let x = x.min(32 << 32) >> 6;
    exp2_neg((x * u64::from(LOG2_E)) >> 25)
}

/// Computes −ln(y) for y in Q31 as in [`log2_neg`], as Q32: at most 21.5.
pub(crate) fn ln_neg(y: u32) -> u64 {
    // 31 · 2^26 · 2^32 fits.
    ((log2_neg(y) >> 6) * u64::from(LN_2)) >> 26
}

/// Computes −log2(y) for y in Q31, 0 < y ≤ 1, as Q32. The error is below 1.3e-8. y = 0 counts as
/// the smallest y, y > 1 as 1.
pub fn log2_neg(y: u32) -> u64 {
    let y = y.clamp(1, 1 << 31);
    let whole = y.leading_zeros();
    // y = m·2^−whole with m in 1…2; shifting out the leading 1 leaves m − 1.
    let s = (y << whole) << 1;
    let log2_m = (u64::from(alternating_series(&LOG, s)) * u64::from(LOG2_E)) >> 31;
    // whole <= 31, and log2 m <= 1 <= whole whenever m > 1.
    (u64::from(whole) << 32).saturating_sub(log2_m)
}

/// Computes −log2(y) for y in Q31, 0 < y ≤ 1, in 2^-27, with fewer terms: the error is below
/// 3.6e-6. y = 0 counts as the smallest y, y > 1 as 1.
pub(crate) fn log2_neg_coarse(y: u32) -> u32 {
    let y = y.clamp(1, 1 << 31);
    let whole = y.leading_zeros();
    // Shifts the leading 1 out; y = 1 is not shifted and is negligible.
    let s = y.wrapping_shl(whole.wrapping_add(1));
    // Half of log2 m in Q32; whole <= 31.
    (whole << 27).saturating_sub(alternating_series(&LOG_COARSE, s) >> 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    const Q32: f64 = 4_294_967_296.0;
    const Q31: f64 = 2_147_483_648.0;

    /// Returns the largest |approximation − truth| over an even grid of `n` arguments.
    fn worst(n: u32, f: impl Fn(u32) -> f64) -> f64 {
        (0..=n).map(f).map(f64::abs).fold(0.0, f64::max)
    }

    /// Asserts that the bound holds, and exceeds the error by at most a factor of two.
    #[track_caller]
    fn is_tight(error: f64, bound: f64) {
        assert!(error <= bound, "{error:e} exceeds {bound:e}");
        assert!(error >= bound / 2.0, "{error:e} beats {bound:e} by half");
    }

    #[test]
    fn decay_fraction_keeps_its_bound() {
        let error = worst(1_000_000, |i| {
            let z = (0.505 * Q32 * f64::from(i) / 1e6) as u32;
            f64::from(decay_fraction(z)) / Q32 + (-f64::from(z) / Q32).exp_m1()
        });
        std::println!("decay_fraction: {error:e}");
        is_tight(error, 9e-7);
        assert_eq!(decay_fraction(0), 0);
    }

    #[test]
    fn a_decay_around_its_middle_keeps_its_bound() {
        let part = |z: f64| {
            let d = decay_around_middle((z * Q32) as u32);
            worst(10_000, |i| {
                let s = f64::from(i) / 1e4 - 0.5;
                let left = d
                    .iter()
                    .rev()
                    .fold(0.0, |sum, &d| f64::from(d) / Q31 + s * sum);
                let off = left / (-z * (0.5 + s)).exp() - 1.0;
                assert!(left < 1.0, "{z} {s}: {left}");
                off / (z.powi(5) / 1.3e4 + 1e-8)
            })
        };
        let error = [0.001, 0.01, 0.1, 0.25, 0.4, 0.45, 0.52].map(part);
        std::println!("decay_around_middle, of its bound: {error:?}");
        is_tight(error.into_iter().fold(0.0, f64::max), 1.0);
    }

    #[test]
    fn lag_keeps_its_bounds() {
        let off = |z: u32| {
            let exact = f64::from(z) / Q32;
            f64::from(lag(z)) / Q32 - (1.0 + (-exact).exp_m1() / exact)
        };
        let grid = |i: u32| (0.505 * Q32 * f64::from(i.max(1)) / 1e6) as u32;
        let error = worst(1_000_000, |i| off(grid(i)));
        let scaled = worst(1_000_000, |i| {
            let z = grid(i.max(1000));
            off(z) / (f64::from(z) / Q32).powi(2)
        });
        std::println!("lag: {error:e}, over z squared {scaled:e}");
        is_tight(error, 2.3e-3);
        is_tight(scaled, 1.05e-2);
        assert_eq!(lag(0), 0);
    }

    #[test]
    fn exp2_neg_keeps_its_bound() {
        let error = worst(2_000_000, |i| {
            let x = u64::from(i) * 8_589_935; // 0…4 octaves
            let truth = (-(x as f64) / Q32).exp2();
            (f64::from(exp2_neg(x)) / Q31 - truth).abs() - 1.0 / Q31
        });
        std::println!("exp2_neg: {error:e}");
        is_tight(error, 3e-9);
        assert_eq!(exp2_neg(0), 1 << 31);
        assert_eq!(exp2_neg(31 << 32), 1);
        assert_eq!(exp2_neg(u64::MAX), 0);
    }

    #[test]
    fn log2_neg_keeps_its_bound() {
        let error = worst(2_000_000, |i| {
            let y = (1u32 << 31) - i * 1_073;
            log2_neg(y) as f64 / Q32 + (f64::from(y) / Q31).log2()
        });
        std::println!("log2_neg: {error:e}");
        is_tight(error, 1.3e-8);
        let coarse = worst(2_000_000, |i| {
            let y = (1u32 << 31) - i * 1_073;
            f64::from(log2_neg_coarse(y)) / 134_217_728.0 + (f64::from(y) / Q31).log2()
        });
        std::println!("log2_neg_coarse: {coarse:e}");
        is_tight(coarse, 3.6e-6);
        assert_eq!(log2_neg_coarse(1 << 31), 0);
        assert_eq!(log2_neg_coarse(0), 31 << 27);
        assert_eq!(log2_neg(1 << 31), 0);
        assert_eq!(log2_neg(1), 31 << 32);
        assert_eq!(log2_neg(0), log2_neg(1));
        assert_eq!(log2_neg(u32::MAX), 0);
    }
}
