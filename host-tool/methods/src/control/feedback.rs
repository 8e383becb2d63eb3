//! Feedback laws of an angle's error: the contribution besides the integral, and the growth of the
//! integral.

use super::super::real::Real;
use super::sign;
use super::twist::{Discretization, Push, Twist};

/// Control law.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Form {
    /// Hamana 2022 (4), (5) with the sign corrected, in degrees and volts, without anti-windup.
    Paper,
    /// Super-twisting in radians and fractions of the wearer's range.
    Twisting(Discretization),
    /// The proper implicit form with a term k3·s and, in the integral, one of the error: they
    /// complement super-twisting far from and close to its surface. b is [`NOMINAL_GAIN`].
    TwistingWithLinear,
    /// PID, the baseline.
    Pid,
}

impl Form {
    pub const ALL: [Self; 9] = [
        Self::Paper,
        Self::Twisting(Discretization::Explicit),
        Self::Twisting(Discretization::SemiImplicit),
        Self::Twisting(Discretization::KochReichhartinger),
        Self::Twisting(Discretization::Resolvent),
        Self::Twisting(Discretization::Proxy),
        Self::Twisting(Discretization::ProperImplicit),
        Self::TwistingWithLinear,
        Self::Pid,
    ];

    /// Returns the name for tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Twisting(discretization) => discretization.name(),
            Self::TwistingWithLinear => "proper with linear",
            Self::Pid => "pid",
        }
    }
}

/// Volts from threshold to maximum of the paper's participant P at one-point electrode A (Hamana
/// 2022, table 7: 24…28 V). They convert the paper's effort into a fraction.
pub const PAPER_RANGE_V: f64 = 4.0;

/// Value of b if no search determines it, rad/s²: the order of magnitude that searches find. It
/// affects only the width of the implicit form's boundary layer.
pub const NOMINAL_GAIN: f64 = 100.0;

/// A control law with its gains, for one period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Feedback<R> {
    /// Gains of [`Form::Paper`].
    Paper {
        /// λ, of the surface (1/s) and of the root.
        lambda: R,
        /// Product W·h, V.
        w_step: R,
    },
    /// Gains of [`Form::Twisting`].
    Twisting {
        /// λ of the surface s = ė + λ·e, 1/s.
        lambda: R,
        /// Super-twisting on s in rad/s.
        twist: Twist<R>,
        /// Growth of the integral with the error itself, ki·h, 1/rad.
        ki_step: R,
    },
    /// PID law kp·e + ki·∫e + kd·ė.
    Pid {
        /// Proportional gain, 1/rad.
        kp: R,
        /// Integral gain times period, ki·h, 1/rad.
        ki_step: R,
        /// Derivative gain, s/rad.
        kd: R,
    },
}

impl<R: Real> Feedback<R> {
    /// Returns the response to an error e (rad) with rate ė (rad/s) while the integral is `v`.
    pub fn push(&self, e: R, rate: R, v: R) -> Push<R> {
        match self {
            Self::Paper { lambda, w_step } => {
                let degrees = R::from_f64(180.0 / core::f64::consts::PI);
                let volts = R::from_f64(PAPER_RANGE_V);
                let s = (rate + *lambda * e) * degrees;
                Push {
                    push: *lambda * s.abs().sqrt() * sign(s) / volts,
                    growth: *w_step * sign(s) / volts,
                }
            }
            Self::Twisting {
                lambda,
                twist,
                ki_step,
            } => {
                let mut answer = twist.push(rate + *lambda * e, v);
                answer.growth = answer.growth + *ki_step * e;
                answer
            }
            Self::Pid { kp, ki_step, kd } => Push {
                push: *kp * e + *kd * rate,
                growth: *ki_step * e,
            },
        }
    }

    /// Returns whether the integral stops while the effort is clamped. That of the paper does not.
    pub const fn has_anti_windup(&self) -> bool {
        !matches!(self, Self::Paper { .. })
    }
}
