//! How much of a law's feedback reaches the effort.

use crate::units::Angle;
use fixed::types::I16F16;

/// A share of the feedback, 0…1: what proportional, integral and derivative terms
/// and learning are lowered by; the feed-forward and what the integral holds are not.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Gain(u32);

impl Gain {
    /// All of it.
    pub(crate) const ONE: Self = Self(1 << 16);

    /// `bits` of 2^-16; more than one is one.
    pub(super) const fn from_bits(bits: u32) -> Self {
        if bits > 1 << 16 {
            Self::ONE
        } else {
            Self(bits)
        }
    }

    /// In thousandths, rounded.
    pub(super) const fn to_milli(self) -> u16 {
        // At most 2^16 · 1000.
        ((self.0 * 1000 + (1 << 15)) >> 16) as u16
    }

    /// This share of `x`, rounded towards −∞; |x| < 2^46.
    #[inline(always)]
    pub(super) const fn scale(self, x: i64) -> i64 {
        x.wrapping_mul(self.0 as i64) >> 16 // below 2^62
    }

    /// This share of an angle.
    #[inline(always)]
    pub(super) fn scale_angle(self, x: Angle) -> Angle {
        let bits = self.scale(x.get().to_bits().into()) as i32; // no larger than `x`
        Angle::new(I16F16::from_bits(bits))
    }

    /// Both, one after the other.
    pub(super) const fn combine(self, other: Self) -> Self {
        Self(self.scale(other.0 as i64) as u32)
    }
}
