//! Integral term of a controller, with one integral for each muscle.
//!
//! Deviations from the wearer file (threshold, gain, fatigue) differ between the muscles. A
//! threshold that has risen by a fifth leaves a gap of half the effort's range between flexing and
//! extending. A single integral would have to cross this gap slowly at each change of direction;
//! two integrals step over it. Together they are an inverse of the dead zone (Tao & Kokotović,
//! Adaptive Control of Systems with Actuator and Sensor Nonlinearities, 1996, ch. 3) whose ends are
//! learnt.

use crate::arithmetic::fixed_point::{Q, saturated};

/// The value 1 in 2^-24.
pub(super) const ONE: i32 = 1 << Q::FRAC_NBITS;
/// Largest magnitude of each integral, 64.
const MOST: i32 = 64 << Q::FRAC_NBITS;
/// Half the width of the transition from one muscle to the other: efforts up to 1/64 of the range
/// on either side of 0, 2^-24.
const ZONE: i32 = ONE >> 6;
/// Left shift that turns [`ZONE`] into half of [`ONE`].
const STEEPNESS: u32 = 5;

/// Integrals of both muscles, effort. The flexor's is never below the extensor's. As long as every
/// growth is on [`Side::BOTH`], they act as one integral.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Integral {
    flexion: i32,
    extension: i32,
}

/// Shares of an effort that belong to the flexor and to the extensor: 0…1, 2^-24.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Side {
    flexion: i32,
    extension: i32,
}

impl Side {
    /// Both muscles in full, so that both integrals grow alike.
    pub(super) const BOTH: Self = Self {
        flexion: ONE,
        extension: ONE,
    };

    /// Returns the shares of the muscles for an effort of `torque` (−1…1) before any integral. The
    /// shares sum to 1.
    #[inline(always)]
    pub(super) fn of(torque: Q) -> Self {
        // 0…2^19, after the shift 0…2^24.
        let within = saturated(torque.to_bits()).clamp(-ZONE, ZONE);
        let flexion = within.wrapping_add(ZONE) << STEEPNESS;
        Self {
            flexion,
            extension: ONE.wrapping_sub(flexion),
        }
    }
}

impl Integral {
    /// Returns the contribution of the integrals to an effort with the shares `side`.
    #[inline(always)]
    pub(super) fn at(&self, side: Side) -> Q {
        // Both lie within 2^30, so the product is below 2^31 · 2^24 and the sum lies between the
        // two.
        let apart = i64::from(self.flexion).wrapping_sub(self.extension.into());
        let more = apart.wrapping_mul(side.flexion.into()) >> Q::FRAC_NBITS;
        Q::from_bits(more.wrapping_add(self.extension.into()))
    }

    /// Adds `growth`, effort, to the integrals, in proportion to the shares of `side`.
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
            // The two differ and stay within ±2^30, so their sum is within 2^31 - 1.
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
        // The extensor's integral must never exceed the flexor's: that would be positive feedback.
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
