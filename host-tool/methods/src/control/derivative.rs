//! Differentiators: the rate of an angle from its samples.

use super::super::real::Real;
use super::sign;
use super::twist::resolvent_root;

/// Kind of differentiator, and the signal whose rate it computes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DerivativeKind {
    /// Pseudo-differentiation of the error, g·s/(s + g), as in Hamana 2022.
    PseudoOfError,
    /// Pseudo-differentiation of the measured angle. The rate of the reference is taken from the
    /// setpoints.
    Pseudo,
    /// First-order robust exact differentiator of the measured angle, in implicit form (Levant,
    /// Automatica 34 (1998)).
    RobustExact,
    /// Second-order robust exact differentiator of the measured angle, which also models a constant
    /// acceleration.
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

/// A differentiator with its state, for a fixed sample period. For the first sample it returns 0.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Differentiator<R> {
    /// Pseudo-differentiation: y ← E·y + (1 − E)/h·Δx with E = e^(−2π·cutoff·h), which is exact for
    /// a ramp.
    Pseudo {
        /// Decay factor E per period.
        pole: R,
        /// Gain (1 − E)/h, 1/s.
        gain: R,
        /// Previous sample; `None` before the first.
        before: Option<R>,
        /// Latest output y, per second.
        rate: R,
    },
    /// First-order robust exact differentiator: z0' = −λ1·√|z0 − x|·sgn(z0 − x) + z1 and z1' =
    /// −λ2·sgn(z0 − x), both by backward Euler.
    RobustExact {
        /// Sample period h, s.
        h: R,
        /// Product h·λ1.
        a: R,
        /// Product h²·λ2.
        c: R,
        /// States z0 and z1; `None` before the first sample.
        z: Option<(R, R)>,
    },
    /// Second-order robust exact differentiator. It has a third state, and the powers of |z0 − x|
    /// are 2/3, 1/3 and 0.
    RobustExactSecondOrder {
        /// Sample period h, s.
        h: R,
        /// Products h·λ2, h²·λ1 and h³·λ0. They are the coefficients of q², q and 1 in the equation
        /// for q, where q³ = |z0 − x|.
        coefficients: [R; 3],
        /// States z0, z1 and z2; `None` before the first sample.
        z: Option<[R; 3]>,
    },
}

impl<R: Real> Differentiator<R> {
    /// Creates a pseudo-differentiator. `cutoff_hz` is its cutoff frequency, Hz, and `h` the sample
    /// period, s.
    pub fn pseudo(cutoff_hz: R, h: R) -> Self {
        let pole = (-(R::from_f64(core::f64::consts::TAU) * cutoff_hz * h)).exp();
        Self::Pseudo {
            pole,
            gain: (R::ONE - pole) / h,
            before: None,
            rate: R::ZERO,
        }
    }

    /// Creates a first-order robust exact differentiator with sample period `h`, s. `bound` is the
    /// largest acceleration of the signal, rad/s². The gains are λ1 = 1.5·√bound and λ2 = 1.1·bound
    /// (Levant 1998).
    pub fn robust_exact(bound: R, h: R) -> Self {
        Self::RobustExact {
            h,
            a: h * R::from_f64(1.5) * bound.sqrt(),
            c: h * h * R::from_f64(1.1) * bound,
            z: None,
        }
    }

    /// Creates a second-order robust exact differentiator with sample period `h`, s. `bound` is the
    /// largest jerk of the signal, rad/s³. The gains are λ2 = 2·bound^⅓, λ1 = 2.12·bound^⅔ and λ0 =
    /// 1.1·bound (Levant 2003, in the non-recursive form).
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

    /// Takes the next sample of the signal and returns the signal's rate, per second.
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

/// Returns the q ≥ 0 with q³ + a·q² + b·q + c = size; 0 if size ≤ c.
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
