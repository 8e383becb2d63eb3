//! The integral term of a law, one for each muscle.
//!
//! What is not as the wearer's file says (threshold, gain, fatigue) is each
//! muscle's own: a threshold that has risen by a fifth leaves a gap of half the
//! effort's range between flexing and extending, which a single integral would have
//! to cross at its own pace each time. Two of them step over it: an inverse of the
//! dead zone (Tao & Kokotović, Adaptive Control of Systems with Actuator and Sensor
//! Nonlinearities, 1996, ch. 3) whose ends are learnt.

use crate::arithmetic::fixed_point::{Q, saturated};

/// 1 in 2^-24.
pub(super) const ONE: i32 = 1 << Q::FRAC_NBITS;
/// Each integral stays within ±64.
const MOST: i32 = 64 << Q::FRAC_NBITS;
/// The change from one muscle to the other takes 1/64 of the range either side of 0:
/// 2^18, which 5 bits more make half of [`ONE`].
const ZONE: i32 = ONE >> 6;
const STEEPNESS: u32 = 5;

/// What a law's integral term holds for either muscle, effort; the flexor's is never
/// the lower one. While only [`Side::FLEXION`] is asked for it is one integral.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Integral {
    flexion: i32,
    extension: i32,
}

/// How much of an effort is the flexor's: 0…1, 2^-24.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Side(i32);

impl Side {
    /// All of it.
    pub(super) const FLEXION: Self = Self(ONE);

    /// Whose an effort is that asks for `torque` (−1…1) before any integral.
    #[inline(always)]
    pub(super) fn of(torque: Q) -> Self {
        // 0…2^19, shifted 0…2^24.
        let within = saturated(torque.to_bits()).clamp(-ZONE, ZONE);
        Self(within.wrapping_add(ZONE) << STEEPNESS)
    }
}

impl Integral {
    /// What it adds to an effort of this side.
    #[inline(always)]
    pub(super) fn at(&self, side: Side) -> Q {
        // Both within 2^30: 2^31 · 2^24, and the sum is between the two.
        let apart = i64::from(self.flexion).wrapping_sub(self.extension.into());
        let more = apart.wrapping_mul(side.0.into()) >> Q::FRAC_NBITS;
        Q::from_bits(more.wrapping_add(self.extension.into()))
    }

    /// Grows on this side.
    #[inline(always)]
    pub(super) fn grow(&mut self, side: Side, growth: Q) {
        let growth = saturated(growth.to_bits());
        // 2^31 · 2^24; what is left of it has its sign.
        let flexion = (i64::from(growth).wrapping_mul(side.0.into()) >> Q::FRAC_NBITS) as i32;
        let grown = |from: i32, by: i32| from.saturating_add(by).clamp(-MOST, MOST);
        self.flexion = grown(self.flexion, flexion);
        self.extension = grown(self.extension, growth.wrapping_sub(flexion));
        if self.flexion < self.extension {
            // Their sum is within 2^31 - 1: they differ.
            let middle = self.flexion.wrapping_add(self.extension) >> 1;
            (self.flexion, self.extension) = (middle, middle);
        }
    }
}
