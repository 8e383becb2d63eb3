//! First-order low-pass filter of angles, implemented with shifts.

use crate::units::Angle;

/// A filter with approximately the given time constant. Each step removes 2^-shift of the remaining
/// difference.
#[derive(Clone, Copy, Debug)]
pub(super) struct LowPass {
    shift: u32,
}

impl LowPass {
    /// Creates a filter for a controller period of 1…20 ms. The time constant in periods is the
    /// largest power of two that does not exceed `time_ms`, at least two.
    pub(super) fn new(time_ms: u32, period_ms: u32) -> Self {
        let periods = time_ms.checked_div(period_ms).unwrap_or(time_ms);
        Self {
            shift: periods.max(2).ilog2(),
        }
    }

    /// Advances by one controller period, and returns the filtered angle as bits of [`Angle`].
    #[inline(always)]
    pub(super) fn step(&self, filtered: &mut i32, x: Angle) -> i32 {
        let ahead = x.get().to_bits().saturating_sub(*filtered);
        *filtered = filtered.wrapping_add(ahead >> self.shift); // between the two
        *filtered
    }

    /// Returns the part of a remaining distance `left` that one period covers.
    #[inline(always)]
    pub(super) const fn step_share(&self, left: u32) -> u32 {
        left >> self.shift
    }
}
