//! Share of a controller's feedback that reaches the effort.

use crate::units::Angle;
use fixed::types::I16F16;

/// Share of the feedback, 0…1. It scales the proportional, integral and derivative terms and the
/// learning; the feed-forward and the stored integral are not scaled.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Gain(u32);

impl Gain {
    /// Full feedback.
    pub(crate) const ONE: Self = Self(1 << 16);

    /// Creates a share from `bits` in 2^-16; values above one count as one.
    pub(super) const fn from_bits(bits: u32) -> Self {
        if bits > 1 << 16 {
            Self::ONE
        } else {
            Self(bits)
        }
    }

    /// Returns the share in thousandths, rounded.
    pub(super) const fn to_milli(self) -> u16 {
        // At most 2^16 · 1000.
        ((self.0 * 1000 + (1 << 15)) >> 16) as u16
    }

    /// Returns this share of `x`, rounded towards −∞; |x| < 2^46.
    #[inline(always)]
    pub(super) const fn scale(self, x: i64) -> i64 {
        x.wrapping_mul(self.0 as i64) >> 16 // below 2^62
    }

    #[inline(always)]
    pub(super) fn scale_angle(self, x: Angle) -> Angle {
        let bits = self.scale(x.get().to_bits().into()) as i32; // no larger than `x`
        Angle::new(I16F16::from_bits(bits))
    }

    /// Returns the product of both shares.
    pub(super) const fn combine(self, other: Self) -> Self {
        Self(self.scale(other.0 as i64) as u32)
    }
}
