//! Force control corrected by the force that the muscle's model predicts.
//!
//! The inverse knows the rested muscle. What a channel's own pulses would make of
//! that one is *expected*: each drives it to its mean force, times what fatigue has
//! left of A, and it follows with the muscle's time constant. From one pulse to the
//! next, where ripple is whole and cancels,
//!
//! ```text
//! share ← share + g·(predicted − share·expected)/max(expected, most/8)
//! wanted of the inverse ← wanted/(A/A₀ · share)
//! ```
//!
//! with means over that time T, and g = k·T, at most 1/4, k = 2/s. Share is what K
//! and τ1 as they tire leave of the expected force, and what the inverse's table errs.
//!
//! Stability: predicted and expected come of the same pulses, those put out. So the
//! muscle's lag lies outside of the estimate, a mean of ratios with weights of at most
//! 1/4, which can neither ring nor wind up; where pulses are limited, it is the muscle's
//! share all the same. It acts back on itself through the pulse rate alone. Without
//! pulses nothing is learned: share stays, and expected begins at what is predicted.

use crate::arithmetic::division::quotient;
use crate::muscle::{Drive, Gain, Inverse};
use crate::units::Force;
use fixed::types::{I16F16, U1F31};

/// 1 in Q28.
const ONE: u32 = 1 << 28;
/// Bounds of share, Q28.
const LEAST: u32 = ONE / 8;
const MOST: u32 = ONE * 8;
/// Pulses after a pause whose periods teach nothing: calcium builds up.
const SETTLING: u8 = 3;
/// 2.5 periods in µs over this are the ticks after which a pulse is no longer waited for.
const PAUSE: u32 = 400;
/// k, per millisecond, Q31.
const PER_MS: u32 = (1 << 31) / 500;
/// The largest g, Q31.
const STEP: u32 = 1 << 29;

/// What one channel's steering remembers.
#[derive(Clone, Debug)]
pub(super) struct Steering {
    /// Predicted over expected force, Q28.
    share: u32,
    /// 1/(A/A₀ · share), Q16; saturates.
    correction: u32,
    /// The pulses ordered last.
    ordered: Option<Drive>,
    /// What the last pulse drives force to, N in 2^-16, and the part of the way there
    /// in a millisecond, Q24.
    driven: u32,
    way_of_ms: u32,
    /// Expected force, N in 2^-32: below 2^46.
    expected: i64,
    /// Pulses since there were none, up to [`SETTLING`].
    pulses: u8,
    /// Ticks since the last pulse and the sums over them of predicted and expected
    /// force, N in 2^-16.
    ticks: u32,
    sums: [u64; 2],
}

impl Default for Steering {
    /// Of a muscle as the inverse knows it, without force.
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

/// More than any muscle's full scale, N in 2^-16.
const FORCE_MAX: u32 = (1 << 30) - 1;

/// A muscle's force, N in 2^-16.
fn bits(force: Force) -> u32 {
    force.get().to_bits().max(0).cast_unsigned().min(FORCE_MAX)
}

impl Steering {
    /// A millisecond passed, with a force predicted at its end.
    pub(super) fn record_prediction(&mut self, predicted: Force) {
        let predicted = bits(predicted);
        let longest = self.ordered.map_or(0, |drive| drive.period_us / PAUSE);
        if self.ticks >= longest {
            // Nothing drives the muscle.
            self.expected = i64::from(predicted) << 16;
            self.driven = 0;
            self.pulses = 0;
            self.ticks = 0;
            self.sums = [0; 2];
            return;
        }
        // Between two values in 0…2^46, by a part of the way below 1: 2^38 · 2^24.
        let way = (i64::from(self.driven) << 16).wrapping_sub(self.expected);
        let change = (way >> 8).wrapping_mul(i64::from(self.way_of_ms)) >> 16;
        self.expected = self.expected.wrapping_add(change);
        // At most 5000 times 2^30 in the sums.
        self.ticks = self.ticks.wrapping_add(1);
        let [sum, expected] = &mut self.sums;
        *sum = sum.wrapping_add(predicted.into());
        *expected = expected.wrapping_add((self.expected >> 16).cast_unsigned());
    }

    /// What is wanted of the inverse so that the muscle gives `wanted`. Saturates.
    pub(super) fn correct(&self, wanted: Force) -> Force {
        let bits = i64::from(wanted.get().to_bits());
        let bits = bits.wrapping_mul(self.correction.into()) >> 16; // below 2^63
        let bits = bits.clamp(i32::MIN.into(), i32::MAX.into());
        Force::new(I16F16::from_bits(bits as i32))
    }

    /// Pulses were ordered, or none.
    pub(super) fn record_order(&mut self, drive: &Drive) {
        self.ordered = (drive.gain != Gain::ZERO).then_some(*drive);
    }

    /// A pulse drives the muscle with `gain`; `strength` is what is left of A.
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
        // Fibres that are recruited, and strong: at most 2^30 · 2^31.
        let recruited = u64::from(bits(ordered.force)) * u64::from(gain.get().to_bits());
        let rested = quotient(recruited, ordered.gain.get().to_bits());
        let rested = u64::from(rested.unwrap_or(u32::MAX).min(FORCE_MAX));
        self.driven = ((rested * u64::from(strength.to_bits())) >> 31) as u32;
        self.way_of_ms = inverse.response_per_ms(&ordered);
    }

    /// The time since the last pulse is over.
    fn learn(&mut self, most: u32) {
        let ([predicted, expected], ticks) = (self.sums, self.ticks);
        let mean = |sum| quotient(sum, ticks);
        let (Some(predicted), Some(expected)) = (mean(predicted), mean(expected)) else {
            return; // a pulse in the same millisecond as the one before
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
        /// Whatever is predicted, wanted and put out: nothing overflows, share keeps
        /// its bounds, and a muscle that gives what is expected is left alone.
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
