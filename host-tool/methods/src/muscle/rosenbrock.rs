//! Exponential Rosenbrock methods on the pair (C, F): eqs. (2) and (3) are linearized at the
//! beginning of a step, the linear part is solved exactly, and the rest is integrated
//! (Hochbruck, Ostermann & Schweitzer, SIAM Journal on Numerical Analysis 47, 2009, section 5).
//!
//! C is linear and thus exact. With a = −h/τc, b = −h/τ and the slope g of dF/dt over C, all at the
//! beginning, the linear part moves F by h·(φ1(b)·dF/dt + a·C·g·φ1\[a, b\]), where φ1\[a, b\] is the
//! divided difference of φ1. That is the method of order 2 (exponential Rosenbrock–Euler). `exprb32`
//! of order 3 adds 2h·φ3(b)·D, with the change D of the nonlinear rest over this step.

use super::Arithmetic;
use super::scheme::{Dense, Muscle, NumberOf, Place, Point, Scheme};
use firmware::muscle::CalciumForceSpec;

/// A muscle that the exponential Rosenbrock method of order `ORDER`, 2 or 3, integrates.
#[derive(Clone, Copy, Debug)]
pub struct Rosenbrock<R, const ORDER: u32> {
    muscle: Muscle<R>,
}

/// C and F, with the coefficients of the equation of F at this C and the share of bound
/// cross-bridges.
#[derive(Clone, Copy, Debug)]
pub struct LinearState<R> {
    c: R,
    f: R,
    here: Point<R>,
    bound: R,
}

impl<R: Arithmetic> Place for LinearState<R> {
    type Number = R;
    fn calcium(&self) -> R {
        self.c
    }
    fn force(&self) -> R {
        self.f
    }
}

/// Constants that depend only on the length of a step.
#[derive(Clone, Copy, Debug)]
pub struct LinearFactors<R> {
    time: R,
    /// Exponent a = −h/τc of C.
    a: R,
    /// Factor by which C decays.
    left: R,
    at_a: Phi<R>,
}

/// The functions φ1, φ2, φ3 at one z: φ1(z) = (e^z − 1)/z, and each next is (φ(z) − φ(0))/z.
#[derive(Clone, Copy, Debug)]
struct Phi<R>([R; 3]);

impl<R: Arithmetic> Phi<R> {
    /// Computes the three functions at z ≤ 0: from the series of φ3 down to z = −1, whose ninth
    /// term is below 3e-9, and from the exponential beyond it.
    #[inline(always)]
    fn at(z: R) -> Self {
        const FACTORIALS: [f64; 9] = [
            6.0,
            24.0,
            120.0,
            720.0,
            5_040.0,
            40_320.0,
            362_880.0,
            3_628_800.0,
            39_916_800.0,
        ];
        let half = R::from_f64(0.5);
        if z >= -R::ONE {
            let terms = const { FACTORIALS }.into_iter().rev();
            let third = terms.fold(R::ZERO, |sum, n| sum * z + R::from_f64(1.0 / n));
            let second = half + z * third;
            return Self([R::ONE + z * second, second, third]);
        }
        let over = R::ONE / z;
        let first = (z.exp() - R::ONE) * over;
        let second = (first - R::ONE) * over;
        Self([first, second, (second - half) * over])
    }

    /// Returns φ1', the first derivative.
    fn slope(&self) -> R {
        self.0[0] - self.0[1]
    }

    /// Returns φ1'', the second derivative.
    fn bend(&self) -> R {
        self.0[0] - self.0[1] - self.0[1] + self.0[2] + self.0[2]
    }

    /// Returns the divided difference of φ1 between the places of `self` and `other`, which are
    /// `apart`. Where the difference would cancel, below 1/4, it is the mean of the derivative by
    /// the trapezoidal rule with corrected ends, within apart⁴/4300.
    #[inline(always)]
    fn divided_difference(&self, other: &Self, apart: R) -> R {
        if apart.abs() >= R::from_f64(0.25) {
            return (self.0[0] - other.0[0]) / apart;
        }
        let mean = R::from_f64(0.5) * (self.slope() + other.slope());
        mean - apart * (R::from_f64(1.0 / 12.0) * (self.bend() - other.bend()))
    }
}

impl<R: Arithmetic, const ORDER: u32> Scheme for Rosenbrock<R, ORDER> {
    type State = LinearState<R>;
    type Factors = LinearFactors<R>;

    fn new(spec: &CalciumForceSpec, _: u32) -> Self {
        const { assert!(matches!(ORDER, 2 | 3)) };
        Self {
            muscle: Muscle::new(spec),
        }
    }
    fn factors(&self, us: u32) -> LinearFactors<R> {
        let time = R::from_micros(us);
        let a = -(time * self.muscle.rate_c);
        LinearFactors {
            time,
            a,
            left: a.exp(),
            at_a: Phi::at(a),
        }
    }
    #[inline(always)]
    fn state_at(&self, c: NumberOf<Self>, f: NumberOf<Self>) -> LinearState<R> {
        let (here, bound) = self.muscle.point_and_share(c);
        LinearState { c, f, here, bound }
    }
    #[inline(always)]
    fn step(&self, step: &LinearFactors<R>, state: &mut LinearState<R>) {
        let LinearState { c, f, here, bound } = *state;
        let time = step.time;
        let b = -here.time_over_tau(time);
        let at_b = Phi::at(b);
        // C·g = x(1 − x)·(A + F·τ2/τ²); the product τ2·x/τ is below 1.
        let free = R::ONE - bound;
        let growth = f * here.rate * (self.muscle.tau2 * bound * here.rate);
        let gradient = free * (here.source + growth);
        let difference = step.at_a.divided_difference(&at_b, step.a - b);
        let rise = at_b.0[0] * here.slope(f) + step.a * (gradient * difference);
        let mut end = self.state_at(c * step.left, f + time * rise);
        if ORDER == 3 {
            let rest = end.here.source
                - here.source
                - end.f * (end.here.rate - here.rate)
                - gradient * (step.left - R::ONE);
            end.f = end.f + (time + time) * (at_b.0[2] * rest);
        }
        *state = end;
    }
}

impl<R: Arithmetic, const ORDER: u32> Dense for Rosenbrock<R, ORDER> {
    fn muscle(&self) -> &Muscle<R> {
        &self.muscle
    }
    fn slope(&self, state: &LinearState<R>) -> R {
        state.here.slope(state.f)
    }
}
