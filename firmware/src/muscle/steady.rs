//! A muscle without dynamics: force is what the train's present rate would
//! hold in the mean, at once.
//!
//! The rate is one over the last interpulse interval. A train whose next pulse
//! is late by more than another interval is over: the force is gone.

use super::calcium_force::{CalciumForce, TICK_US};
use super::rhythm::{Drive, Rhythm, SLOWEST_US, share};
use crate::arithmetic::exponential::{decay_fraction, mul_high};
use crate::units::Micros;

/// Where a muscle without dynamics is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StaticState {
    pub(super) at: Micros,
    /// How long the train goes on without another pulse, µs.
    on_us: u32,
    /// Mean force of the train, Q31 of full scale.
    level: u32,
    /// Mean force of such a train at full gain, and what it holds for.
    full: u32,
    drive: Drive,
    /// What a change from another rung left, Q63 of full scale: it fades with
    /// the train's time constant of the fall.
    left_over: i64,
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
            drive: Drive::NONE,
            left_over: 0,
        };
        state.take(muscle, rhythm, gain);
        let is_train = rhythm.interval_us().is_some();
        let age_us = if is_train {
            rhythm.age_us(at)
        } else {
            u32::MAX
        };
        state.on_us = state.on_us.saturating_sub(age_us);
        if state.on_us == 0 {
            state.level = 0;
        }
        state.left_over = force.saturating_sub(state.level_bits());
        state
    }

    /// A pulse at `at`, the last of `rhythm`, with a gain in Q31.
    pub(super) fn pulse(
        &mut self,
        muscle: &CalciumForce,
        rhythm: &mut Rhythm,
        at: Micros,
        gain: u32,
    ) {
        self.advance(rhythm, at);
        self.take(muscle, rhythm, gain);
    }

    /// A pulse of `rhythm` now.
    fn take(&mut self, muscle: &CalciumForce, rhythm: &Rhythm, gain: u32) {
        let interval_us = rhythm.interval_us().unwrap_or(SLOWEST_US);
        if self.drive.interval_us != interval_us {
            self.drive = Drive::of(muscle, interval_us);
            self.full = self.drive.mean(muscle);
        }
        self.on_us = interval_us.saturating_mul(2);
        // Q31·Q31 with gain ≤ 1: within Q31.
        self.level = mul_high(self.full, gain) << 1;
    }

    /// Lets time pass until `to`; an earlier time changes nothing.
    #[inline(always)]
    pub(super) fn advance(&mut self, rhythm: &mut Rhythm, to: Micros) {
        let elapsed_us = to.elapsed_since(self.at);
        if elapsed_us == 0 {
            return;
        }
        self.at = to;
        self.on_us = self.on_us.saturating_sub(elapsed_us);
        if self.on_us == 0 {
            self.level = 0;
            rhythm.pass(to);
        }
        if self.left_over != 0 {
            self.settle(elapsed_us);
        }
    }

    #[inline(never)]
    fn settle(&mut self, elapsed_us: u32) {
        let mut left_us = elapsed_us;
        let tick = decay_fraction(self.drive.fall);
        while left_us > 0 && self.left_over != 0 {
            let step_us = left_us.min(TICK_US);
            let part = if step_us == TICK_US {
                tick
            } else {
                share(self.drive.fall, step_us)
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
