//! Where a calcium–force muscle is, in the formats of [`super::calcium_force`].

use fixed::types::U5F27;

use crate::units::Micros;

/// C, in pulses, where the fixed point ends: there it saturates.
pub(super) const CALCIUM_END: u32 = 24;

/// C of one pulse, U5F59.
const ONE_PULSE: u64 = 1 << 59;

/// Where C saturates, U5F59. The slowest τc allowed (100 ms) reaches 20.5 at
/// the fastest train of single pulses allowed (200 Hz), and
/// [`super::CalciumForceSpec::check_train`] refuses the bursts that pass it; with K ≤ 5 the
/// sum K + C stays below 32.
const CALCIUM_MAX: u64 = (CALCIUM_END as u64) << 59;

/// The upper word of that.
pub(super) const CALCIUM_MAX_UPPER: u32 = CALCIUM_END << 27;

/// Where one muscle is. 40 bytes, freely copied.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CalciumForceState {
    /// C, U5F59, at most `CALCIUM_MAX` and a lower word.
    pub(super) calcium: u64,
    /// F over full scale, Q63: 0 ≤ force < 2^63.
    pub(super) force: i64,
    /// Gain of the last pulse that reached the muscle, Q31.
    pub(super) gain: u32,
    /// The time all this holds for.
    pub(super) at: Micros,
    /// How far ahead of `at` a pulse is known of: below 1000 µs, 0 if none.
    pub(super) waiting_us: u32,
    /// That pulse's gain, Q31.
    pub(super) next_gain: u32,
}

impl CalciumForceState {
    /// A muscle without calcium or force, at time `at`.
    #[must_use]
    pub const fn at_rest(at: Micros) -> Self {
        Self {
            calcium: 0,
            force: 0,
            gain: 0,
            at,
            waiting_us: 0,
            next_gain: 0,
        }
    }

    /// Whether nothing is left of any pulse: calcium and force exactly zero,
    /// and no pulse waits.
    #[must_use]
    pub const fn is_at_rest(&self) -> bool {
        // A step that leaves an upper word 0 clears the lower one, force's
        // once there is no calcium.
        (self.calcium >> 32) as u32 | (self.force >> 32) as u32 | self.waiting_us == 0
    }

    /// A pulse's effect at once.
    pub(super) fn take(&mut self, gain: u32) {
        self.gain = gain;
        // 25 · 2^59 < 2^64: C never starts above CALCIUM_MAX.
        self.calcium = self.calcium.wrapping_add(ONE_PULSE).min(CALCIUM_MAX);
    }

    /// C of eq. (2) at [`Self::at`], in pulses: 0…25, rounded down to 2^-27.
    #[must_use]
    pub const fn calcium(&self) -> U5F27 {
        U5F27::from_bits((self.calcium >> 32) as u32)
    }

    /// The time the state holds for.
    #[must_use]
    pub const fn at(&self) -> Micros {
        self.at
    }
}
