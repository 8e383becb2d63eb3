//! Limit cycles of the loop: found in its error while it runs, and answered by a
//! lower gain of the feedback.
//!
//! A loop that is late and too strong swings at the frequency where law, delay and
//! plant turn by half a turn, as wide as the law's describing function says (Gelb &
//! Vander Velde, Multiple-Input Describing Functions, 1968, ch. 3); a relay on a
//! plant that mostly integrates at about four times the delay (Åström & Hägglund,
//! Automatica 20 (1984) 645). With 20 ms from pulse to pulse and 0…100 ms in the
//! wearer the default's are 0.15…0.8 s long, and 1 s where they saturate
//! (docs/control.md). Swings with one period and no less width each than the one
//! before are the loop's own; loads and impacts die away, noise keeps no period, and
//! what a moving target makes repeats with its period or a low harmonic of it.

use super::gain::Gain;
use super::low_pass::LowPass;
use crate::units::Angle;
use fixed::types::I16F16;

/// 1° in bits of [`Angle`].
const DEGREE: i32 = 1 << 16;
/// Least swing that counts, peak to peak behind the filter.
const SWING: u32 = 2 * DEGREE.cast_unsigned();
/// From here on the effort saturates: two such half-periods tell as much as four, and
/// a lower gain need not show at once.
const WIDE: u32 = 20 * DEGREE.cast_unsigned();
/// Widest that a feedback at its floor may be left with.
const SWING_AT_FLOOR: u32 = 5 * DEGREE.cast_unsigned();
/// How far back from an extreme is a turn: more than noise leaves.
const TURN: i32 = DEGREE;
/// A target that moves further in one step jumps: the swing there and back is its own,
/// and costs more than it may seem to add.
const JUMP: u32 = 2 * DEGREE.cast_unsigned();
const JUMP_COSTS: u8 = 3;
/// Whole periods, ms.
const PERIOD_MS: core::ops::RangeInclusive<u32> = 120..=1_600;
/// Time constant of the filter that takes off the sensor's noise, ms.
const FILTER_MS: u32 = 32;
/// Half-periods that fit, less those between them that do not, that make a limit
/// cycle: four periods.
const ALIKE: u8 = 8;
/// What is left of the gain each time, 2^-16: 0.7.
const LOWERED: Gain = Gain::from_bits(45_875);
/// No lower: an eighth.
const FLOOR: Gain = Gain::from_bits(1 << 13);
/// A cycle that the latest lowering did not narrow by an eighth is not of the gain,
/// or not only: it is lowered again every so many times.
const PATIENCE: u8 = 4;

/// A limit cycle that was found, and what was done.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LimitCycle {
    /// Width of its last swing, peak to peak: of the measured error behind a filter.
    pub swing: Angle,
    /// Its period, ms.
    pub period_ms: u16,
    /// The gain of the feedback from now on, thousandths of the configured one; none
    /// if it is at its floor, an eighth, and the swing above 5° all the same: nothing
    /// is left but to stop.
    pub gain_milli: Option<u16>,
}

/// Finds limit cycles in a law's error, one law period after the other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detector {
    period_ms: u32,
    filter: LowPass,
}

/// What a [`Detector`] remembers, the gain included.
#[derive(Clone, Copy, Debug)]
pub(super) struct DetectorState {
    gain: Gain,
    filtered: i32,
    error: TurningPoints,
    target: TurningPoints,
    latest_target: Option<Angle>,
    /// ms from extreme to extreme of the target.
    target_ms: u32,
    /// The error's latest half-period, and the whole one that it ends.
    half: Half,
    whole_ms: u32,
    /// Towards [`ALIKE`].
    alike: u8,
    /// The swing at which the gain was lowered last, and how often it was no
    /// narrower since.
    lowered_at: u32,
    futile: u8,
}

impl Default for DetectorState {
    fn default() -> Self {
        Self {
            gain: Gain::ONE,
            filtered: 0,
            error: TurningPoints::default(),
            target: TurningPoints::default(),
            latest_target: None,
            target_ms: 0,
            half: Half::default(),
            whole_ms: 0,
            alike: 0,
            lowered_at: u32::MAX,
            futile: 0,
        }
    }
}

/// The turning points of a signal: extremes from which it has come back by [`TURN`].
#[derive(Clone, Copy, Debug, Default)]
struct TurningPoints {
    rises: bool,
    /// The extreme since the last turn, and the one before it.
    extreme: i32,
    opposite: i32,
    /// ms since each.
    age_ms: u32,
    opposite_age_ms: u32,
}

/// From an extreme to the next.
#[derive(Clone, Copy, Debug, Default)]
struct Half {
    ms: u32,
    swing: u32,
}

impl TurningPoints {
    /// A value `ms` after the one before.
    #[inline(always)]
    fn step(&mut self, x: i32, ms: u32) -> Option<Half> {
        self.age_ms = self.age_ms.saturating_add(ms);
        self.opposite_age_ms = self.opposite_age_ms.saturating_add(ms);
        let ahead = x.saturating_sub(self.extreme);
        let ahead = if self.rises {
            ahead
        } else {
            ahead.saturating_neg()
        };
        if ahead >= 0 {
            (self.extreme, self.age_ms) = (x, 0);
        }
        (ahead < -TURN).then(|| self.record_turning_point(x))
    }

    fn record_turning_point(&mut self, x: i32) -> Half {
        let half = Half {
            ms: self.opposite_age_ms.saturating_sub(self.age_ms),
            swing: self.extreme.abs_diff(self.opposite),
        };
        self.rises = !self.rises;
        (self.opposite, self.opposite_age_ms) = (self.extreme, self.age_ms);
        (self.extreme, self.age_ms) = (x, 0);
        half
    }
}

impl Detector {
    /// For a law's period of 1…20 ms.
    pub(super) fn new(period_ms: u8) -> Self {
        let period_ms = u32::from(period_ms.max(1));
        Self {
            period_ms,
            filter: LowPass::new(FILTER_MS, period_ms),
        }
    }

    /// One law period further, with the law's target and error. A limit cycle lowers
    /// the state's gain, as far as that goes.
    pub(super) fn step(
        &self,
        state: &mut DetectorState,
        target: Angle,
        error: Angle,
    ) -> Option<LimitCycle> {
        self.follow_target(state, target);
        let filtered = self.filter.step(&mut state.filtered, error);
        let half = state.error.step(filtered, self.period_ms)?;
        state.is_cycle(half).then(|| LimitCycle {
            swing: Angle::new(I16F16::from_bits(half.swing.min(i32::MAX as u32) as i32)),
            period_ms: state.whole_ms as u16, // PERIOD_MS
            gain_milli: state.lower_gain(half.swing),
        })
    }

    #[inline(always)]
    fn follow_target(&self, state: &mut DetectorState, target: Angle) {
        let before = state.latest_target.replace(target).unwrap_or(target);
        let [target, before] = [target, before].map(|angle| angle.get().to_bits());
        if target.abs_diff(before) > JUMP {
            state.alike = state.alike.saturating_sub(JUMP_COSTS);
        }
        if let Some(half) = state.target.step(target, self.period_ms) {
            state.target_ms = half.ms;
        }
    }
}

impl DetectorState {
    /// The gain of the feedback now.
    pub(super) const fn gain(&self) -> Gain {
        self.gain
    }

    /// Takes a half-period; whether it is the last that a limit cycle needs.
    fn is_cycle(&mut self, half: Half) -> bool {
        let before = core::mem::replace(&mut self.half, half);
        let whole_ms = half.ms.saturating_add(before.ms);
        let before_ms = core::mem::replace(&mut self.whole_ms, whole_ms);
        // Below the fourth harmonic of a target that came and went, or that still
        // goes its first way.
        let target_ms = self.target_ms.max(self.target.opposite_age_ms);
        let fits = half.swing >= SWING
            && half.swing >= before.swing / 4 * 3
            && PERIOD_MS.contains(&whole_ms)
            && whole_ms <= target_ms / 2
            && whole_ms.abs_diff(before_ms) <= before_ms / 4;
        if !fits {
            self.alike = self.alike.saturating_sub(1);
            return false;
        }
        // Below ALIKE before.
        self.alike += if half.swing > WIDE { 2 } else { 1 };
        let is_last = self.alike >= ALIKE;
        if is_last {
            self.alike = 0;
        }
        is_last
    }

    /// Lowers the gain if that has helped so far, or has not for a while; to what, in
    /// thousandths. None if it cannot be lowered and should be.
    fn lower_gain(&mut self, swing: u32) -> Option<u16> {
        let is_narrower = swing < self.lowered_at / 8 * 7 || swing > WIDE;
        self.futile = if is_narrower {
            0
        } else {
            self.futile.saturating_add(1)
        };
        if is_narrower || self.futile >= PATIENCE {
            if self.gain <= FLOOR && swing > SWING_AT_FLOOR {
                return None;
            }
            self.gain = self.gain.combine(LOWERED).max(FLOOR);
            (self.lowered_at, self.futile) = (swing, 0);
        }
        Some(self.gain.to_milli())
    }
}
