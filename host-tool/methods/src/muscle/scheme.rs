//! The equations in the integrators' units, and the interface of a method.

use super::Arithmetic;
use super::arithmetic::UNIT_US;
use firmware::muscle::CalciumForceSpec;

/// Parameters of one muscle. Time is in units of [`UNIT_US`], force in N.
#[derive(Clone, Copy, Debug)]
pub struct Muscle<R> {
    /// Parameter A: force that fully bound cross-bridges would add per unit of time, N.
    pub a: R,
    /// Half-saturation constant K: the C at which half of the cross-bridges are bound.
    pub k: R,
    /// Decay rate 1/τc of C, per unit of time.
    pub rate_c: R,
    /// Time constant τ1 with which the force decays while no cross-bridges are bound.
    pub tau1: R,
    /// Time constant τ2, which is added to τ1 in proportion to the bound cross-bridges.
    pub tau2: R,
    /// Products and sums that [`Self::point`] needs: K·τ1, and τ1 + τ2.
    over: [R; 2],
}

/// Coefficients of eq. (3) of Lee 2020 at one value of C: dF/dt = source − rate·F.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point<R> {
    /// Source term A·x, N per unit of time.
    pub source: R,
    /// Time constant τ with which the force decays.
    pub tau: R,
    /// Rate 1/τ at which the force decays, per unit of time.
    pub rate: R,
}

impl<R: Arithmetic> Point<R> {
    /// Placeholder for the ends of a step in a rule that does not evaluate them.
    pub const NONE: Self = Self {
        source: R::ZERO,
        tau: R::ONE,
        rate: R::ONE,
    };

    /// Returns the slope dF/dt at the force `f`, N per unit of time.
    pub fn slope(&self, f: R) -> R {
        self.source - self.rate * f
    }

    /// Returns `time` divided by τ, in the way that is exact enough in this arithmetic.
    pub fn time_over_tau(&self, time: R) -> R {
        if R::FLOATING {
            time * self.rate
        } else {
            time / self.tau
        }
    }
}

impl<R: Arithmetic> Muscle<R> {
    /// Rounds each parameter to the nearest number of this arithmetic. `spec` may be outside the
    /// ranges of the device, but its time constants must be above zero.
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

    /// Returns the time constant τ1 + τ2·x for the share `x` of bound cross-bridges.
    pub fn tau(&self, x: R) -> R {
        self.tau1 + self.tau2 * x
    }

    /// Returns the coefficients of the force equation at `c`.
    #[inline(always)]
    pub fn point(&self, c: R) -> Point<R> {
        self.point_and_share(c).0
    }

    /// Returns the coefficients of the force equation at `c`, and the share x of bound
    /// cross-bridges. In floating point, one division suffices, because τ = (τ1·K + (τ1 +
    /// τ2)·C)/(K + C). In fixed point, the reciprocal of the product of both sums would overflow.
    #[inline(always)]
    pub fn point_and_share(&self, c: R) -> (Point<R>, R) {
        if R::FLOATING {
            let [fixed, all] = self.over;
            let (lower, upper) = (self.k + c, fixed + all * c);
            let reciprocal = R::ONE / (lower * upper);
            let (x_over, tau_over) = (upper * reciprocal, lower * reciprocal);
            let x = c * x_over;
            let point = Point {
                source: self.a * x,
                tau: upper * x_over,
                rate: lower * tau_over,
            };
            return (point, x);
        }
        let x = self.bound_fraction(c);
        let tau = self.tau(x);
        let point = Point {
            source: self.a * x,
            tau,
            rate: R::ONE / tau,
        };
        (point, x)
    }

    /// Returns the factor by which C decays during `time`.
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

/// State of a muscle: C and F in N; or the slopes of both, per unit of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<R> {
    /// Calcium state C, to which a single pulse adds 1.
    pub c: R,
    /// Force F, N.
    pub f: R,
}

impl<R: Arithmetic> State<R> {
    /// Returns `self` + `time`·`slope`.
    pub fn add_scaled(self, time: R, slope: Self) -> Self {
        Self {
            c: self.c + time * slope.c,
            f: self.f + time * slope.f,
        }
    }
}

/// State of a muscle in the form in which a method stores it.
pub trait Place: Copy {
    /// Number type of C and F.
    type Number: Arithmetic;
    /// Returns the calcium state C.
    fn calcium(&self) -> Self::Number;
    /// Returns the force F, N.
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

/// A method that integrates a muscle over a step in which no pulse occurs.
pub trait Scheme {
    /// State of the muscle in the form in which the method stores it.
    type State: Place;
    /// Constants that depend only on the length of a step.
    type Factors: Copy;

    /// Prepares the method for the muscle `spec`. Its whole steps last `step_us` microseconds.
    fn new(spec: &CalciumForceSpec, step_us: u32) -> Self;
    /// Computes the constants for a step of `us` microseconds.
    fn factors(&self, us: u32) -> Self::Factors;
    /// Returns the state of a muscle with calcium state `c` and force `f`, N.
    fn state_at(&self, c: NumberOf<Self>, f: NumberOf<Self>) -> Self::State;
    /// Advances the state by one step, whose length is that of `factors`.
    fn step(&self, factors: &Self::Factors, state: &mut Self::State);
}

/// A method whose force can be read inside a step. C is known exactly at any time, and dF/dt is
/// known at both ends, so that a cubic gives F between them.
pub trait Dense: Scheme {
    /// Returns the constants of the muscle.
    fn muscle(&self) -> &Muscle<NumberOf<Self>>;
    /// Returns dF/dt, N per unit of time.
    fn slope(&self, state: &Self::State) -> NumberOf<Self>;
}
