//! Polynomials in signed fixed point.

use super::reciprocal::signed_high_rounded;

/// Evaluates a polynomial at t (Q32, −1/2…1/2), highest power first: one multiply-accumulate per
/// power, in the format of the coefficients. No intermediate sum may leave the format.
#[inline(always)]
pub(crate) fn horner<const N: usize>(powers: &[i32; N], t: i32) -> i32 {
    let add = |sum: i32, power: &i32| power.wrapping_add(signed_high_rounded(sum, t));
    powers.iter().fold(0, add)
}
