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
/// the lower one. As long as all of it is [`Side::BOTH`]'s, it is one integral.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Integral {
    flexion: i32,
    extension: i32,
}

/// How much of an effort is the flexor's and how much the extensor's: 0…1, 2^-24.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Side {
    flexion: i32,
    extension: i32,
}

impl Side {
    /// All of it is both muscles'.
    pub(super) const BOTH: Self = Self {
        flexion: ONE,
        extension: ONE,
    };

    /// Whose an effort is that asks for `torque` (−1…1) before any integral; the
    /// parts sum to 1.
    #[inline(always)]
    pub(super) fn of(torque: Q) -> Self {
        // 0…2^19, shifted 0…2^24.
        let within = saturated(torque.to_bits()).clamp(-ZONE, ZONE);
        let flexion = within.wrapping_add(ZONE) << STEEPNESS;
        Self {
            flexion,
            extension: ONE.wrapping_sub(flexion),
        }
    }
}

impl Integral {
    /// What it adds to an effort of this side.
    #[inline(always)]
    pub(super) fn at(&self, side: Side) -> Q {
        // Both within 2^30: 2^31 · 2^24, and the sum is between the two.
        let apart = i64::from(self.flexion).wrapping_sub(self.extension.into());
        let more = apart.wrapping_mul(side.flexion.into()) >> Q::FRAC_NBITS;
        Q::from_bits(more.wrapping_add(self.extension.into()))
    }

    /// Grows on this side.
    #[inline(always)]
    pub(super) fn grow(&mut self, side: Side, growth: Q) {
        let growth = i64::from(saturated(growth.to_bits()));
        let grown = |from: i32, part: i32| {
            // 2^31 · 2^24.
            let by = growth.wrapping_mul(part.into()) >> Q::FRAC_NBITS;
            from.saturating_add(by as i32).clamp(-MOST, MOST)
        };
        self.flexion = grown(self.flexion, side.flexion);
        self.extension = grown(self.extension, side.extension);
        if self.flexion < self.extension {
            // Their sum is within 2^31 - 1: they differ.
            let middle = self.flexion.wrapping_add(self.extension) >> 1;
            (self.flexion, self.extension) = (middle, middle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn each_muscle_keeps_its_own_and_the_law_steps_from_one_to_the_other() {
        let mut integral = Integral::default();
        let [flexing, extending] = [0.1, -0.1].map(|torque| Side::of(Q::from_num(torque)));
        integral.grow(flexing, Q::from_num(0.25));
        integral.grow(extending, Q::from_num(-0.5));
        assert_eq!(integral.at(flexing), Q::from_num(0.25));
        assert_eq!(integral.at(extending), Q::from_num(-0.5));
        assert_eq!(integral.at(Side::of(Q::ZERO)), Q::from_num(-0.125));
        // Never the other way round: that would be positive feedback.
        integral.grow(flexing, Q::from_num(-1));
        assert_eq!(integral.at(flexing), Q::from_num(-0.625));
        assert_eq!(integral.at(extending), integral.at(flexing));
    }

    proptest! {
        #[test]
        fn one_integral_is_the_sum_of_what_it_is_given(
            growths in prop::collection::vec(-(1i64 << 26)..1 << 26, 0..16),
        ) {
            let mut integral = Integral::default();
            for growth in &growths {
                integral.grow(Side::BOTH, Q::from_bits(*growth));
            }
            let sum = growths.iter().sum();
            prop_assert_eq!(integral.at(Side::BOTH), Q::from_bits(sum));
        }

        #[test]
        fn any_growth_leaves_it_bounded_and_in_order(
            steps in prop::collection::vec((any::<i64>(), any::<i64>()), 0..64),
        ) {
            let mut integral = Integral::default();
            for (torque, growth) in steps {
                integral.grow(Side::of(Q::from_bits(torque)), Q::from_bits(growth));
                prop_assert!(integral.extension <= integral.flexion);
                prop_assert!(integral.extension >= -MOST && integral.flexion <= MOST);
                let between = integral.extension..=integral.flexion;
                let at = integral.at(Side::of(Q::from_bits(torque)));
                prop_assert!(between.contains(&saturated(at.to_bits())));
            }
        }
    }
}
