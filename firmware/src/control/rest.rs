//! Gap action: reduces the feedback while the joint holds its position.
//!
//! If the reference stands still and the error is within noise and friction, feedback only carries
//! the sensor's noise into the muscles, hunts across dry friction and keeps small limit cycles
//! alive. The feedback's gain is therefore reduced inside a gap around the reference, and returns
//! in proportion outside the gap (gap action: Shinskey, Process Control Systems, on nonlinear
//! controllers for noisy measurements). Feed-forward and the stored integral stay, so the effort
//! does not jump.

use super::gain::Gain;
use super::low_pass::LowPass;
use crate::units::Angle;

/// Filtered error up to which the gain is smallest: 0.5° as bits of [`Angle`].
const NARROW: u32 = 1 << 15;
/// Filtered error from which on the gain is full: 2° as bits of [`Angle`].
const WIDE: u32 = 1 << 17;
/// Smallest gain: a sixteenth, 2^-16.
const LEAST: u32 = 1 << 12;
/// Reduction of the gain inside the gap: 15/16, 2^-16.
const LEFT_OUT: u32 = (1 << 16) - LEAST;
/// Slope of the gain outside the gap: [`LEFT_OUT`] over 1.5°.
const SLOPE: u32 = ((LEFT_OUT as u64) << 16).div_euclid((WIDE - NARROW) as u64) as u32;
/// Movement up to which the reference counts as still: 0.1° as bits of [`Angle`].
const STILL: u32 = 6_554;
/// Time for which the reference must not move further than [`STILL`] to count as still, ms.
const STILL_MS: u32 = 500;
/// Time constant of the error's filter, ms.
const FILTER_MS: u32 = 128;
/// Time constant with which the gain is reduced, ms.
const LOWER_MS: u32 = 256;

/// Gap action for one controller period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gap {
    period_ms: u32,
    filter: LowPass,
    lower: LowPass,
}

/// State of a [`Gap`]: filter, last motion of the reference, and present reduction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GapState {
    filtered: i32,
    /// Reference when it last moved, as bits of [`Angle`].
    stands_at: i32,
    /// Time since the reference last moved, ms.
    still_ms: u32,
    /// Reduction of the gain, 2^-16.
    left_out: u32,
}

impl Gap {
    /// Creates the gap action for a controller period of 1…20 ms.
    pub(super) fn new(period_ms: u8) -> Self {
        let period_ms = u32::from(period_ms.max(1));
        Self {
            period_ms,
            filter: LowPass::new(FILTER_MS, period_ms),
            lower: LowPass::new(LOWER_MS, period_ms),
        }
    }

    /// Advances by one controller period with the reference and the error, and returns the share of
    /// the feedback. The share falls slowly and returns at once.
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
            // up to `wanted`
            Some(more) => state.left_out.wrapping_add(self.lower.step_share(more)),
            None => wanted,
        };
        Gain::from_bits((1 << 16) - state.left_out) // LEFT_OUT at most
    }
}
