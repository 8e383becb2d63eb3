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
    /// Reference angle for this period, held or extrapolated from the latest setpoint.
    pub target: R,
    /// Rate of the reference according to the setpoints, rad/s; 0 while the reference is held.
    pub target_rate: R,
    /// Latest angle that the sensor measured.
    pub measured: R,
    /// Effort for this reference by the inverse model of the nominal wearer, −1…1; 0 without a
    /// model. Its reference is ahead of the present by the time that the controller requests
    /// ([`Controller::lead_s`]).
    pub feed_forward: R,
}

/// A control law with its gains and its state, for a fixed control period.
pub trait Law<R: Real> {
    /// Advances the law by one period and returns the effort: −1 is the extensor's maximum, 0 the
    /// motor threshold, and 1 the flexors' maximum. The caller clamps an effort beyond ±1, and the
    /// law must be prepared for that (anti-windup).
    fn step(&mut self, input: &Input<R>) -> R;
}

/// Returns the sign of `x` as −1, 0 or 1; 0 only for 0.
fn sign<R: Real>(x: R) -> R {
    if x > R::ZERO {
        R::ONE
    } else if x < R::ZERO {
        -R::ONE
    } else {
        R::ZERO
    }
}

/// Returns `x` clamped to the range −`bound` to `bound`.
fn bounded<R: Real>(x: R, bound: R) -> R {
    within(x, -bound, bound)
}

/// Returns `x` clamped to the range `low` to `high`.
fn within<R: Real>(x: R, low: R, high: R) -> R {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}
