//! The equations in the integrators' units, and what a method is.

use super::Arithmetic;
use super::arithmetic::UNIT_US;
use firmware::muscle::CalciumForceSpec;

/// Constants of one muscle; time in units of [`UNIT_US`], force in N.
#[derive(Clone, Copy, Debug)]
pub struct Muscle<R> {
    /// A, N per unit of time.
    pub a: R,
    /// K.
    pub k: R,
    /// 1/τc.
    pub rate_c: R,
    /// τ1.
    pub tau1: R,
    /// τ2.
    pub tau2: R,
    /// K·τ1 and τ1 + τ2.
    over: [R; 2],
}

/// What eq. (3) of Lee 2020 has at some C: dF/dt = source − rate·F.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<R> {
    /// A·x, N per unit of time.
    pub source: R,
    /// τ.
    pub tau: R,
    /// 1/τ.
    pub rate: R,
}

impl<R: Arithmetic> Point<R> {
    /// Without calcium, of a muscle that nothing asks.
    pub const NONE: Self = Self {
        source: R::ZERO,
        tau: R::ONE,
        rate: R::ONE,
    };

    /// dF/dt, N per unit of time.
    pub fn slope(&self, f: R) -> R {
        self.source - self.rate * f
    }

    /// `time` over τ.
    pub fn time_over_tau(&self, time: R) -> R {
        if R::FLOATING {
            time * self.rate
        } else {
            time / self.tau
        }
    }
}

impl<R: Arithmetic> Muscle<R> {
    /// Each constant to the nearest number of this arithmetic. `spec` need not
    /// be one that the device takes; time constants must be above zero.
    pub fn new(spec: &CalciumForceSpec) -> Self {
        let units = |us: u32| f64::from(us) / UNIT_US;
        let (k, tau1, tau2) = (
            f64::from(spec.k_micro) * 1e-6,
            units(spec.tau1_us),
            units(spec.tau2_us),
        );
        Self {
            a: R::from_f64(f64::from(spec.a_mn_per_s) * 1e-9 * UNIT_US),
            k: R::from_f64(k),
            rate_c: R::from_f64(1.0 / units(spec.tau_c_us)),
            tau1: R::from_f64(tau1),
            tau2: R::from_f64(tau2),
            over: [R::from_f64(k * tau1), R::from_f64(tau1 + tau2)],
        }
    }

    /// x = C/(K + C), the share of cross-bridges bound.
    pub fn bound_fraction(&self, c: R) -> R {
        c / (self.k + c)
    }

    /// τ1 + τ2·x.
    pub fn tau(&self, x: R) -> R {
        self.tau1 + self.tau2 * x
    }

    /// x, τ and 1/τ at `c`: in floating point by one division, as τ is (τ1·K +
    /// (τ1 + τ2)·C)/(K + C); fixed point has no place for such a product's inverse.
    #[inline(always)]
    pub fn point(&self, c: R) -> Point<R> {
        if R::FLOATING {
            let [fixed, all] = self.over;
            let (lower, upper) = (self.k + c, fixed + all * c);
            let both = R::ONE / (lower * upper);
            let (x_over, tau_over) = (upper * both, lower * both);
            return Point {
                source: self.a * (c * x_over),
                tau: upper * x_over,
                rate: lower * tau_over,
            };
        }
        let x = self.bound_fraction(c);
        let tau = self.tau(x);
        Point {
            source: self.a * x,
            tau,
            rate: R::ONE / tau,
        }
    }

    /// What is left of C after `time`.
    pub fn calcium_decay(&self, time: R) -> R {
        (-(time * self.rate_c)).exp()
    }

    /// (dC/dt, dF/dt) between pulses: Lee 2020, eqs. (2) and (3).
    pub fn slope(&self, s: State<R>) -> State<R> {
        let x = self.bound_fraction(s.c);
        State {
            c: -(s.c * self.rate_c),
            f: self.a * x - s.f / self.tau(x),
        }
    }
}

/// C, in pulses, and F, in N; or their slopes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<R> {
    /// C.
    pub c: R,
    /// F.
    pub f: R,
}

impl<R: Arithmetic> State<R> {
    /// Self + `time` · `slope`.
    pub fn add_scaled(self, time: R, slope: Self) -> Self {
        Self {
            c: self.c + time * slope.c,
            f: self.f + time * slope.f,
        }
    }
}

/// Where a muscle is, in a method's own terms.
pub trait Place: Copy {
    /// What it is told in.
    type Number: Arithmetic;
    /// C, in pulses.
    fn calcium(&self) -> Self::Number;
    /// F, N.
    fn force(&self) -> Self::Number;
}

impl<R: Arithmetic> Place for State<R> {
    type Number = R;
    fn calcium(&self) -> R {
        self.c
    }
    fn force(&self) -> R {
        self.f
    }
}

/// A method's number.
pub type NumberOf<S> = <<S as Scheme>::State as Place>::Number;

/// One method: how a muscle gets over a step without a pulse.
pub trait Scheme {
    /// Where a muscle is.
    type State: Place;
    /// What a step of some length needs that does not depend on the state.
    type Factors: Copy;

    /// Of a muscle whose whole steps will be `step_us` microseconds.
    fn new(spec: &CalciumForceSpec, step_us: u32) -> Self;
    /// Of a step of `us` microseconds.
    fn factors(&self, us: u32) -> Self::Factors;
    /// A muscle with this C and this force, N.
    fn state_at(&self, c: NumberOf<Self>, f: NumberOf<Self>) -> Self::State;
    /// Over one step.
    fn step(&self, factors: &Self::Factors, state: &mut Self::State);
}

/// A method whose steps can be read inside: C is exact at any time and dF/dt known
/// at both ends, so that a cubic gives F.
pub trait Dense: Scheme {
    /// The constants.
    fn muscle(&self) -> &Muscle<NumberOf<Self>>;
    /// dF/dt, N per unit of time.
    fn slope(&self, state: &Self::State) -> NumberOf<Self>;
}
