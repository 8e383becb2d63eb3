//! Dynamic response of a nominal wearer, and adaptation to the present wearer: a predictor that
//! compensates delay, and gains that are adapted during control.

use super::feed_forward::WearerModel;
use super::gain::Gain;
use super::integral::{ONE, Side};
use crate::arithmetic::exponential::exp2_neg;
use crate::arithmetic::fixed_point::{Q, radians, ratio, saturated};
use crate::range::{OutOfRange, Range};
use crate::units::{Angle, AngularRate};
use fixed::types::I16F16;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Number of periods stored, for delays of less than 80 periods; the shortest period is 1 ms.
const DELAY_MAX: usize = 128;
/// Constant log2 e in 2^-32.
const LOG2_E_Q32: u64 = 6_196_328_019;

/// Nominal response of a wearer to effort, and the rates of adaptation. Integers, as they travel on
/// the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ResponseSpec {
    /// Angle that a constant effort of 1 finally causes, mrad; 0 (no predictor)…10 000.
    pub gain_mrad: u16,
    /// Time constant of the muscle, ms; 1…1000.
    pub muscle_ms: u16,
    /// Time constant of the joint, ms; 1…1000.
    pub joint_ms: u16,
    /// Delay from effort to angle, ms; 0…79, less than 80 periods of the controller.
    pub delay_ms: u8,
    /// Adaptation rate of the feed-forward's scale, 10^-3/(rad·s); 0 (never)…100 000.
    pub scale_milli: u32,
    /// Adaptation rate of the effort per rate of the reference, 10^-3/rad²; 0 (never)…10 000.
    pub damping_milli: u32,
}

/// A validated [`ResponseSpec`] for one period.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Response {
    /// Gain in ° per effort, 2^-16: below 2^26.
    gain: i32,
    /// Decay e^(−h/τ) of muscle and joint per period, 2^-30.
    keeps: [i32; 2],
    /// Delay in periods, below [`DELAY_MAX`].
    delay: u32,
    /// Growth of the scale per period, per rad of error and unit of feed-forward, 2^-24: below
    /// 2^26.
    scale_step: i32,
    /// Growth of the damping per period, per rad of error and rad/s of the reference, 2^-24: below
    /// 2^26.
    damping_step: i32,
    /// Whether each muscle has its own integral. This is so with learning, where the nominal
    /// wearer's effort shows which muscle works.
    is_apart: bool,
}

/// State of a [`Response`]: the predictor, and the values learnt so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResponseState {
    /// Low-pass states of muscle and joint, within ±1, 2^-29.
    lags: [i32; 2],
    /// State of the joint at the end of each of the last periods.
    past: [i32; DELAY_MAX],
    /// Number of periods so far; modulo [`DELAY_MAX`], the slot of `past` that is written next.
    next: u32,
    /// Learnt scale of the feed-forward minus 1, 2^-24.
    scale: i32,
    /// Learnt effort per rad/s, 2^-24.
    damping: i32,
}

impl Default for ResponseState {
    fn default() -> Self {
        Self {
            lags: [0; 2],
            past: [0; DELAY_MAX],
            next: 0,
            scale: 0,
            damping: 0,
        }
    }
}

/// Present motion of the reference, its feed-forward, and the sides with delayed outputs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Course {
    /// Rate of the reference.
    pub(crate) rate: AngularRate,
    /// Effort of the nominal wearer, −1…1.
    pub(crate) forward: Q,
    /// Sides on which the outputs are below the wanted amplitude.
    pub(crate) delayed: DelayedSides,
}

/// Sides of a joint whose latest pulses were below the wanted amplitude, because a rise or the
/// slope limit delays them (`firmware::safety`). The effort is clamped there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct DelayedSides {
    pub(crate) flexion: bool,
    pub(crate) extension: bool,
}

impl DelayedSides {
    /// Returns whether an effort beyond ±1, or on a delayed side, is clamped on the side to which
    /// `push` points.
    #[inline(always)]
    pub(super) fn clamps(self, effort: Q, push: Q) -> bool {
        let is_up = effort > Q::ZERO;
        let is_delayed = if is_up { self.flexion } else { self.extension };
        let is_beyond = saturated(effort.to_bits()).unsigned_abs() > 1 << Q::FRAC_NBITS;
        (is_beyond || is_delayed) && is_up == (push > Q::ZERO)
    }
}

/// Corrections of a controller's feedback from the nominal and the learnt response of the wearer.
#[derive(Clone, Copy, Debug)]
pub(super) struct FeedbackAid {
    /// Feed-forward with the learnt corrections, as an effort.
    pub(super) forward: Q,
    /// Scale of the feedback, in effort per effort of the nominal wearer, 2^-24: up to 2.5.
    scale: i32,
    is_apart: bool,
    pub(super) delayed: DelayedSides,
}

impl FeedbackAid {
    /// Returns the feed-forward of `course` with the share `gain` of the feedback and nothing
    /// learnt.
    pub(super) const fn from_feed_forward(course: &Course, gain: Gain) -> Self {
        Self {
            forward: course.forward,
            delayed: course.delayed,
            scale: gain.scale(ONE as i64) as i32, // at most `ONE`
            is_apart: false,
        }
    }

    /// Scales the feedback for a nominal wearer, bounded to ±128, to this wearer.
    #[inline(always)]
    pub(super) fn scale_feedback(&self, nominal: Q) -> Q {
        Q::from_bits(multiply_shift(saturated(nominal.to_bits()), self.scale, 24))
    }

    /// Returns the shares of both muscles' integrals for an effort of `torque` before any integral.
    #[inline(always)]
    pub(super) fn integral_side(&self, torque: Q) -> Side {
        if self.is_apart {
            Side::of(torque)
        } else {
            Side::BOTH
        }
    }
}

/// Bounds of the learnt scale minus 1, 2^-24: −½…+1½.
const SCALE: (i32, i32) = (-(1 << 23), 3 << 23);
/// Bound of the magnitude of the learnt damping, 2^-24: 0.3.
const DAMPING: i32 = 5_033_165;

impl ResponseSpec {
    /// Range of [`Self::gain_mrad`].
    pub const GAIN_MRAD: Range = Range::new("gain_mrad", 0, 10_000);
    /// Range of [`Self::muscle_ms`].
    pub const MUSCLE_MS: Range = Range::new("muscle_ms", 1, 1_000);
    /// Range of [`Self::joint_ms`].
    pub const JOINT_MS: Range = Range::new("joint_ms", 1, 1_000);
    /// Range of [`Self::delay_ms`].
    pub const DELAY_MS: Range = Range::new("delay_ms", 0, 79);
    /// Range of [`Self::scale_milli`].
    pub const SCALE_MILLI: Range = Range::new("scale_milli", 0, 100_000);
    /// Range of [`Self::damping_milli`].
    pub const DAMPING_MILLI: Range = Range::new("damping_milli", 0, 10_000);

    /// Response that was found together with [`super::LawSpec::RECOMMENDED`], by the same search,
    /// for a wearer of [`WearerModel::REFERENCE_MRAD`].
    pub const RECOMMENDED: Self = Self {
        gain_mrad: 563,
        muscle_ms: 112,
        joint_ms: 63,
        delay_ms: 76,
        scale_milli: 14_864,
        damping_milli: 164,
    };

    /// Scales gain and learning rate to a wearer of another strength, in proportion to the movement
    /// per effort. Learning follows the product of error and feed-forward, and acts through the
    /// feed-forward again. Without the scaling, a weak wearer, who needs much feed-forward, would
    /// make learning too fast by the square.
    #[must_use]
    pub const fn for_wearer(self, wearer: &WearerModel) -> Self {
        let strength = wearer.strength_mrad() as u64;
        let reference = WearerModel::REFERENCE_MRAD as u64;
        // The strength is at most four times the reference.
        let gain = (self.gain_mrad as u64 * strength + reference / 2) / reference;
        let scale = (self.scale_milli as u64 * strength + reference / 2) / reference;
        Self {
            gain_mrad: if gain > 10_000 { 10_000 } else { gain as u16 },
            scale_milli: if scale > 100_000 {
                100_000
            } else {
                scale as u32
            },
            ..self
        }
    }

    /// Validates the response for a period of 1…20 ms, with or without a nominal wearer's model.
    pub(super) fn validate(&self, period_ms: u8, has_wearer: bool) -> Result<Response, OutOfRange> {
        Self::GAIN_MRAD.check(self.gain_mrad)?;
        Self::MUSCLE_MS.check(self.muscle_ms)?;
        Self::JOINT_MS.check(self.joint_ms)?;
        Self::DELAY_MS.check(self.delay_ms)?;
        Self::SCALE_MILLI.check(self.scale_milli)?;
        Self::DAMPING_MILLI.check(self.damping_milli)?;
        let h = u64::from(period_ms.max(1));
        // h/τ <= 20, so the octaves are below 2^38 in 2^-32.
        let keep = |tau_ms: u16| {
            let octaves = LOG2_E_Q32 * h / u64::from(tau_ms.max(1));
            (exp2_neg(octaves) >> 1) as i32
        };
        // The ratio is at most 573: below 2^34 in bits of `Q`, so below 2^26 after the shift.
        let bits = |numerator, denominator| ratio(numerator, denominator).to_bits();
        // 180/π/1000 = 57 295 780 · 10^-9.
        let gain = bits(u64::from(self.gain_mrad) * 57_295_780, 1_000_000_000);
        Ok(Response {
            gain: (gain >> 8) as i32,
            keeps: [keep(self.muscle_ms), keep(self.joint_ms)],
            // At most 79.
            delay: ((u64::from(self.delay_ms) + h / 2) / h) as u32,
            scale_step: bits(u64::from(self.scale_milli) * h, 1_000_000) as i32,
            damping_step: bits(u64::from(self.damping_milli) * h, 1_000_000) as i32,
            is_apart: has_wearer && self.scale_milli > 0,
        })
    }
}

impl Response {
    /// Returns the error that remains once the efforts of the last delay have acted: `error` minus
    /// the movement that the nominal wearer has yet to make (Smith, Chem. Eng. Prog. 53 (1957)).
    #[inline]
    pub(super) fn predicted_error(&self, state: &ResponseState, error: Angle) -> Angle {
        let [_, now] = state.lags;
        // At least 1 before `next`, wrapped to the table's length, 2^7.
        let before = state.next.wrapping_sub(self.delay).wrapping_sub(1);
        let slot = before as usize % DELAY_MAX;
        let then = state.past.get(slot).copied().unwrap_or(0);
        // Both are within ±1 and a bit, so their difference fits; with a gain below 2^26 the
        // product is below 2^28.
        let to_come = multiply_shift(now.wrapping_sub(then), self.gain, 29) as i32;
        let error = error.get().to_bits().saturating_sub(to_come);
        Angle::new(I16F16::from_bits(error))
    }

    /// Returns the corrections learnt so far, for this course and this share of the feedback.
    #[inline]
    pub(super) fn aid(&self, state: &ResponseState, course: &Course, gain: Gain) -> FeedbackAid {
        // |forward| <= 1; |scale| < 2, |damping| < 1, |rate| <= 72.
        let forward = course.forward.to_bits() as i32;
        let scaled = multiply_shift(state.scale, forward, 24);
        let damped = multiply_shift(state.damping, radians(course.rate.get()), 24);
        let learnt = Q::from_bits(scaled.wrapping_add(damped));
        FeedbackAid {
            forward: course.forward.wrapping_add(learnt),
            scale: gain.scale(i64::from(ONE.wrapping_add(state.scale))) as i32, // cannot grow
            is_apart: self.is_apart,
            delayed: course.delayed,
        }
    }

    /// Records the period's effort. Learns from the error while the reference moves, unless the
    /// effort is clamped on the side to which the error points: gradient descent on the squared
    /// error ("MIT rule", Åström & Wittenmark, Adaptive Control, ch. 5).
    #[inline]
    pub(super) fn learn(&self, state: &mut ResponseState, error: Angle, course: &Course, u: Q) {
        let is_clamped = course.delayed.clamps(u, Q::from_num(error.get()));
        let u = saturated(u.to_bits());
        let is_moving = course.rate.get() != 0;
        if is_moving && !is_clamped {
            // Within ±8 rad, with steps below 4 and |forward| <= 1: below 2^29.
            let e = radians(error.get()).clamp(-(8 << 24), 8 << 24);
            let forward = course.forward.to_bits() as i32;
            let scale =
                multiply_shift(multiply_shift(self.scale_step, e, 24) as i32, forward, 24) as i32;
            state.scale = state.scale.saturating_add(scale).clamp(SCALE.0, SCALE.1);
            // Within ±72: the product is below 2^36, which saturates.
            let rate = radians(course.rate.get());
            let damping = saturated(multiply_shift(
                multiply_shift(self.damping_step, e, 24) as i32,
                rate,
                24,
            ));
            state.damping = (state.damping.saturating_add(damping)).clamp(-DAMPING, DAMPING);
        }
        // Within ±1: 2^29.
        let effort = u.clamp(-ONE, ONE) << 5;
        let [keep_muscle, keep_joint] = self.keeps;
        let [muscle, joint] = state.lags;
        // Means of numbers within ±1 and a bit: differences stay within 2^30 and the sums fit.
        let follow = |from: i32, to: i32, keep: i32| {
            let left = multiply_shift(from.wrapping_sub(to), keep, 30) as i32;
            to.wrapping_add(left)
        };
        let muscle = follow(muscle, effort, keep_muscle);
        let joint = follow(joint, muscle, keep_joint);
        state.lags = [muscle, joint];
        if let Some(slot) = state.past.get_mut(state.next as usize % DELAY_MAX) {
            *slot = joint;
        }
        state.next = state.next.wrapping_add(1);
    }
}

/// Computes a·b / 2^shift, rounded towards −∞.
#[inline(always)]
fn multiply_shift(a: i32, b: i32, shift: u32) -> i64 {
    // Both factors have 32 bits.
    i64::from(a).wrapping_mul(i64::from(b)) >> shift
}
