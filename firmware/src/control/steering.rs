//! Correction of force control by the force that the muscle model predicts.
//!
//! The inverse models the rested muscle. The *expected* force is the response of that muscle to the
//! channel's own pulses: each pulse drives the muscle to the pulse's mean force, times the share of
//! A that fatigue has left, with the muscle's time constant. From one pulse to the next, a whole
//! cycle of ripple cancels in the means:
//!
//! ```text
//! share ← share + g·(predicted − share·expected)/max(expected, most/8)
//! force requested from the inverse ← force/(A/A₀ · share)
//! ```
//!
//! with means over that time T, and g = k·T, at most 1/4, k = 2/s. `share` is the factor by which
//! the changes of K and τ1 with fatigue, and the errors of the inverse's table, change the expected
//! force.
//!
//! Stability: predicted and expected force follow from the same pulses, those that were emitted.
//! The muscle's lag is therefore outside the estimate, a mean of ratios with weights of at most
//! 1/4, which can neither oscillate nor wind up. Where pulses are limited, the estimate is still
//! the muscle's share. The only feedback is through the pulse rate. Without pulses nothing is
//! learnt: the share stays, and the expected force begins at the predicted one.

use crate::arithmetic::division::quotient;
use crate::muscle::{Drive, Gain, Inverse};
use crate::units::Force;
use fixed::types::{I16F16, U1F31};

/// The value 1 in Q28.
const ONE: u32 = 1 << 28;
/// Smallest share, Q28.
const LEAST: u32 = ONE / 8;
/// Largest share, Q28.
const MOST: u32 = ONE * 8;
/// Number of pulses after a pause whose periods are not used for learning, because calcium builds
/// up.
const SETTLING: u8 = 3;
/// Divisor that turns a period in µs into 2.5 periods in ticks. If no pulse comes for so long,
/// nothing drives the muscle any more.
const PAUSE: u32 = 400;
/// Learning rate k per millisecond, Q31.
const PER_MS: u32 = (1 << 31) / 500;
/// Largest learning step g, Q31.
const STEP: u32 = 1 << 29;

/// State of one channel's correction.
#[derive(Clone, Debug)]
pub(super) struct Steering {
    /// Ratio of predicted to expected force, Q28.
    share: u32,
    /// Correction 1/(A/A₀ · share), Q16; saturates.
    correction: u32,
    /// Pulses that the controller asked for last; `None` if it asked for none.
    ordered: Option<Drive>,
    /// Force to which the last pulse drives the muscle, N in 2^-16.
    driven: u32,
    /// Share of the distance to `driven` that the force covers in a millisecond, Q24.
    way_of_ms: u32,
    /// Expected force, N in 2^-32: below 2^46.
    expected: i64,
    /// Number of pulses since the last pause, up to [`SETTLING`].
    pulses: u8,
    /// Number of ticks since the last pulse.
    ticks: u32,
    /// Sums of the predicted and of the expected force over these ticks, N in 2^-16.
    sums: [u64; 2],
}

impl Default for Steering {
    /// Returns the state of a muscle that the inverse models exactly, without force.
    fn default() -> Self {
        Self {
            share: ONE,
            correction: 1 << 16,
            ordered: None,
            driven: 0,
            way_of_ms: 0,
            expected: 0,
            pulses: 0,
            ticks: 0,
            sums: [0; 2],
        }
    }
}

/// Force above any muscle's full scale, N in 2^-16.
const FORCE_MAX: u32 = (1 << 30) - 1;

/// Converts a muscle's force to N in 2^-16, limited to 0…[`FORCE_MAX`].
fn bits(force: Force) -> u32 {
    force.get().to_bits().max(0).cast_unsigned().min(FORCE_MAX)
}

impl Steering {
    /// Advances by a millisecond, with the force predicted at its end.
    pub(super) fn record_prediction(&mut self, predicted: Force) {
        let predicted = bits(predicted);
        let longest = self.ordered.map_or(0, |drive| drive.period_us / PAUSE);
        if self.ticks >= longest {
            // No pulses drive the muscle.
            self.expected = i64::from(predicted) << 16;
            self.driven = 0;
            self.pulses = 0;
            self.ticks = 0;
            self.sums = [0; 2];
            return;
        }
        // The change is between two values in 0…2^46, times a share below 1: 2^38 · 2^24.
        let way = (i64::from(self.driven) << 16).wrapping_sub(self.expected);
        let change = (way >> 8).wrapping_mul(i64::from(self.way_of_ms)) >> 16;
        self.expected = self.expected.wrapping_add(change);
        // The sums are at most 5000 times 2^30.
        self.ticks = self.ticks.wrapping_add(1);
        let [sum, expected] = &mut self.sums;
        *sum = sum.wrapping_add(predicted.into());
        *expected = expected.wrapping_add((self.expected >> 16).cast_unsigned());
    }

    /// Returns the force to request from the inverse so that the muscle produces `wanted`.
    /// Saturates.
    pub(super) fn correct(&self, wanted: Force) -> Force {
        let bits = i64::from(wanted.get().to_bits());
        let bits = bits.wrapping_mul(self.correction.into()) >> 16; // below 2^63
        let bits = bits.clamp(i32::MIN.into(), i32::MAX.into());
        Force::new(I16F16::from_bits(bits as i32))
    }

    /// Records the pulses that the controller asks for from now on, or that it asks for none.
    pub(super) fn record_order(&mut self, drive: &Drive) {
        self.ordered = (drive.gain != Gain::ZERO).then_some(*drive);
    }

    /// Records a pulse that drives the muscle with `gain`; `strength` is the share of A that
    /// fatigue has left.
    pub(super) fn record_pulse(&mut self, gain: Gain, strength: U1F31, inverse: &Inverse) {
        let Some(ordered) = self.ordered.filter(|_| gain != Gain::ZERO) else {
            return;
        };
        if self.pulses > SETTLING {
            self.learn(bits(inverse.force_range().1));
        }
        self.pulses = self.pulses.saturating_add(1);
        (self.ticks, self.sums) = (0, [0; 2]);
        self.correction = self.inverse_strength(strength);
        // The product of the recruited fibres and their strength is at most 2^30 · 2^31.
        let recruited = u64::from(bits(ordered.force)) * u64::from(gain.get().to_bits());
        let rested = quotient(recruited, ordered.gain.get().to_bits());
        let rested = u64::from(rested.unwrap_or(u32::MAX).min(FORCE_MAX));
        self.driven = ((rested * u64::from(strength.to_bits())) >> 31) as u32;
        self.way_of_ms = inverse.response_per_ms(&ordered);
    }

    /// Updates the share with the means since the last pulse; `most` is the largest force of the
    /// inverse, N in 2^-16.
    fn learn(&mut self, most: u32) {
        let ([predicted, expected], ticks) = (self.sums, self.ticks);
        let mean = |sum| quotient(sum, ticks);
        let (Some(predicted), Some(expected)) = (mean(predicted), mean(expected)) else {
            return; // a pulse in the same millisecond as the previous one
        };
        let ours = (u64::from(self.share) * u64::from(expected)) >> 28; // below 2^33
        let off = ours.abs_diff(predicted.into());
        // Q28, at most 8.
        let off = quotient(off << 28, expected.max(most >> 3).max(1));
        let off = u64::from(off.unwrap_or(MOST).min(MOST));
        let step = ticks.saturating_mul(PER_MS).min(STEP);
        let change = ((off * u64::from(step)) >> 31) as u32;
        self.share = if ours > u64::from(predicted) {
            self.share.saturating_sub(change)
        } else {
            self.share.saturating_add(change)
        }
        .clamp(LEAST, MOST);
    }

    fn inverse_strength(&self, strength: U1F31) -> u32 {
        let left = (u64::from(self.share) * u64::from(strength.to_bits())) >> 31;
        quotient(1 << 44, left as u32).unwrap_or(u32::MAX) // left is below 2^32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::muscle::{CalciumForceSpec, Recruitment, RecruitmentSpec};
    use crate::units::Amplitude;
    use proptest::prelude::*;

    proptest! {
        /// For all predicted, requested and emitted forces, nothing overflows, the share keeps its
        /// bounds, and a muscle that produces the expected force is not corrected.
        #[test]
        fn nothing_leads_it_astray(
            a_mn_per_s in 100u32..=10_000_000,
            tau2_us in 1_000u32..=1_000_000,
            ticks in prop::collection::vec((any::<i32>(), any::<i32>(), any::<u32>(), 0u32..4), 1..400),
        ) {
            let recruitment = Recruitment::new(RecruitmentSpec {
                motor_threshold: Amplitude::new(10_000),
                limit: Amplitude::new(20_000),
                reference: Amplitude::new(20_000),
                slope_micro: 300_000,
            }).unwrap();
            let spec = CalciumForceSpec {
                a_mn_per_s, k_micro: 200_000, tau_c_us: 20_000, tau1_us: 20_000, tau2_us,
            };
            let inverse = Inverse::new(spec, &recruitment, 50_000, 5_000, 2_000_000).unwrap();
            let mut steering = Steering::default();
            for (predicted, wanted, other, kind) in ticks {
                steering.record_prediction(Force::new(I16F16::from_bits(predicted)));
                let wanted = steering.correct(Force::new(I16F16::from_bits(wanted)));
                steering.record_order(&inverse.drive(&recruitment, wanted));
                if kind == 0 {
                    let part = U1F31::from_bits(other & (u32::MAX >> 1));
                    steering.record_pulse(Gain::new(part), part, &inverse);
                }
                prop_assert!((LEAST..=MOST).contains(&steering.share));
            }
        }
    }
}
