//! Division by multiplying, at the precision a muscle needs.

use super::exponential::mul_high;

/// 1/d for d > 0, within 2.5e-5 and without bias. One 32-bit division: its
/// error differs from step to step and averages out.
#[derive(Clone, Copy)]
pub(crate) struct Reciprocal {
    /// How far to shift d left until its top bit is set.
    shift: u32,
    /// 2^63 over the shifted d.
    inverse: u32,
}

impl Reciprocal {
    /// The reciprocal of d > 0.
    #[inline(always)]
    pub(crate) fn of(d: u32) -> Self {
        let shift = d.leading_zeros();
        // The middle of what 16 bits tell d apart from: 2^16…2^17, odd.
        let normal = (d.wrapping_shl(shift) >> 15) | 1;
        // The quotient has 16 bits; half of one more is its middle.
        let inverse = ((u32::MAX / normal) << 16).wrapping_add(1 << 15);
        Self { shift, inverse }
    }

    /// n/d in Q32, for quotients below 1 by more than the error, 2.5e-5.
    #[inline(always)]
    pub(crate) fn times(self, n: u32) -> u32 {
        // In Q31, as 2^63 over 2^31 fits the inverse; n < d is shifted within.
        mul_high(n.wrapping_shl(self.shift), self.inverse) << 1
    }
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
