//! Exact quotients and square roots of 64-bit numbers with 32-bit results.

/// Computes `numerator / denominator`, rounded down. Returns `None` if the result needs more than
/// 32 bits, or if the denominator is 0.
///
/// A core with a 32-bit divider needs two short divisions for this, a fifth of the time of a 64-bit
/// division. The method is long division in base 2^16; with the divisor's top bit set, a digit's
/// estimate is at most 2 too large (Knuth, TAOCP vol. 2, 4.3.1, theorem B).
#[must_use]
pub const fn quotient(numerator: u64, denominator: u32) -> Option<u32> {
    let high = (numerator >> 32) as u32;
    if high >= denominator {
        return None;
    }
    if high == 0 {
        return (numerator as u32).checked_div(denominator);
    }
    let shift = denominator.leading_zeros();
    // high < denominator, so no bit of either is lost.
    let (n, d) = (numerator << shift, denominator << shift);
    let (upper, rest) = divide_digit((n >> 32) as u32, (n >> 16) as u16, d);
    let (lower, _) = divide_digit(rest, n as u16, d);
    Some(upper << 16 | lower)
}

/// Computes the square root, rounded down, with multiplications only: a cubic in the upper word
/// gives a first estimate of 1/√x, a step of third order (Halley) refines it, and one Newton step
/// extends the root from 32 bits to all of them. This takes a quarter of the time of `u64::isqrt`
/// on a core with a 32×32→64 multiplier.
#[must_use]
#[inline]
pub const fn square_root(x: u64) -> u32 {
    // Even shifts, of which the root undoes half.
    let (x, half_shift) = if x >> 32 == 0 { (x << 32, 16) } else { (x, 0) };
    let shift = ((x >> 32) as u32).leading_zeros() & 30;
    let x = x << shift;
    // t = x·2^-64 in 1/4…1; x = 0 stays 0 in all steps.
    let top = (x >> 32) as u32;
    let inverse = inverse_root(top);
    // √x less 0…14 610: up to 3.4e-6 from `inverse`, 9 from truncated words.
    let root = upper_word(top, inverse) << 3;
    let rest = x.wrapping_sub(root as u64 * root as u64); // below 2^47
    // (√x − root)·(1 − 5.1e-6), less a bit: at most 1.08 is still missing.
    let root = root.wrapping_add(upper_word((rest >> 15) as u32, inverse) >> 15);
    let rest = x.wrapping_sub(root as u64 * root as u64);
    let root = root.wrapping_add((rest > 2 * root as u64) as u32);
    root >> (half_shift + shift / 2)
}

/// Computes 1/√t in 2^-29 for t in 1/4…1, Q32; the relative error is −3.4e-6…0.
#[inline(always)]
const fn inverse_root(t: u32) -> u32 {
    // h = 1 − t·y² is within 0.0159. Coefficients of 8 bits need one instruction each. All brackets
    // are positive, so y is in 2^28…2^31.
    const CUBIC: [u32; 4] = [0x6300_0000, 0xB900_0000, 0xBF00_0000, 0x4900_0000];
    let [c0, c1, c2, c3] = CUBIC;
    let bracket = c1.wrapping_sub(upper_word(t, c2.wrapping_sub(upper_word(t, c3))));
    let y = c0.wrapping_sub(upper_word(t, bracket));
    // h in 2^-31: y·y·t is 2^26 except for h. Then 1/√(1 − h) − 1 in halves, h + 3h²/4, whose error
    // 5h³/8 is below 2.5e-6; less 2^-18, so that the result is never too large.
    let h = ((1u32 << 26).wrapping_sub(upper_word(t, upper_word(y, y))) << 5) as i32;
    let square = ((h as i64 * h as i64) >> 32) as i32; // 2^-30
    let k = h.wrapping_add(square).wrapping_add(square >> 1);
    let k = k.wrapping_sub(1 << 13);
    y.wrapping_add(((y as i32 as i64 * k as i64) >> 32) as u32)
}

/// Returns the upper word of a product.
#[inline(always)]
const fn upper_word(a: u32, b: u32) -> u32 {
    ((a as u64 * b as u64) >> 32) as u32
}

/// Returns quotient and remainder of `rest·2^16 + next` by `d`, for `rest < d` and `d >= 2^31`: one
/// digit below 2^16.
const fn divide_digit(rest: u32, next: u16, d: u32) -> (u32, u32) {
    let dividend = (rest as u64) << 16 | next as u64;
    // The divisor is at least 2^15, so the division never fails; only the compiler cannot prove it.
    let mut digit = match rest.checked_div(d >> 16) {
        Some(estimate) if estimate < 0xFFFF => estimate,
        _ => 0xFFFF,
    };
    let mut product = digit as u64 * d as u64;
    while product > dividend {
        digit = digit.wrapping_sub(1); // the true digit is smaller, and >= 0
        product = product.wrapping_sub(d as u64);
    }
    (digit, dividend.wrapping_sub(product) as u32) // 0 <= rest < d
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn quotients_that_do_not_fit_are_refused() {
        assert_eq!(quotient(5, 0), None);
        assert_eq!(quotient(0, 0), None);
        assert_eq!(quotient(1 << 32, 1), None);
        assert_eq!(quotient(u64::MAX, u32::MAX), None);
        assert_eq!(quotient(u64::MAX - (1 << 32), u32::MAX), Some(u32::MAX));
    }

    #[test]
    fn the_inverse_root_is_below_by_its_bound() {
        let least = 1u32 << 30;
        let (mut worst, mut best) = (0f64, 1f64);
        for t in (least..u32::MAX).step_by(1_009).chain([u32::MAX]) {
            let product =
                f64::from(inverse_root(t)) / 2f64.powi(29) * (f64::from(t) / 2f64.powi(32)).sqrt();
            (worst, best) = (worst.max(1.0 - product), best.min(1.0 - product));
        }
        std::println!("inverse root: below by {best:e} to {worst:e}");
        assert!((1.7e-6..3.4e-6).contains(&worst), "{worst:e}");
        assert!(best > 0.0, "{best:e}");
    }

    #[test]
    fn roots_beside_squares_are_exact() {
        let edges = [
            0,
            1,
            2,
            3,
            u64::MAX,
            1 << 62,
            (1 << 62) - (1 << 24),
            1 << 32,
            (1 << 32) - 1,
        ];
        for x in edges {
            assert_eq!(u64::from(square_root(x)), x.isqrt(), "{x}");
        }
        for n in (0..u32::MAX)
            .step_by(9_973)
            .chain(u32::MAX - 999..=u32::MAX)
        {
            let square = u64::from(n) * u64::from(n);
            assert_eq!(square_root(square), n);
            assert_eq!(square_root(square + 2 * u64::from(n)), n);
            assert_eq!(square_root(square.saturating_sub(1)), n.saturating_sub(1));
        }
    }

    proptest! {
        #[test]
        fn it_is_the_root(x: u64, shift in 0..64u32) {
            prop_assert_eq!(u64::from(square_root(x >> shift)), (x >> shift).isqrt());
        }

        #[test]
        fn it_is_the_long_division(n: u64, d: u32, shift in 0..64u32, narrow in 0..32u32) {
            let (n, d) = (n >> shift, d >> narrow);
            let exact = n.checked_div(d.into()).and_then(|q| u32::try_from(q).ok());
            prop_assert_eq!(quotient(n, d), exact);
        }

        #[test]
        fn digits_near_the_estimate_are_exact(q: u32, d in 1u32.., below in 0..4u32) {
            let n = (u64::from(q) * u64::from(d)).saturating_add(u64::from(d - 1)) - u64::from(below.min(d - 1));
            prop_assert_eq!(quotient(n, d), Some((n / u64::from(d)) as u32));
        }
    }
}
