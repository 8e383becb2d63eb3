//! A muscle without dynamics: force is what the train's present rate would
//! hold in the mean, at once.
//!
//! The rate is one over the last interpulse interval. A train whose next pulse
//! is late by more than another interval is over: the force is gone.

use super::calcium_force::{CalciumForce, TICK_US};
use super::exponential::{decay_fraction, mul_high};
use super::rhythm::{Drive, Rhythm, share};
use crate::units::Micros;

/// Where a muscle without dynamics is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StaticState {
    pub(super) at: Micros,
    /// How long the train goes on without another pulse, µs.
    on_us: u32,
    /// Mean force of the train, Q31 of full scale.
    level: u32,
    /// Mean force of such a train at full gain, and the interval it holds for.
    full: u32,
    interval_us: u32,
    /// What a change from another rung left, Q63 of full scale, and what part
    /// of it a millisecond takes away, as an exponent in Q32: the time constant
    /// of full activation, τ1 + τ2.
    left_over: i64,
    settling: u32,
}

impl StaticState {
    /// A muscle with a force, in the middle of a train or of none.
    pub(super) fn at(
        at: Micros,
        force: i64,
        muscle: &CalciumForce,
        rhythm: &Rhythm,
        gain: u32,
    ) -> Self {
        let mut state = Self {
            at,
            on_us: 0,
            level: 0,
            full: 0,
            interval_us: 0,
            left_over: 0,
            settling: mul_high(TICK_US << 22, muscle.length_per_us),
        };
        if let Some(interval_us) = rhythm.interval_us() {
            state.take(muscle, interval_us, gain);
            state.on_us = state.on_us.saturating_sub(rhythm.age_us(at));
            if state.on_us == 0 {
                state.level = 0;
            }
        }
        state.left_over = force.saturating_sub(state.level_bits());
        state
    }

    /// A pulse at `at`, the last of `rhythm`, with a gain in Q31.
    pub(super) fn pulse(&mut self, muscle: &CalciumForce, rhythm: &Rhythm, at: Micros, gain: u32) {
        self.advance(at);
        if let Some(interval_us) = rhythm.interval_us() {
            self.take(muscle, interval_us, gain);
        }
    }

    fn take(&mut self, muscle: &CalciumForce, interval_us: u32, gain: u32) {
        if self.interval_us != interval_us {
            self.interval_us = interval_us;
            self.full = Drive::of(muscle, interval_us).mean(muscle);
        }
        self.on_us = interval_us.saturating_mul(2);
        // Q31·Q31 with gain ≤ 1: within Q31.
        self.level = mul_high(self.full, gain) << 1;
    }

    /// Lets time pass until `to`; an earlier time changes nothing.
    #[inline]
    pub(super) fn advance(&mut self, to: Micros) {
        let elapsed_us = to.elapsed_since(self.at);
        if elapsed_us == 0 {
            return;
        }
        self.at = to;
        self.on_us = self.on_us.saturating_sub(elapsed_us);
        if self.on_us == 0 {
            self.level = 0;
        }
        if self.left_over != 0 {
            self.settle(elapsed_us);
        }
    }

    #[inline(never)]
    fn settle(&mut self, elapsed_us: u32) {
        let mut left_us = elapsed_us;
        let tick = decay_fraction(self.settling);
        while left_us > 0 && self.left_over != 0 {
            let step_us = left_us.min(TICK_US);
            let part = if step_us == TICK_US {
                tick
            } else {
                share(self.settling, step_us)
            };
            // |left_over| < 2^63 and part below half: towards zero, never past.
            let change = (self.left_over >> 32).wrapping_mul(i64::from(part));
            self.left_over = self.left_over.wrapping_sub(change);
            if (-1..=0).contains(&(self.left_over >> 32)) {
                self.left_over = 0; // below 2^-31 of full scale
            }
            left_us = left_us.wrapping_sub(step_us);
        }
    }

    const fn level_bits(&self) -> i64 {
        (self.level as i64) << 32
    }

    /// F over full scale, Q63: 0 ≤ force < 2^63.
    pub(super) fn force(&self) -> i64 {
        self.level_bits().saturating_add(self.left_over).max(0)
    }
}
