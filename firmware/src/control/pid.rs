//! PID control of the joint angle: the baseline with which the other controllers are compared.

use super::effort::Effort;
use super::integral::Integral;
use super::refusal::GAIN_MAX_MILLI;
use super::response::FeedbackAid;
use crate::arithmetic::fixed_point::{Q, RAD_PER_DEG, product, ratio};
use crate::range::{OutOfRange, Range};
use crate::units::{Angle, AngularRate};

/// PID controller u = kp·e + ki·∫e + kd·ė + feed-forward, in radians, with conditional integration:
/// the integral stays constant while |u| > 1 or the outputs are delayed, if the error would
/// increase the saturation.
#[derive(Clone, Copy, Debug)]
pub struct Pid {
    kp: Q,
    /// Product ki·h of integral gain and period.
    ki_step: Q,
    kd: Q,
}

impl Pid {
    /// Range of the proportional gain, thousandths of 1/rad.
    pub const KP_MILLI: Range = Range::new("kp_milli", 0, GAIN_MAX_MILLI);
    /// Range of the integral gain, thousandths of 1/(rad·s).
    pub const KI_MILLI: Range = Range::new("ki_milli", 0, GAIN_MAX_MILLI);
    /// Range of the derivative gain, thousandths of s/rad.
    pub const KD_MILLI: Range = Range::new("kd_milli", 0, GAIN_MAX_MILLI);

    /// Validates gains in thousandths, as in [`super::LawSpec::Pid`].
    pub(super) fn new(kp: u32, ki: u32, kd: u32, period_ms: u8) -> Result<Self, OutOfRange> {
        Self::KP_MILLI.check(kp)?;
        Self::KI_MILLI.check(ki)?;
        Self::KD_MILLI.check(kd)?;
        Ok(Self {
            kp: ratio(kp.into(), 1000),
            ki_step: ratio(u64::from(ki) * u64::from(period_ms), 1_000_000),
            kd: ratio(kd.into(), 1000),
        })
    }

    /// Advances by one period, and returns the effort as a fraction of the range, not clamped.
    pub(super) fn step(
        &self,
        integral: &mut Integral,
        error: Angle,
        rate: AngularRate,
        aid: &FeedbackAid,
    ) -> Effort {
        // |e|, |ė| < 2^15 degrees are below 572 rad, and gains are at most 100, so every product
        // fits.
        let e = product(Q::from_num(error.get()), RAD_PER_DEG);
        let de = product(Q::from_num(rate.get()), RAD_PER_DEG);
        let push = product(e, self.kp).saturating_add(product(de, self.kd));
        let torque = aid.scale_feedback(push).saturating_add(aid.forward);
        let side = aid.integral_side(torque);
        let u = torque.saturating_add(integral.at(side));
        if !aid.delayed.clamps(u, e) {
            integral.grow(side, aid.scale_feedback(product(e, self.ki_step)));
        }
        Effort::Fraction(u)
    }
}
