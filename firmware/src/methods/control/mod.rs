//! Control laws in any arithmetic, behind one trait.
//!
//! In: the wanted and the measured angle once per period. Out: an effort.

use super::real::Real;

/// What a law is given once per period. Angles in radians, flexion positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Input<R> {
    /// The angle wanted now, after hold or extrapolation.
    pub target: R,
    /// Its rate as the setpoint track knows it, rad/s; 0 while holding.
    pub target_rate: R,
    /// The angle measured last.
    pub measured: R,
}

/// A control law with its gains and its memory, for one fixed period.
pub trait Law<R: Real> {
    /// One period further. The answer is a fraction of the way from motor
    /// threshold (0) to the wearer's maximum (flexors +1, extensor −1); beyond
    /// ±1 it is clamped by the caller, which the law must expect (anti-windup).
    fn step(&mut self, input: &Input<R>) -> R;
}
