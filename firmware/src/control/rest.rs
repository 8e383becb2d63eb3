//! Rest in a hold: gap action.
//!
//! Where the target stands and the error is within what noise and friction leave,
//! feedback only carries the sensor's noise into the muscles, hunts across dry
//! friction and keeps small limit cycles alive. So its gain falls inside a gap
//! around the target, and comes back in proportion outside of it (gap action:
//! Shinskey, Process Control Systems, on nonlinear controllers for noisy
//! measurements). Feed-forward and what the integral holds stay, so nothing jumps.

use super::gain::Gain;
use super::low_pass::LowPass;
use crate::units::Angle;

/// Errors in bits of [`Angle`]: up to 0.5° the gain is least, from 2° on it is whole.
const NARROW: u32 = 1 << 15;
const WIDE: u32 = 1 << 17;
/// The least gain: a sixteenth.
const LEAST: u32 = 1 << 12;
/// What is left out of it in the gap, and the slope outside: 15/16 over 1.5°, 2^-16.
const LEFT_OUT: u32 = (1 << 16) - LEAST;
const SLOPE: u32 = ((LEFT_OUT as u64) << 16).div_euclid((WIDE - NARROW) as u64) as u32;
/// A target that moves less than 0.1° in half a second stands.
const STILL: u32 = 6_554;
const STILL_MS: u32 = 500;
/// Time constants of the error's filter and of the way to a lower gain, ms.
const FILTER_MS: u32 = 128;
const LOWER_MS: u32 = 256;

/// The gap for one law period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    period_ms: u32,
    filter: LowPass,
    lower: LowPass,
}

/// What a [`Gap`] remembers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GapState {
    filtered: i32,
    /// Where the target was when it last moved, and for how long it has not.
    stands_at: i32,
    still_ms: u32,
    /// Part of the gain that is left out, 2^-16.
    left_out: u32,
}

impl Gap {
    /// For a law's period of 1…20 ms.
    pub(super) fn new(period_ms: u8) -> Self {
        let period_ms = u32::from(period_ms.max(1));
        Self {
            period_ms,
            filter: LowPass::new(FILTER_MS, period_ms),
            lower: LowPass::new(LOWER_MS, period_ms),
        }
    }

    /// One law period further, with the law's target and error: how much of the
    /// feedback counts. It falls slowly and comes back at once.
    #[inline]
    pub(super) fn step(&self, state: &mut GapState, target: Angle, error: Angle) -> Gain {
        let target = target.get().to_bits();
        state.still_ms = state.still_ms.saturating_add(self.period_ms);
        if target.abs_diff(state.stands_at) > STILL {
            (state.stands_at, state.still_ms) = (target, 0);
        }
        let filtered = self.filter.step(&mut state.filtered, error);
        let beyond = filtered.unsigned_abs().saturating_sub(NARROW);
        let wanted = if state.still_ms < STILL_MS || beyond >= WIDE - NARROW {
            0
        } else {
            // Below 2^17 · 2^16.
            LEFT_OUT.saturating_sub(((u64::from(beyond) * u64::from(SLOPE)) >> 16) as u32)
        };
        state.left_out = match wanted.checked_sub(state.left_out) {
            Some(more) => state.left_out.wrapping_add(self.lower.step_share(more)), // up to `wanted`
            None => wanted,
        };
        Gain::from_bits((1 << 16) - state.left_out) // LEFT_OUT at most
    }
}
