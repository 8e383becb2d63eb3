//! Feedback laws of an angle's error: the contribution besides the integral, and the growth of the
//! integral.

use super::super::real::Real;
use super::sign;
use super::twist::{Discretization, Push, Twist};

/// Kind of feedback law.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Form {
    /// Law of Hamana 2022, eqs. (4) and (5), with the sign corrected, in degrees and volts, without
    /// anti-windup.
    Paper,
    /// Super-twisting law with this discretization. Angles are in radians, and efforts are
    /// fractions of the wearer's range.
    Twisting(Discretization),
    /// Super-twisting in the proper implicit form with two linear terms: k3·s in the effort, which
    /// acts far from the sliding surface, and one proportional to the error in the integral, which
    /// acts close to it. The gain b is [`NOMINAL_GAIN`].
    TwistingWithLinear,
    /// PID law, with which the other laws are compared.
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

    /// Returns the name of the law in tables of results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Twisting(discretization) => discretization.name(),
            Self::TwistingWithLinear => "proper with linear",
            Self::Pid => "pid",
        }
    }
}

/// Range of the paper's participant P at one-point electrode A, from motor threshold to maximum, V
/// (Hamana 2022, table 7: 24…28 V). It converts the paper's effort in volts into a fraction.
pub const PAPER_RANGE_V: f64 = 4.0;

/// Gain b from effort to the rate of s, rad/s², for a law whose b is not searched for. Searches
/// find values of this order of magnitude. It affects only the width of the implicit form's
/// boundary layer.
pub const NOMINAL_GAIN: f64 = 100.0;

/// A feedback law with its gains, for a fixed control period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Feedback<R> {
    /// The law of [`Form::Paper`].
    Paper {
        /// Parameter λ: slope of the surface s = ė + λ·e, 1/s, and also the gain of the root term.
        lambda: R,
        /// Gain of the integral times the period, W·h, V.
        w_step: R,
    },
    /// The law of [`Form::Twisting`] or [`Form::TwistingWithLinear`].
    Twisting {
        /// Slope λ of the sliding surface s = ė + λ·e, 1/s.
        lambda: R,
        /// Super-twisting law that acts on s, rad/s.
        twist: Twist<R>,
        /// Growth of the integral per period and error, ki·h, 1/rad; 0 for [`Form::Twisting`].
        ki_step: R,
    },
    /// PID law: effort kp·e + ki·∫e + kd·ė.
    Pid {
        /// Proportional gain, 1/rad.
        kp: R,
        /// Gain of the integral times the period, ki·h, 1/rad.
        ki_step: R,
        /// Derivative gain, s/rad.
        kd: R,
    },
}

impl<R: Real> Feedback<R> {
    /// Returns the effort that is added to the integral `v`, and the growth of the integral, for an
    /// angle error `e` (rad) that changes at `rate` (rad/s).
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

    /// Returns whether the integral stops growing while the effort is clamped. The paper's law has
    /// no such anti-windup.
    pub const fn has_anti_windup(&self) -> bool {
        !matches!(self, Self::Paper { .. })
    }
}
