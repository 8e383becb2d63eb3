//! Laws as feedback of an angle's error: what to add to the integral now, and
//! by how much it grows.

use super::super::real::Real;
use super::sign;
use super::twist::{Discretization, Push, Twist};

/// Which law.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Form {
    /// Hamana 2022 (4), (5) with the sign corrected, in degrees and volts, no
    /// anti-windup.
    Paper,
    /// Super-twisting in radians and fractions of the wearer's range.
    Twisting(Discretization),
    /// The proper implicit form with a term k3·s and, in the integral, one of
    /// the error: what super-twisting lacks far from and close to its surface.
    /// b is [`NOMINAL_GAIN`].
    TwistingWithLinear,
    /// The baseline.
    Pid,
}

impl Form {
    /// All of them.
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

    /// A name for tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Twisting(discretization) => discretization.name(),
            Self::TwistingWithLinear => "proper with linear",
            Self::Pid => "pid",
        }
    }
}

/// Volts from threshold to maximum of the paper's participant P at one-point
/// electrode A (Hamana 2022, table 7: 24…28 V), which turn the paper's effort
/// into a fraction.
pub const PAPER_RANGE_V: f64 = 4.0;

/// b where it is no searched number, rad/s²: the order of what searches find. It
/// only sets how wide the boundary layer of the implicit form is.
pub const NOMINAL_GAIN: f64 = 100.0;

/// A law with its gains for one period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Feedback<R> {
    /// See [`Form::Paper`].
    Paper {
        /// λ, both of the surface (1/s) and of the root.
        lambda: R,
        /// W·h, V.
        w_step: R,
    },
    /// See [`Form::Twisting`].
    Twisting {
        /// λ of the surface s = ė + λ·e, 1/s.
        lambda: R,
        /// Of s in rad/s.
        twist: Twist<R>,
        /// ki·h, 1/rad: growth of the integral with the error itself.
        ki_step: R,
    },
    /// kp·e + ki·∫e + kd·ė.
    Pid {
        /// 1/rad.
        kp: R,
        /// ki·h, 1/rad.
        ki_step: R,
        /// s/rad.
        kd: R,
    },
}

impl<R: Real> Feedback<R> {
    /// The answer to an error e (rad) of rate ė (rad/s) while the integral is
    /// `v`.
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

    /// Whether the integral rests while the effort is clamped. The paper's does
    /// not.
    pub const fn has_anti_windup(&self) -> bool {
        !matches!(self, Self::Paper { .. })
    }
}
