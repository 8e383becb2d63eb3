//! The equations in the integrators' units, and the interface of a method.

use super::Arithmetic;
use super::arithmetic::UNIT_US;
use firmware::muscle::CalciumForceSpec;

/// Constants of one muscle; time is in units of [`UNIT_US`], force in N.
#[derive(Clone, Copy, Debug)]
pub struct Muscle<R> {
    /// A, N per unit of time.
    pub a: R,
    /// Half-saturation constant K of binding, in pulses.
    pub k: R,
    /// Decay rate 1/τc of C.
    pub rate_c: R,
    /// Time constant τ1 of force without bound cross-bridges.
    pub tau1: R,
    /// Additional time constant τ2 with bound cross-bridges.
    pub tau2: R,
    /// K·τ1 and τ1 + τ2.
    over: [R; 2],
}

/// Coefficients of eq. (3) of Lee 2020 at some C: dF/dt = source − rate·F.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<R> {
    /// Source term A·x, N per unit of time.
    pub source: R,
    /// Time constant τ of relaxation.
    pub tau: R,
    /// Rate of relaxation, 1/τ.
    pub rate: R,
}

impl<R: Arithmetic> Point<R> {
    /// Placeholder for a rule that does not evaluate the ends of steps.
    pub const NONE: Self = Self {
        source: R::ZERO,
        tau: R::ONE,
        rate: R::ONE,
    };

    /// Returns dF/dt, N per unit of time.
    pub fn slope(&self, f: R) -> R {
        self.source - self.rate * f
    }

    /// Returns `time` over τ.
    pub fn time_over_tau(&self, time: R) -> R {
        if R::FLOATING {
            time * self.rate
        } else {
            time / self.tau
        }
    }
}

impl<R: Arithmetic> Muscle<R> {
    /// Rounds each constant to the nearest number of this arithmetic. `spec` may be outside the
    /// ranges of the device; time constants must be above zero.
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

    /// Returns x = C/(K + C), the share of bound cross-bridges.
    pub fn bound_fraction(&self, c: R) -> R {
        c / (self.k + c)
    }

    /// Returns the time constant τ1 + τ2·x.
    pub fn tau(&self, x: R) -> R {
        self.tau1 + self.tau2 * x
    }

    /// Returns source, τ and 1/τ at `c`. In floating point one division suffices, as τ is (τ1·K +
    /// (τ1 + τ2)·C)/(K + C); in fixed point the inverse of such a product would overflow.
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

    /// Returns the remaining share of C after `time`.
    pub fn calcium_decay(&self, time: R) -> R {
        (-(time * self.rate_c)).exp()
    }

    /// Returns (dC/dt, dF/dt) between pulses: Lee 2020, eqs. (2) and (3).
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
    /// Calcium state C, in pulses.
    pub c: R,
    /// Force F, N.
    pub f: R,
}

impl<R: Arithmetic> State<R> {
    /// Returns self + `time` · `slope`.
    pub fn add_scaled(self, time: R, slope: Self) -> Self {
        Self {
            c: self.c + time * slope.c,
            f: self.f + time * slope.f,
        }
    }
}

/// State of a muscle in the representation of a method.
pub trait Place: Copy {
    /// Number type of the values.
    type Number: Arithmetic;
    /// Returns C, in pulses.
    fn calcium(&self) -> Self::Number;
    /// Returns F, N.
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

/// Number type of a method.
pub type NumberOf<S> = <<S as Scheme>::State as Place>::Number;

/// A method that integrates a muscle over a step without a pulse.
pub trait Scheme {
    /// State of the muscle in the representation of the method.
    type State: Place;
    /// Constants of a step of one length, independent of the state.
    type Factors: Copy;

    /// Prepares the method for a muscle; its whole steps last `step_us` microseconds.
    fn new(spec: &CalciumForceSpec, step_us: u32) -> Self;
    /// Computes the constants of a step of `us` microseconds.
    fn factors(&self, us: u32) -> Self::Factors;
    /// Returns the state of a muscle with this C and this force, N.
    fn state_at(&self, c: NumberOf<Self>, f: NumberOf<Self>) -> Self::State;
    /// Advances the state by one step.
    fn step(&self, factors: &Self::Factors, state: &mut Self::State);
}

/// A method whose steps can be read inside: C is exact at any time and dF/dt is known at both ends,
/// so that a cubic gives F.
pub trait Dense: Scheme {
    /// Returns the constants of the muscle.
    fn muscle(&self) -> &Muscle<NumberOf<Self>>;
    /// Returns dF/dt, N per unit of time.
    fn slope(&self, state: &Self::State) -> NumberOf<Self>;
}
