//! PID on the joint angle: the baseline every other law is measured against.

use super::law::{Effort, Q, RAD_PER_DEG, product, ratio};
use crate::units::{Angle, AngularRate};

/// u = kp·e + ki·∫e + kd·ė + the feed-forward in radians, with conditional integration: the
/// integral rests while |u| > 1 and the error would push it further out.
#[derive(Clone, Copy, Debug)]
pub struct Pid {
    kp: Q,
    /// ki·h.
    ki_step: Q,
    kd: Q,
}

/// What a [`Pid`] remembers: its integral term.
#[derive(Clone, Copy, Debug, Default)]
pub struct PidState {
    integral: Q,
}

impl Pid {
    /// Gains in thousandths; ranges are checked by
    /// [`super::joint::Joint::new`].
    #[must_use]
    pub(super) fn new(kp_milli: u32, ki_milli: u32, kd_milli: u32, period_ms: u8) -> Self {
        Self {
            kp: ratio(kp_milli.into(), 1000),
            ki_step: ratio(u64::from(ki_milli) * u64::from(period_ms), 1_000_000),
            kd: ratio(kd_milli.into(), 1000),
        }
    }

    /// One period further: fraction of the range, not clamped.
    pub fn step(
        &self,
        state: &mut PidState,
        error: Angle,
        rate: AngularRate,
        forward: Q,
    ) -> Effort {
        // |e|, |ė| < 2^15 degrees are below 572 rad, gains at most 100: every
        // product fits.
        let e = product(Q::from_num(error.0), RAD_PER_DEG);
        let de = product(Q::from_num(rate.0), RAD_PER_DEG);
        let u = product(e, self.kp)
            .saturating_add(product(de, self.kd))
            .saturating_add(state.integral)
            .saturating_add(forward);
        let outward = (u > Q::ONE && e > Q::ZERO) || (u < -Q::ONE && e < Q::ZERO);
        if !outward {
            state.integral = state.integral.saturating_add(product(e, self.ki_step));
        }
        Effort::Fraction(u)
    }
}
