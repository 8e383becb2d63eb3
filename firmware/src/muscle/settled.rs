//! The force that a lasting train settles to, without waiting for it.

use super::calcium_force::CalciumForce;
use super::exponential::{decay_fraction, exp2_neg, lag, mul_high};
use super::reciprocal::Reciprocal;
use crate::division::quotient;

/// log2 e, Q31.
const LOG2_E: u64 = 3_098_164_009;

/// A muscle in a lasting train at [`super::Gain::FULL`], on the average of a
/// period.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Steady {
    /// Mean force over full scale A·(τ1 + τ2), Q32.
    pub(super) force: u32,
    /// Mean x, Q32. Force over x is the time constant, over τ1 + τ2, with which
    /// force follows a change of gain.
    pub(super) activation: u32,
}

impl CalciumForce {
    /// Where a train with a pulse every `period_us`, 5000…2,000,000, settles.
    ///
    /// C is periodic in closed form: 1/(1 − e^(−T/τc)) just after a pulse. F is
    /// linear in its start, so one period begun at F = 0 and the decay over it
    /// give the F that returns to itself. Steps are those of the model,
    /// of `step_us` at most, which is 1000 or, for τ1 of 4 ms or more, 2000; for
    /// τ1 of 8 ms and τc of 10 ms or more, it may be 4000.
    ///
    /// 0.1 % of truth for Lee's subjects at 20–60 Hz
    /// (`firmware/tests/muscle_inverse.rs`).
    pub(super) fn steady(&self, period_us: u32, step_us: u32) -> Steady {
        let steps = period_us.div_ceil(step_us.max(1)).max(1); // 2000 at most
        // In 2^-8 µs: at most 2^20.
        let step = u64::from((period_us << 8) / steps);
        // 2^20 · 2^31 in 2^-50; what is left of it is a fraction in Q32.
        let length = ((step * u64::from(self.length_per_us)) >> 18) as u32;
        let half = ((step * u64::from(self.half_decay_per_us)) >> 18) as u32;
        let to_middle = !decay_fraction(half); // h/2τc is at most 0.2
        let to_end = mul_high(to_middle, to_middle);

        let mut calcium = self.calcium_after_pulse(period_us);
        let (mut force, mut kept) = (0u32, u32::MAX);
        // At most 2000 · 2^32 each.
        let (mut sum, mut kept_sum, mut activation) = (0u64, 0u64, 0u64);
        for _ in 0..steps {
            let (x, tau) = self.activation(mul_high(calcium, to_middle));
            let z = Reciprocal::of(tau).times(length);
            let (share, late) = (decay_fraction(z), lag(z));
            let target = mul_high(x, tau);
            sum += u64::from(toward(force, target, late));
            kept_sum += u64::from(toward(kept, 0, late));
            activation += u64::from(x);
            force = toward(force, target, share);
            kept = toward(kept, 0, share);
            calcium = mul_high(calcium, to_end);
        }
        let mean = |sum: u64| (sum / u64::from(steps)) as u32; // of values below 2^32
        // F = G + kept·F at the period's ends; below full scale, as target is.
        let start = quotient(u64::from(force) << 32, !kept).unwrap_or(u32::MAX);
        Steady {
            force: mean(sum).saturating_add(mul_high(start, mean(kept_sum))),
            activation: mean(activation).max(1),
        }
    }

    /// C just after a pulse of a lasting train, U5F27.
    fn calcium_after_pulse(&self, period_us: u32) -> u32 {
        // T/τc in Q32: 2^21 · 2^30 >> 9. From 22 on C is one pulse's to the last
        // bit.
        let z = (u64::from(period_us) * u64::from(self.half_decay_per_us)) >> 9;
        let z = z.min(22 << 32);
        // Q24 · Q31 < 2^29 · 2^32.
        let left = exp2_neg(((z >> 8) * LOG2_E) >> 23);
        // T/τc is 0.05 or more, so 1 − left is 0.048 or more and C at most 20.5.
        quotient(1 << 58, (1u32 << 31).saturating_sub(left)).unwrap_or(u32::MAX)
    }
}

/// From `from` the part `share` (Q32) of the way to `to`.
fn toward(from: u32, to: u32, share: u32) -> u32 {
    if to >= from {
        from.wrapping_add(mul_high(to.wrapping_sub(from), share))
    } else {
        from.wrapping_sub(mul_high(from.wrapping_sub(to), share))
    }
}
