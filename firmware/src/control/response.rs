//! How a nominal wearer answers in time, and what the device learns of how this
//! one differs: a predictor against delay, and gains adapted while it runs.

use super::law::{Q, RAD_PER_DEG, product, ratio};
use super::spec::{SpecError, SpecField, within};
use crate::muscle::exponential::exp2_neg;
use crate::units::{Angle, AngularRate};
use fixed::types::I16F16;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Longest delay, periods; the shortest period is 1 ms.
const DELAY_MAX: usize = 80;
/// log2 e in 2^-32.
const LOG2_E_Q32: u64 = 6_196_328_019;

/// What is known beforehand of a wearer's answer to effort, and how fast the
/// device corrects what it knows. Integers, as they travel on the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ResponseSpec {
    /// Angle per effort at rest, mrad; 0 (no predictor)…10 000.
    pub gain_mrad: u16,
    /// Time constant of the muscle, ms; 1…1000.
    pub muscle_ms: u16,
    /// Time constant of the joint, ms; 1…1000.
    pub joint_ms: u16,
    /// Delay from effort to angle, ms; 0…79, less than 80 periods of the law.
    pub delay_ms: u8,
    /// How fast the feed-forward's scale is learnt, 10^-3/(rad·s);
    /// 0 (never)…100 000.
    pub scale_milli: u32,
    /// How fast the effort per rate of the target is learnt, 10^-3/rad²;
    /// 0 (never)…10 000.
    pub damping_milli: u32,
}

/// A validated [`ResponseSpec`] for one period.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    /// ° per effort.
    gain: Q,
    /// e^(−h/τ) of muscle and joint.
    keeps: [Q; 2],
    /// Periods, below [`DELAY_MAX`].
    delay: usize,
    /// Growth per period, rad and effort.
    scale_step: Q,
    /// Growth per period, rad and rad/s.
    damping_step: Q,
}

/// What a [`Response`] remembers.
#[derive(Clone, Copy, Debug)]
pub(super) struct ResponseState {
    lags: [Q; 2],
    /// Bits of the joint's lag, within ±1, of the last periods.
    past: [i32; DELAY_MAX],
    next: usize,
    /// Scale of the feed-forward less 1.
    scale: Q,
    /// Effort per rad/s.
    damping: Q,
}

impl Default for ResponseState {
    fn default() -> Self {
        Self {
            lags: [Q::ZERO; 2],
            past: [0; DELAY_MAX],
            next: 0,
            scale: Q::ZERO,
            damping: Q::ZERO,
        }
    }
}

/// What the setpoint track and the nominal wearer say of the target now.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Course {
    /// The target's rate.
    pub(crate) rate: AngularRate,
    /// The nominal wearer's effort, −1…1.
    pub(crate) forward: Q,
}

/// Errors and rates enter learning within this, rad and rad/s.
const LEARNT_MAX: Q = Q::from_bits(16 << Q::FRAC_NBITS);
/// The scale may leave 1 by −½…+1½, the damping 0 by ±0.3.
const SCALE: (Q, Q) = (
    Q::from_bits(-(1 << (Q::FRAC_NBITS - 1))),
    Q::from_bits(3 << (Q::FRAC_NBITS - 1)),
);
const DAMPING: Q = Q::from_bits(5_033_165);

impl ResponseSpec {
    /// Found with [`super::LawSpec::RECOMMENDED`], by the same search.
    pub const RECOMMENDED: Self = Self {
        gain_mrad: 1_141,
        muscle_ms: 224,
        joint_ms: 477,
        delay_ms: 52,
        scale_milli: 21_400,
        damping_milli: 39,
    };

    /// Validates it for a period of 1…20 ms.
    pub(super) fn response(&self, period_ms: u8) -> Result<Response, SpecError> {
        use SpecField as F;
        within(F::ResponseGain, self.gain_mrad.into(), 0, 10_000)?;
        within(F::MuscleLag, self.muscle_ms.into(), 1, 1000)?;
        within(F::JointLag, self.joint_ms.into(), 1, 1000)?;
        within(F::Delay, self.delay_ms.into(), 0, 79)?;
        within(F::ScaleLearning, self.scale_milli, 0, 100_000)?;
        within(F::DampingLearning, self.damping_milli, 0, 10_000)?;
        let h = u64::from(period_ms.max(1));
        // h/τ <= 20: below 2^38 in 2^-32. Q31 of it to Q24.
        let keep = |tau_ms: u16| {
            let octaves = LOG2_E_Q32 * h / u64::from(tau_ms.max(1));
            Q::from_bits(i64::from(exp2_neg(octaves) >> (31 - Q::FRAC_NBITS)))
        };
        Ok(Response {
            // 180/π/1000 = 57 295 780 · 10^-9.
            gain: ratio(u64::from(self.gain_mrad) * 57_295_780, 1_000_000_000),
            keeps: [keep(self.muscle_ms), keep(self.joint_ms)],
            // At most 79.
            delay: ((u64::from(self.delay_ms) + h / 2) / h) as usize,
            scale_step: ratio(u64::from(self.scale_milli) * h, 1_000_000),
            damping_step: ratio(u64::from(self.damping_milli) * h, 1_000_000),
        })
    }
}

impl Response {
    /// The error once the efforts of the last delay have acted: less what the
    /// nominal wearer will still move (Smith, Chem. Eng. Prog. 53 (1957)).
    pub(super) fn foreseen(&self, state: &ResponseState, error: Angle) -> Angle {
        let [_, now] = state.lags;
        let slot = (state.next + DELAY_MAX - 1 - self.delay) % DELAY_MAX;
        let then = Q::from_bits(state.past.get(slot).copied().unwrap_or(0).into());
        // gain <= 573, |now − then| <= 2.
        let to_come = product(self.gain, now - then).to_bits() >> (Q::FRAC_NBITS - 16);
        let error = i64::from(error.0.to_bits()) - to_come;
        let error = error.clamp(i32::MIN.into(), i32::MAX.into());
        Angle(I16F16::from_bits(error as i32))
    }

    /// The feed-forward as learnt so far.
    pub(super) fn forward(state: &ResponseState, course: &Course) -> Q {
        // |forward| <= 1, |rate| <= 16.
        course.forward
            + product(state.scale, course.forward)
            + product(state.damping, radians(Q::from_num(course.rate.0)))
    }

    /// Takes the period's effort, and learns from its error unless the effort is
    /// clamped on the side that the error asks for: gradient descent on the
    /// squared error ("MIT rule", Åström & Wittenmark, Adaptive Control, ch. 5).
    pub(super) fn learn(&self, state: &mut ResponseState, error: Angle, course: &Course, u: Q) {
        let e = radians(Q::from_num(error.0));
        let outward = (u > Q::ONE && e > Q::ZERO) || (u < -Q::ONE && e < Q::ZERO);
        if !outward {
            // Steps <= 2, |e| <= 16, |forward| <= 1, |rate| <= 16.
            let scale = product(product(self.scale_step, e), course.forward);
            state.scale = (state.scale + scale).clamp(SCALE.0, SCALE.1);
            let rate = radians(Q::from_num(course.rate.0));
            let damping = product(product(self.damping_step, e), rate);
            state.damping = (state.damping + damping).clamp(-DAMPING, DAMPING);
        }
        let effort = u.clamp(-Q::ONE, Q::ONE);
        let [keep_muscle, keep_joint] = self.keeps;
        let [muscle, joint] = state.lags;
        // All within ±1: differences within ±2.
        let muscle = effort + product(muscle - effort, keep_muscle);
        let joint = muscle + product(joint - muscle, keep_joint);
        state.lags = [muscle, joint];
        if let Some(slot) = state.past.get_mut(state.next) {
            // Rounding leaves it within ±1 and a bit: 25 bits.
            *slot = joint.to_bits() as i32;
        }
        state.next = (state.next + 1) % DELAY_MAX;
    }
}

/// From ° to rad, within ±[`LEARNT_MAX`].
fn radians(degrees: Q) -> Q {
    product(degrees, RAD_PER_DEG).clamp(-LEARNT_MAX, LEARNT_MAX)
}
