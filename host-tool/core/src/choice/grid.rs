//! The scenes that were measured, and how a scene finds those around it.

/// A burst this long stands for a muscle pulsed without a pause, ms: its force
/// is scored up to the last pulse, not while it decays after it.
pub const HOLD_MS: u32 = 30_000;

/// Bursts, ms: one pulse to a hold.
pub const BURSTS_MS: [u32; 7] = [1, 10, 100, 300, 1_000, 3_000, HOLD_MS];
/// Ramps of the drive, ms.
pub const RAMPS_MS: [u32; 6] = [0, 100, 300, 1_000, 3_000, 10_000];
/// Pulse rates, mHz; the last is the highest of any train's.
pub const RATES_MHZ: [u32; 6] = [5_000, 10_000, 20_000, 40_000, 80_000, 200_000];
/// Time at work, s, measured without a pause, which tires most; 0 where fatigue
/// is of no interest.
pub const SESSIONS_S: [u32; 8] = [0, 1, 3, 10, 30, 100, 300, 600];
/// Periods of the control law, ms.
pub const LAW_PERIODS_MS: [u8; 5] = [1, 2, 5, 11, 20];
/// Periods of telemetry, ms.
pub const TELEMETRY_MS: [u16; 7] = [1, 2, 5, 10, 20, 50, 100];
/// Steps of the simulated body, ms.
pub const STEPS_MS: [u8; 4] = [1, 2, 5, 10];

/// Bursts of the scenes measured in closed loop, ms.
pub const LOOP_BURSTS_MS: [u32; 9] = [1, 20, 45, 100, 220, 500, 1_100, 3_000, HOLD_MS];
/// Their ramps, ms.
pub const LOOP_RAMPS_MS: [u32; 8] = [0, 50, 120, 300, 700, 1_700, 4_000, 10_000];
/// Their pulse rates, mHz.
pub const LOOP_RATES_MHZ: [u32; 9] = [
    5_000, 9_000, 13_000, 17_000, 22_000, 30_000, 48_000, 90_000, 200_000,
];
/// Times at work of the scenes that tire, pauses included, s.
pub const WORK_SESSIONS_S: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];
/// Their bursts, ms.
pub const WORK_BURSTS_MS: [u32; 7] = [1, 30, 100, 300, 1_000, 3_000, HOLD_MS];
/// Their ramps, ms.
pub const WORK_RAMPS_MS: [u32; 2] = [0, 2_000];
/// Their pulse rates, mHz.
pub const WORK_RATES_MHZ: [u32; 7] = [5_000, 10_000, 15_000, 21_000, 30_000, 60_000, 200_000];

/// How the control law is made discrete.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Discretization {
    /// The sign taken at the start of a period.
    Explicit,
    /// The sign solved for at its end.
    Implicit,
}

/// Places of the points of a rising axis around `value`: the one it equals,
/// the two it lies between, or the first or last if it lies beyond.
pub(super) fn enclosing(axis: &[u32], value: u32) -> core::ops::RangeInclusive<usize> {
    let not_below = axis.partition_point(|&point| point < value);
    let last = axis.len().saturating_sub(1);
    let high = not_below.min(last);
    if axis.get(high).is_some_and(|&point| point > value) {
        high.saturating_sub(1)..=high
    } else {
        high..=high
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_finds_the_points_around_it() {
        let axis = [1, 10, 100];
        for (value, around) in [
            (0, 0..=0),
            (1, 0..=0),
            (2, 0..=1),
            (10, 1..=1),
            (99, 1..=2),
            (100, 2..=2),
            (u32::MAX, 2..=2),
        ] {
            assert_eq!(enclosing(&axis, value), around, "{value}");
        }
    }
}
