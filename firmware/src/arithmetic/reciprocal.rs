//! Division by multiplication, with the precision that a muscle model needs.

use super::exponential::mul_high;

/// Reciprocal 1/d for d > 0, within 2.5e-5 and without bias. It takes one 32-bit division; its
/// error differs from step to step and averages out.
#[derive(Clone, Copy)]
pub(crate) struct Reciprocal {
    /// Left shift of d that sets its top bit.
    shift: u32,
    /// Quotient of 2^63 and the shifted d.
    inverse: u32,
}

impl Reciprocal {
    /// Computes the reciprocal of d > 0.
    #[inline(always)]
    pub(crate) fn of(d: u32) -> Self {
        let shift = d.leading_zeros();
        // Middle of the values of d that 16 bits cannot distinguish: 2^16…2^17, odd.
        let normal = (d.wrapping_shl(shift) >> 15) | 1;
        // The quotient has 16 bits; half of one more bit is its middle.
        let inverse = ((u32::MAX / normal) << 16).wrapping_add(1 << 15);
        Self { shift, inverse }
    }

    /// Computes n/d in Q32, for quotients that are below 1 by more than the error, 2.5e-5.
    #[inline(always)]
    pub(crate) fn times(self, n: u32) -> u32 {
        // In Q31, as 2^63 over 2^31 fits the inverse; n < d, so no bit of n is lost in the shift.
        mul_high(n.wrapping_shl(self.shift), self.inverse) << 1
    }
}

/// Returns the upper word of a signed product, rounded down.
#[inline(always)]
pub(crate) const fn signed_high(a: i32, b: i32) -> i32 {
    // The product is below 2^62, so the upper half fits.
    ((a as i64 * b as i64) >> 32) as i32
}

/// Returns the upper word of a signed product, rounded to nearest.
#[inline(always)]
pub(crate) const fn signed_high_rounded(a: i32, b: i32) -> i32 {
    // At most 2^62 + 2^31.
    ((a as i64 * b as i64).wrapping_add(1 << 31) >> 32) as i32
}

/// Computes 1/p for p in 0.25…1, Q32, as Q29, with a relative error within 1.3e-7.
///
/// It takes one 16-bit division and one Newton step.
#[inline(always)]
pub(crate) const fn inverse(p: u32) -> u32 {
    // 2^16/p is at most 2^18; the divisor is odd, so never 0.
    let coarse = u32::MAX / ((p >> 16) | 1);
    // coarse·p − 1 in 2^-40 is below 2^-13, so its lower word contains the whole value.
    let above = (p >> 8).wrapping_mul(coarse) as i32;
    (coarse << 13).wrapping_sub(signed_high((coarse << 5) as i32, above) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn division_keeps_its_bound_and_has_no_bias() {
        let (mut worst, mut sum, mut n) = (0f64, 0f64, 0f64);
        for i in 0..2_000_000u32 {
            let d = (1u32 << 31).wrapping_add(i.wrapping_mul(1_073));
            let half = d >> 1;
            let quotient = f64::from(Reciprocal::of(d).times(half)) / 2f64.powi(32);
            let error = quotient * f64::from(d) / f64::from(half) - 1.0;
            (worst, sum, n) = (worst.max(error.abs()), sum + error, n + 1.0);
        }
        std::println!("reciprocal: worst {worst:e}, mean {:e}", sum / n);
        assert!((1.25e-5..2.5e-5).contains(&worst), "{worst:e}");
        assert!((sum / n).abs() < 1e-6, "{:e}", sum / n);
    }
}
