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
}

impl<R: Arithmetic> Muscle<R> {
    /// Each constant to the nearest number of this arithmetic. `spec` need not
    /// be one that the device takes; time constants must be above zero.
    pub fn new(spec: &CalciumForceSpec) -> Self {
        let units = |us: u32| f64::from(us) / UNIT_US;
        Self {
            a: R::of(f64::from(spec.a_mn_per_s) * 1e-9 * UNIT_US),
            k: R::of(f64::from(spec.k_micro) * 1e-6),
            rate_c: R::of(1.0 / units(spec.tau_c_us)),
            tau1: R::of(units(spec.tau1_us)),
            tau2: R::of(units(spec.tau2_us)),
        }
    }

    /// x = C/(K + C), the share of cross-bridges bound.
    pub fn bound(&self, c: R) -> R {
        c / (self.k + c)
    }

    /// τ1 + τ2·x.
    pub fn tau(&self, x: R) -> R {
        self.tau1 + self.tau2 * x
    }

    /// What is left of C after `time`.
    pub fn left(&self, time: R) -> R {
        (-(time * self.rate_c)).exp()
    }

    /// (dC/dt, dF/dt) between pulses: Lee 2020, eqs. (2) and (3).
    pub fn slope(&self, s: State<R>) -> State<R> {
        let x = self.bound(s.c);
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
    pub fn moved(self, time: R, slope: Self) -> Self {
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
    /// Without calcium and force.
    const REST: Self;
    /// A pulse: C grows by 1.
    fn pulse(&mut self);
    /// C, in pulses.
    fn calcium(&self) -> Self::Number;
    /// F, N.
    fn force(&self) -> Self::Number;
}

impl<R: Arithmetic> Place for State<R> {
    type Number = R;
    const REST: Self = Self {
        c: R::ZERO,
        f: R::ZERO,
    };
    fn pulse(&mut self) {
        self.c = self.c + R::ONE;
    }
    fn calcium(&self) -> R {
        self.c
    }
    fn force(&self) -> R {
        self.f
    }
}

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
    /// Over one step.
    fn step(&self, factors: &Self::Factors, state: &mut Self::State);
}
