//! Steady state: computes the mean force to which a lasting train settles, without simulating the
//! train.

use super::calcium_force::CalciumForce;
use crate::arithmetic::division::quotient;
use crate::arithmetic::exponential::{decay_fraction, exp_neg, exp2_neg, lag, ln_neg, mul_high};
use crate::arithmetic::reciprocal::Reciprocal;

/// Constant log2 e, Q31.
const LOG2_E: u64 = 3_098_164_009;

/// Maximum number of the model's steps per period. A period that would take more is integrated in
/// [`STEPS_LONG`] steps, because the session must compute a table between two check-ins with the
/// watchdog.
pub(super) const STEPS_MAX: u32 = 50;

/// Number of steps of a period that would take more than [`STEPS_MAX`].
pub(super) const STEPS_LONG: u32 = 28;

/// Duration, in time constants τc, for which calcium is followed once it has fallen to K. At the
/// end it is 0.1 % of K, and the remaining force decays with τ1.
const FADING: u64 = 7;

/// Averages of a muscle in a lasting train at [`super::Gain::FULL`] over one period.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Steady {
    /// Mean force as a share of full scale A·(τ1 + τ2), Q32.
    pub(super) force: u32,
    /// Mean x, Q32. Force divided by x is the time constant, over τ1 + τ2, with which force follows
    /// a change of gain.
    pub(super) activation: u32,
}

impl CalciumForce {
    /// Computes the steady state of a train with a pulse every `period_us`, 5000…2,000,000.
    ///
    /// C is periodic in closed form: 1/(1 − e^(−T/τc)) just after a pulse. F is linear in its
    /// initial value, so one period that begins at F = 0, and the decay over the period, give the
    /// periodic F. Steps are those of the model, of at most `step_us`, which is 1000 or, for τ1 of
    /// 4 ms or more, 2000; a period of more than 50 steps is [long](Self::steady_long_period).
    ///
    /// The error is 0.1 % for Lee's subjects at 20–60 Hz (`firmware/tests/muscle_inverse.rs`).
    pub(super) fn steady(&self, period_us: u32, step_us: u32) -> Steady {
        let steps = period_us.div_ceil(step_us.max(1)).max(1);
        if steps > STEPS_MAX {
            return self.steady_long_period(period_us);
        }
        self.steady_in_steps(period_us, steps)
    }

    /// Computes [`Self::steady`] in the given number of steps, 2000 at most.
    #[inline(never)]
    fn steady_in_steps(&self, period_us: u32, steps: u32) -> Steady {
        #[cfg(test)]
        counting::add(steps, 0);
        // In 2^-8 µs: at most 2^20.
        let step = u64::from((period_us << 8) / steps);
        // 2^20 · 2^31 in 2^-50; the shifted result is a fraction in Q32.
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
            sum += u64::from(interpolate(force, target, late));
            kept_sum += u64::from(interpolate(kept, 0, late));
            activation += u64::from(x);
            force = interpolate(force, target, share);
            kept = interpolate(kept, 0, share);
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

    /// Computes [`Self::steady`] for a period of 50 ms or more in a fixed number of steps, for any
    /// period and any time constants.
    ///
    /// The steps reach to the time at which almost no calcium is left, after which F decays in
    /// closed form. They are long compared with τ, so each takes its full exponential. The mean of
    /// x has a closed form too, so the error of the steps' midpoints is corrected in F, which is
    /// linear in the mean:
    ///
    /// ```text
    /// mean of x over T    x̄ = τc/T · ln((K + C⁺)/(K + C⁻))
    /// ```
    #[inline(never)]
    fn steady_long_period(&self, period_us: u32) -> Steady {
        #[cfg(test)]
        counting::add(0, STEPS_LONG);
        const ONE: u32 = 1 << 31;
        let mut calcium = self.calcium_after_pulse(period_us); // 1 or more
        let high = self.k.wrapping_add(calcium); // below 32
        let low = high.wrapping_sub(1 << 27);
        let over = |n: u32| quotient(u64::from(n) << 31, high).unwrap_or(ONE);
        // Times in τc, Q32: T is at most 400, the window 15.
        let period = (u64::from(period_us) * u64::from(self.half_decay_per_us)) >> 9;
        let window = period.min(ln_neg(over(self.k)) + (FADING << 32));
        // In Q23 T fits 32 bits.
        let per_period = |n: u64| quotient(n << 23, (period >> 9) as u32).unwrap_or(u32::MAX);
        let exact = per_period(ln_neg(over(low))).max(1);

        // τc/τm in 2^-26: at most 34.
        let scale = quotient(u64::from(self.length_per_us) << 25, self.half_decay_per_us);
        let scale = u64::from(scale.unwrap_or(u32::MAX));
        let step = window / u64::from(STEPS_LONG); // below 0.55
        // h/τm in 2^-27: 55 ms over 3 ms at most.
        let length = ((step * scale) >> 31) as u32;
        let to_middle = !decay_fraction((step >> 1) as u32);
        let to_end = mul_high(to_middle, to_middle);
        let (mut force, mut kept) = (0u32, u32::MAX);
        // At most 28 · 2^32 each.
        let (mut sum, mut kept_sum, mut activation) = (0u64, 0u64, 0u64);
        for _ in 0..STEPS_LONG {
            let (x, tau) = self.activation(mul_high(calcium, to_middle));
            // h/τ in 2^-27: 0.001, as τ is 1.2 s at most, to 28.
            let z = Reciprocal::of(tau).times(length).max(1);
            let share = !(exp_neg(u64::from(z) << 5) << 1);
            let late = !Reciprocal::of(z).times(share >> 5);
            let target = mul_high(x, tau);
            sum += u64::from(interpolate(force, target, late));
            kept_sum += u64::from(interpolate(kept, 0, late));
            activation += u64::from(x);
            force = interpolate(force, target, share);
            kept = interpolate(kept, 0, share);
            calcium = mul_high(calcium, to_end);
        }
        let mean = |sum: u64| (sum / u64::from(STEPS_LONG)) as u32; // of values below 2^32

        // The rest of the period over τm, Q32: at most 667.
        let rest = (((period - window) >> 12) * scale) >> 14;
        let left = self.tau1_decay(rest);
        // τ1 · (1 − left) over T, Q32: at most rest/T. T/τm in 2^-22 is at most 667.
        let fallen = (u64::from(self.tau_floor) * u64::from(ONE.saturating_sub(left))) >> 31;
        let full_period = ((u64::from(period_us) * u64::from(self.length_per_us)) >> 20) as u32;
        let tail = quotient(fallen << 22, full_period).unwrap_or(u32::MAX);
        let held = per_period(window);
        let over_period = |in_window: u64, at_end: u32| {
            mul_high(mean(in_window), held).saturating_add(mul_high(at_end, tail))
        };
        let at_end = |value: u32| ((u64::from(value) * u64::from(left)) >> 31) as u32;
        let start = quotient(u64::from(at_end(force)) << 32, !at_end(kept)).unwrap_or(u32::MAX);
        let lasting = mul_high(start, over_period(kept_sum, kept));
        let force = over_period(sum, force).saturating_add(lasting);
        let found = mul_high(mean(activation), held).max(1);
        Steady {
            force: quotient(u64::from(force) * u64::from(exact), found).unwrap_or(u32::MAX),
            activation: exact,
        }
    }

    /// Returns the factor, Q31, by which a force that decays with τ1 falls during `rest`, a time
    /// over τm in Q32.
    fn tau1_decay(&self, rest: u64) -> u32 {
        if rest >> 5 >= u64::from(self.tau_floor) {
            return 0; // e^-32
        }
        // 2^37 · 2^26 fits; the quotient is below 32 · 2^26.
        let taus = quotient(rest << 26, self.tau_floor).unwrap_or(u32::MAX);
        exp_neg(u64::from(taus) << 6)
    }

    /// Returns C just after a pulse of a lasting train, U5F27.
    fn calcium_after_pulse(&self, period_us: u32) -> u32 {
        // T/τc in Q32: 2^21 · 2^30 >> 9. From 22 on, C equals that of a single pulse to the last
        // bit.
        let z = (u64::from(period_us) * u64::from(self.half_decay_per_us)) >> 9;
        let z = z.min(22 << 32);
        // Q24 · Q31 < 2^29 · 2^32.
        let left = exp2_neg(((z >> 8) * LOG2_E) >> 23);
        // T/τc is 0.05 or more, so 1 − left is 0.048 or more and C at most 20.5.
        quotient(1 << 58, (1u32 << 31).saturating_sub(left)).unwrap_or(u32::MAX)
    }
}

/// Interpolates from `from` to `to` by the share `share` (Q32).
fn interpolate(from: u32, to: u32, share: u32) -> u32 {
    if to >= from {
        from.wrapping_add(mul_high(to.wrapping_sub(from), share))
    } else {
        from.wrapping_sub(mul_high(from.wrapping_sub(to), share))
    }
}

/// Numbers of steps taken by this thread: short and long ones.
#[cfg(test)]
pub(super) mod counting {
    use core::cell::Cell;
    std::thread_local!(static STEPS: Cell<(u32, u32)> = const { Cell::new((0, 0)) });

    pub(super) fn add(short: u32, long: u32) {
        STEPS.with(|steps| {
            let (was_short, was_long) = steps.get();
            steps.set((was_short + short, was_long + long));
        });
    }

    /// Returns the numbers of steps since the last call.
    pub(in crate::muscle) fn take() -> (u32, u32) {
        STEPS.with(Cell::take)
    }
}

#[cfg(test)]
mod tests {
    use super::super::CalciumForceSpec;
    use super::*;
    use proptest::prelude::*;

    prop_compose! {
        fn any_muscle()(
            k in 0.0..=1.0,
            tau_c_us in prop_oneof![Just(5_000u32), 5_000u32..=100_000, Just(100_000)],
            tau1_us in prop_oneof![Just(2_000u32), 2_000u32..=20_000, 2_000u32..=200_000],
            tau2_us in prop_oneof![Just(1_000u32), 1_000u32..=1_000_000, Just(1_000_000)],
        ) -> CalciumForceSpec {
            let k_micro = (2_000.0 * 2_500f64.powf(k)) as u32;
            // The shortest τ1 that K and τ2 allow.
            let tau1_us = tau1_us.max((20 * tau2_us).div_ceil(k_micro - 20)).max(2_200);
            CalciumForceSpec { a_mn_per_s: 100_000, k_micro, tau_c_us, tau1_us, tau2_us }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3_000))]

        /// Compares a long period in its few steps with the same period in as many steps as it
        /// needs. The largest error of 3,000 draws was 0.8 %, for a muscle with τ2 of a second and
        /// τc of 5 ms; one draw in a hundred has an error above 0.3 %.
        #[test]
        fn a_long_period_settles_as_in_many_steps(
            spec in any_muscle(),
            period_us in prop_oneof![50_000u32..=200_000, 50_000u32..=2_000_000],
        ) {
            let muscle = CalciumForce::new(spec).unwrap();
            let long = muscle.steady_long_period(period_us);
            let many = muscle.steady_in_steps(period_us, period_us / 250);
            let off = f64::from(long.force) / f64::from(many.force) - 1.0;
            // Rounding error of both results.
            let grain = 40.0 / f64::from(many.force);
            prop_assert!(off.abs() < 1.5e-2 + grain, "{off:e} {grain:e}");
            let off = f64::from(long.activation) / f64::from(many.activation) - 1.0;
            prop_assert!(off.abs() < 1e-2, "activation {off:e}");
        }
    }
}
