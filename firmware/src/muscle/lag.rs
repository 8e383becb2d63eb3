//! A muscle as a first-order lag: while a pulse holds activation, force rises
//! (or falls) towards what that activation carries; after that it falls.
//!
//! Gain by frequency and both time constants are [`Drive`]'s, in closed form
//! from the calcium–force parameters and the last interpulse interval.

use super::calcium_force::{CalciumForce, TICK_US};
use super::rhythm::{Drive, Rhythm, SLOWEST_US, share};
use crate::arithmetic::exponential::{decay_fraction, mul_high};
use crate::units::Micros;

/// Where a lagging muscle is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct LagState {
    /// F over full scale, Q63: 0 ≤ force < 2^63.
    pub(super) force: i64,
    pub(super) at: Micros,
    /// How long activation still holds, µs.
    on_us: u32,
    /// Target of the pulse that holds it, Q31 of full scale.
    target: u32,
    drive: Drive,
    rise_share: u32,
    fall_share: u32,
}

impl LagState {
    /// A muscle with a force, in the middle of a train or of none.
    pub(super) fn at(
        at: Micros,
        force: i64,
        muscle: &CalciumForce,
        rhythm: &Rhythm,
        gain: u32,
    ) -> Self {
        let mut state = Self {
            force,
            at,
            on_us: 0,
            target: 0,
            drive: Drive::NONE,
            rise_share: 0,
            fall_share: 0,
        };
        // With no train the fall is a lone pulse's.
        let interval_us = rhythm.interval_us().unwrap_or(SLOWEST_US);
        state.drive_by(muscle, interval_us);
        if rhythm.interval_us().is_some() {
            state.on_us = state.drive.left_us(rhythm.age_us(at));
            state.target = mul_high(state.drive.target, gain) << 1;
        }
        state
    }

    fn drive_by(&mut self, muscle: &CalciumForce, interval_us: u32) {
        if self.drive.interval_us != interval_us {
            self.drive = Drive::of(muscle, interval_us);
            self.rise_share = decay_fraction(self.drive.rise);
            self.fall_share = decay_fraction(self.drive.fall);
        }
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
        self.drive_by(muscle, rhythm.interval_us().unwrap_or(SLOWEST_US));
        self.on_us = self.drive.on_us;
        // Q31·Q31 with gain ≤ 1: within Q31.
        self.target = mul_high(self.drive.target, gain) << 1;
    }

    /// Lets time pass until `to`; an earlier time changes nothing.
    #[inline(always)]
    pub(super) fn advance(&mut self, rhythm: &mut Rhythm, to: Micros) {
        if (to - self.at).us() == TICK_US.cast_signed() && self.on_us >= TICK_US {
            self.at = to;
            self.on_us = self.on_us.wrapping_sub(TICK_US);
            self.approach(self.target, self.rise_share);
        } else {
            self.pass(rhythm, to);
        }
    }

    /// [`Self::advance`] by any time: what is held, then the fall.
    #[inline(never)]
    fn pass(&mut self, rhythm: &mut Rhythm, to: Micros) {
        let elapsed_us = to.elapsed_since(self.at);
        if elapsed_us == 0 {
            return;
        }
        self.at = to;
        rhythm.pass(to);
        if elapsed_us == TICK_US && self.on_us == 0 {
            self.approach(0, self.fall_share);
            return;
        }
        let held_us = elapsed_us.min(self.on_us);
        self.on_us = self.on_us.wrapping_sub(held_us);
        self.steps(held_us, self.target, self.rise_share, self.drive.rise);
        let rest_us = elapsed_us.wrapping_sub(held_us);
        self.steps(rest_us, 0, self.fall_share, self.drive.fall);
    }

    /// At most 2,000 steps while held; some 7,000 until force is gone.
    fn steps(&mut self, us: u32, target: u32, tick: u32, rate: u32) {
        let mut left_us = us;
        while left_us >= TICK_US && (self.force != 0 || target != 0) {
            self.approach(target, tick);
            left_us = left_us.wrapping_sub(TICK_US);
        }
        // Below a tick, or nothing is there to change.
        self.approach(target, share(rate, left_us.min(TICK_US)));
    }

    /// F ← F + share·(target − F), `share` in Q32 and below half.
    #[inline(always)]
    fn approach(&mut self, target: u32, share: u32) {
        // Both below 2^31: F moves part of the way between them.
        let way = (target as i32).wrapping_sub((self.force >> 32) as i32);
        let change = i64::from(way).wrapping_mul(i64::from(share as i32));
        self.force = self.force.wrapping_add(change);
        if target == 0 && self.force >> 32 == 0 {
            self.force = 0; // below 2^-31 of full scale
        }
    }
}
