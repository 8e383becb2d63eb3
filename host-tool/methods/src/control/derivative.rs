//! Differentiators: the rate of an angle from its samples.

use super::super::real::Real;
use super::sign;
use super::twist::resolvent_root;

/// Kind of differentiator, and the signal that it differentiates.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DerivativeKind {
    /// Pseudo-differentiation of the error, g·s/(s + g), as in the paper.
    PseudoOfError,
    /// Pseudo-differentiation of the measured angle; the rate of the reference is that of the
    /// setpoint track.
    Pseudo,
    /// Robust exact differentiator of the measured angle, first order (Levant, Automatica 34
    /// (1998)), implicit.
    RobustExact,
    /// Robust exact differentiator of second order, which also models a constant acceleration.
    RobustExactSecondOrder,
}

impl DerivativeKind {
    pub const ALL: [Self; 4] = [
        Self::PseudoOfError,
        Self::Pseudo,
        Self::RobustExact,
        Self::RobustExactSecondOrder,
    ];
}

/// A differentiator for one period, with its state. The first sample gives 0.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Differentiator<R> {
    /// y ← E·y + (1 − E)/h·Δx, E = e^(−2π·cutoff·h): exact for a ramp.
    Pseudo {
        /// Decay factor E per period.
        pole: R,
        /// Gain (1 − E)/h, 1/s.
        gain: R,
        /// Previous sample.
        before: Option<R>,
        /// Output y.
        rate: R,
    },
    /// z0' = −λ1·√|z0 − x|·sgn + z1, z1' = −λ2·sgn(z0 − x), all by backward Euler.
    RobustExact {
        /// Sample period h, s.
        h: R,
        /// Product h·λ1.
        a: R,
        /// Product h²·λ2.
        c: R,
        /// State z0, z1; `None` before the first sample.
        z: Option<(R, R)>,
    },
    /// The same with one more state and the powers 2/3, 1/3, 0.
    RobustExactSecondOrder {
        /// Sample period h, s.
        h: R,
        /// h·λ2, h²·λ1, h³·λ0: coefficients of q², q and 1 for q³ = |z0 − x|.
        coefficients: [R; 3],
        /// State z0, z1, z2; `None` before the first sample.
        z: Option<[R; 3]>,
    },
}

impl<R: Real> Differentiator<R> {
    /// Creates a pseudo-differentiator with a cutoff in Hz and the period h in s.
    pub fn pseudo(cutoff_hz: R, h: R) -> Self {
        let pole = (-(R::from_f64(core::f64::consts::TAU) * cutoff_hz * h)).exp();
        Self::Pseudo {
            pole,
            gain: (R::ONE - pole) / h,
            before: None,
            rate: R::ZERO,
        }
    }

    /// Creates a robust exact differentiator of first order, for accelerations up to `bound`,
    /// rad/s²: λ1 = 1.5·√bound, λ2 = 1.1·bound (Levant 1998).
    pub fn robust_exact(bound: R, h: R) -> Self {
        Self::RobustExact {
            h,
            a: h * R::from_f64(1.5) * bound.sqrt(),
            c: h * h * R::from_f64(1.1) * bound,
            z: None,
        }
    }

    /// Creates a robust exact differentiator of second order, for jerks up to `bound`, rad/s³: λ2 =
    /// 2·bound^⅓, λ1 = 2.12·bound^⅔, λ0 = 1.1·bound (Levant 2003, in the non-recursive form).
    pub fn robust_exact_second_order(bound: R, h: R) -> Self {
        let third = (bound.ln() / R::from_f64(3.0)).exp();
        Self::RobustExactSecondOrder {
            h,
            coefficients: [
                h * R::from_f64(2.0) * third,
                h * h * R::from_f64(2.12) * third * third,
                h * h * h * R::from_f64(1.1) * bound,
            ],
            z: None,
        }
    }

    /// Takes the next sample and returns the rate.
    pub fn step(&mut self, x: R) -> R {
        match self {
            Self::Pseudo {
                pole,
                gain,
                before,
                rate,
            } => {
                let change = x - before.replace(x).unwrap_or(x);
                *rate = *pole * *rate + *gain * change;
                *rate
            }
            Self::RobustExact { h, a, c, z } => {
                let (z0, z1) = z.unwrap_or((x, R::ZERO));
                // The next e satisfies e + a·√|e|·sgn e + c·sgn e ∋ z0 + h·z1 − x.
                let ahead = z0 + *h * z1 - x;
                let root = resolvent_root(ahead.abs(), R::ONE, *a, *c);
                let e = root * root * sign(ahead);
                // The value of c·sgn e is all of `ahead` if the next e is 0.
                let step = if root > R::ZERO {
                    *c * sign(ahead)
                } else {
                    ahead
                };
                let z1 = z1 - step / *h;
                *z = Some((x + e, z1));
                z1
            }
            Self::RobustExactSecondOrder { h, coefficients, z } => {
                let [z0, z1, z2] = z.unwrap_or([x, R::ZERO, R::ZERO]);
                let ahead = z0 + *h * z1 + *h * *h * z2 - x;
                let [_, linear, constant] = *coefficients;
                let q = cubic_root(ahead.abs(), *coefficients);
                let side = sign(ahead);
                let step = if q > R::ZERO { constant * side } else { ahead };
                let z2 = z2 - step / (*h * *h);
                let z1 = z1 + *h * z2 - linear * q * side / *h;
                *z = Some([x + q * q * q * side, z1, z2]);
                z1
            }
        }
    }
}

/// Returns q >= 0 with q³ + a·q² + b·q + c = size, or 0 for size <= c.
fn cubic_root<R: Real>(size: R, [a, b, c]: [R; 3]) -> R {
    let rest = size - c;
    if rest <= R::ZERO {
        return R::ZERO;
    }
    // The function is convex and rising: Newton's method from above decreases without crossing.
    // Each of q³, a·q² and b·q alone is below rest, so the smaller of two bounds is above the root.
    let (linear, square) = (rest / b, (rest / a).sqrt());
    let mut q = if linear < square { linear } else { square };
    for _ in 0..40 {
        let value = ((q + a) * q + b) * q - rest;
        let slope = (R::from_f64(3.0) * q + R::from_f64(2.0) * a) * q + b;
        q = q - value / slope;
    }
    if q > R::ZERO { q } else { R::ZERO }
}
