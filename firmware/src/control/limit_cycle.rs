//! Limit cycles of the control loop: detects them in the error and lowers the feedback's gain.
//!
//! A loop with too much delay and gain oscillates at the frequency at which the phases of
//! controller, delay and plant add up to half a turn, with the amplitude that the controller's
//! describing function predicts (Gelb & Vander Velde, Multiple-Input Describing Functions, 1968,
//! ch. 3). A relay on a plant that mostly integrates oscillates with a period of about four times
//! the delay (Åström & Hägglund, Automatica 20 (1984) 645). With 20 ms from pulse to pulse and a
//! delay of 0…100 ms in the wearer, the periods of the default controller are 0.15…0.8 s, and 1 s
//! if it saturates (docs/evidence/control.md). Oscillations of constant period whose width does not shrink
//! come from the loop itself. Loads and impacts decay, noise has no period, and effects of a moving
//! reference repeat with its period or a low harmonic of it.

use super::gain::Gain;
use super::low_pass::LowPass;
use crate::units::Angle;
use fixed::types::I16F16;

/// The angle 1° as bits of [`Angle`].
const DEGREE: i32 = 1 << 16;
/// Smallest swing of the filtered error that counts, peak to peak, as bits of [`Angle`].
const SWING: u32 = 2 * DEGREE.cast_unsigned();
/// Swing of the filtered error above which the effort saturates, peak to peak. A half-period wider
/// than this counts twice, and the gain is lowered again even if the swing has not shrunk.
const WIDE: u32 = 20 * DEGREE.cast_unsigned();
/// Largest swing that is tolerated while the gain is at its floor.
const SWING_AT_FLOOR: u32 = 5 * DEGREE.cast_unsigned();
/// Distance from its latest extreme at which a signal counts as turned: more than noise causes.
const TURN: i32 = DEGREE;
/// Change of the reference in one step, as bits of [`Angle`], above which the reference jumps.
const JUMP: u32 = 2 * DEGREE.cast_unsigned();
/// Number by which a jump of the reference lowers the count of matching half-periods. The swing to
/// the jump and back is not a limit cycle, so a jump subtracts more than it could add.
const JUMP_COSTS: u8 = 3;
/// Range of the period that an oscillation must have to be a limit cycle, ms.
const PERIOD_MS: core::ops::RangeInclusive<u32> = 120..=1_600;
/// Time constant of the filter that removes the sensor's noise, ms.
const FILTER_MS: u32 = 32;
/// Number of matching half-periods that make a limit cycle: four periods. Half-periods between them
/// that do not match are subtracted.
const ALIKE: u8 = 8;
/// Factor of each lowering of the gain, 2^-16: 0.7.
const LOWERED: Gain = Gain::from_bits(45_875);
/// Smallest gain: an eighth.
const FLOOR: Gain = Gain::from_bits(1 << 13);
/// Number of limit cycles from one lowering of the gain to the next if the first of the two did not
/// narrow the swing by an eighth: then the gain is not the cause, or not the only one.
const PATIENCE: u8 = 4;

/// A detected limit cycle and the response to it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LimitCycle {
    /// Width of the last swing, peak to peak, of the filtered error.
    pub swing: Angle,
    /// Period of the oscillation, ms.
    pub period_ms: u16,
    /// New gain of the feedback, thousandths of the configured one. `None` if the gain is at its
    /// floor of an eighth and the swing is still above 5°: control can only stop then.
    pub gain_milli: Option<u16>,
}

/// Detector of limit cycles in a controller's error. It advances in steps of the controller's
/// period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detector {
    period_ms: u32,
    filter: LowPass,
}

/// State of a [`Detector`], including the gain.
#[derive(Clone, Copy, Debug)]
pub(super) struct DetectorState {
    gain: Gain,
    filtered: i32,
    error: TurningPoints,
    target: TurningPoints,
    latest_target: Option<Angle>,
    /// Time between the latest two extremes of the reference, ms.
    target_ms: u32,
    /// Latest half-period of the error.
    half: Half,
    /// Duration of the whole period that ends with `half`, ms.
    whole_ms: u32,
    /// Number of matching half-periods so far, towards [`ALIKE`].
    alike: u8,
    /// Swing of the error at the latest lowering of the gain.
    lowered_at: u32,
    /// Number of limit cycles since the latest lowering of the gain whose swing was not narrower by
    /// an eighth.
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

/// Turning points of a signal: extremes from which the signal has come back by [`TURN`].
#[derive(Clone, Copy, Debug, Default)]
struct TurningPoints {
    rises: bool,
    /// Extreme since the last turn.
    extreme: i32,
    /// Extreme before the last turn.
    opposite: i32,
    /// Time since `extreme`, ms.
    age_ms: u32,
    /// Time since `opposite`, ms.
    opposite_age_ms: u32,
}

/// Half-period from one extreme to the next: duration and width.
#[derive(Clone, Copy, Debug, Default)]
struct Half {
    ms: u32,
    swing: u32,
}

impl TurningPoints {
    /// Advances by `ms` to the value `x`, and returns the half-period that ends there, if any.
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
    /// Creates a detector for a controller period of 1…20 ms.
    pub(super) fn new(period_ms: u8) -> Self {
        let period_ms = u32::from(period_ms.max(1));
        Self {
            period_ms,
            filter: LowPass::new(FILTER_MS, period_ms),
        }
    }

    /// Advances by one controller period with the reference and the error. A limit cycle lowers the
    /// state's gain, down to its floor.
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
            period_ms: state.whole_ms as u16, // within PERIOD_MS
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
    /// Returns the present gain of the feedback.
    pub(super) const fn gain(&self) -> Gain {
        self.gain
    }

    /// Records a half-period, and returns whether it completes a limit cycle.
    fn is_cycle(&mut self, half: Half) -> bool {
        let before = core::mem::replace(&mut self.half, half);
        let whole_ms = half.ms.saturating_add(before.ms);
        let before_ms = core::mem::replace(&mut self.whole_ms, whole_ms);
        // The oscillation must be faster than the fourth harmonic of a reference that went back and
        // forth, or that still moves in its first direction.
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
        // The count was below ALIKE before.
        self.alike += if half.swing > WIDE { 2 } else { 1 };
        let is_last = self.alike >= ALIKE;
        if is_last {
            self.alike = 0;
        }
        is_last
    }

    /// Lowers the gain if the latest lowering helped, or if none took place for a while. Returns
    /// the gain in thousandths, or `None` if a lower gain is needed and not possible.
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
