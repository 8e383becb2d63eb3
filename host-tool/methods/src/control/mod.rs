//! Control laws in any floating-point arithmetic, behind one trait.
//!
//! Submodules: `twist` (discretizations of the super-twisting law), `feedback` (these, the paper's
//! law and PID as feedback of an angle), `derivative` (differentiators), `delay` (predictors),
//! `adaptation`, `controller` (any feedback with any of these parts), `parameters` (bounds for a
//! search), `integrator` (the disturbed integrator on which the discretizations are compared).
//! Plants, setpoint tracks, the wearer's model and fixed point belong to other modules. Input:
//! reference and measured angle once per period. Output: an effort.

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

/// Inputs of a law in one period. Angles are in radians, flexion positive.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Input<R> {
    /// Reference angle now, after hold or extrapolation.
    pub target: R,
    /// Rate of the reference according to the setpoint track, rad/s; 0 while holding.
    pub target_rate: R,
    /// Latest measured angle.
    pub measured: R,
    /// Effort of the nominal wearer's inverse model for this reference, −1…1, with the lead that
    /// the law requests ([`Controller::lead_s`]); 0 without a model.
    pub feed_forward: R,
}

/// A control law with its gains and its state, for a fixed period.
pub trait Law<R: Real> {
    /// Advances by one period and returns the effort as a fraction of the range from motor
    /// threshold (0) to the wearer's maximum (flexors +1, extensor −1). The caller clamps it beyond
    /// ±1, for which the law must be prepared (anti-windup).
    fn step(&mut self, input: &Input<R>) -> R;
}

/// Returns the sign of `x`: −1, 0 or 1.
fn sign<R: Real>(x: R) -> R {
    if x > R::ZERO {
        R::ONE
    } else if x < R::ZERO {
        -R::ONE
    } else {
        R::ZERO
    }
}

/// Returns `x` clamped to ±`bound`.
fn bounded<R: Real>(x: R, bound: R) -> R {
    within(x, -bound, bound)
}

/// Returns `x` clamped to `low`…`high`.
fn within<R: Real>(x: R, low: R, high: R) -> R {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}
