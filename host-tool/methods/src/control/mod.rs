//! Control laws in any floating-point arithmetic, behind one trait.
//!
//! Lives here: `twist` (the super-twisting law's discretizations), `feedback`
//! (those, the paper's law and PID as feedback of an angle), `derivative`
//! (differentiators), `delay` (predictors), `adaptation`, `controller` (any
//! feedback with any of these parts), `parameters` (its bounds, for a search),
//! `integrator` (the disturbed integrator the discretizations are judged on).
//! Not here: plants, setpoint tracks, the wearer's model, fixed point.
//! In: the wanted and the measured angle once per period. Out: an effort.

pub mod adaptation;
pub mod controller;
pub mod delay;
pub mod derivative;
pub mod feedback;
pub mod integrator;
pub mod parameters;
pub mod twist;

pub use controller::{AddOns, Controller, DelayCompensation};
pub use derivative::DerivativeKind;
pub use feedback::Form;
pub use parameters::{Parameter, ParameterError};

use super::real::Real;

/// What a law is given once per period. Angles in radians, flexion positive.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Input<R> {
    /// The angle wanted now, after hold or extrapolation.
    pub target: R,
    /// Its rate as the setpoint track knows it, rad/s; 0 while holding.
    pub target_rate: R,
    /// The angle measured last.
    pub measured: R,
    /// What the nominal wearer's inverse model asks for this target, −1…1, with
    /// the lead that the law asked for ([`Controller::lead_s`]); 0 if there is no
    /// such model.
    pub feed_forward: R,
}

/// A control law with its gains and its memory, for one fixed period.
pub trait Law<R: Real> {
    /// One period further. The answer is a fraction of the way from motor
    /// threshold (0) to the wearer's maximum (flexors +1, extensor −1); beyond
    /// ±1 it is clamped by the caller, which the law must expect (anti-windup).
    fn step(&mut self, input: &Input<R>) -> R;
}

/// −1, 0 or 1.
fn sign<R: Real>(x: R) -> R {
    if x > R::ZERO {
        R::ONE
    } else if x < R::ZERO {
        -R::ONE
    } else {
        R::ZERO
    }
}

/// `x` within ±`bound`.
fn bounded<R: Real>(x: R, bound: R) -> R {
    within(x, -bound, bound)
}

/// `x` within `low`…`high`.
fn within<R: Real>(x: R, low: R, high: R) -> R {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}
