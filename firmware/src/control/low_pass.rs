//! A first-order low-pass of angles, in shifts.

use crate::units::Angle;

/// Follows an angle with about this time constant; keeps all but 2^-shift of what it
/// was.
#[derive(Clone, Copy, Debug)]
pub(super) struct LowPass {
    shift: u32,
}

impl LowPass {
    /// For a law's period of 1…20 ms: the power of two of periods at or below
    /// `time_ms`, two at least.
    pub(super) fn new(time_ms: u32, period_ms: u32) -> Self {
        let periods = time_ms.checked_div(period_ms).unwrap_or(time_ms);
        Self {
            shift: periods.max(2).ilog2(),
        }
    }

    /// One law period further: the filtered angle in bits of [`Angle`].
    #[inline(always)]
    pub(super) fn step(&self, filtered: &mut i32, x: Angle) -> i32 {
        let ahead = x.get().to_bits().saturating_sub(*filtered);
        *filtered = filtered.wrapping_add(ahead >> self.shift); // between the two
        *filtered
    }

    /// What of a way of `left` is made in one period.
    #[inline(always)]
    pub(super) const fn step_share(&self, left: u32) -> u32 {
        left >> self.shift
    }
}
