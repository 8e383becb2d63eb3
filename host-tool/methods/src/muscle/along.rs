//! Methods that integrate F alone, along the exact C: x and τ at the ends of a step and inside it
//! are known in advance.

use super::Arithmetic;
use super::explicit::{Explicit, SlopePosition};
use super::scheme::{Dense, Muscle, NumberOf, Place, Point, Scheme, State};
use core::marker::PhantomData;
use firmware::muscle::CalciumForceSpec;

/// Rule that integrates the force F over one step while the calcium state C follows its exact
/// solution.
pub trait Rule {
    /// Two positions inside the step at which the rule evaluates the equation of F, as fractions of
    /// the step's length.
    const INSIDE: [f64; 2] = [0.5; 2];
    /// Whether the rule also evaluates the equation at the beginning and at the end of the step.
    const ENDS: bool = true;
    /// Returns F at the end of a step of length `time` that begins with the force `f`. `ends` are
    /// the coefficients of the equation at the beginning and the end of the step, and `inside(n)`
    /// returns those at position n of [`Self::INSIDE`].
    fn force<R: Arithmetic>(
        time: R,
        ends: [Point<R>; 2],
        inside: impl Fn(usize) -> Point<R>,
        f: R,
    ) -> R;
}

impl<M: Explicit> Rule for M {
    #[inline(always)]
    fn force<R: Arithmetic>(
        time: R,
        [begin, end]: [Point<R>; 2],
        inside: impl Fn(usize) -> Point<R>,
        f: R,
    ) -> R {
        let middle = if M::MIDDLE { inside(0) } else { begin };
        let slope = |at, state: State<R>| {
            let point = match at {
                SlopePosition::Begin => &begin,
                SlopePosition::Middle => &middle,
                SlopePosition::End => &end,
            };
            State {
                c: R::ZERO,
                f: point.slope(state.f),
            }
        };
        M::advance_state(time, State { c: R::ZERO, f }, slope).f
    }
}

/// A muscle whose force a [`Rule`] integrates.
#[derive(Clone, Copy, Debug)]
pub struct RuleMuscle<M, R> {
    muscle: Muscle<R>,
    rule: PhantomData<M>,
}

/// C and F, with the coefficients of the equation at this C if the rule evaluates the ends of
/// steps.
#[derive(Clone, Copy, Debug)]
pub struct AlongState<R> {
    c: R,
    f: R,
    here: Point<R>,
}

impl<R: Arithmetic> Place for AlongState<R> {
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
pub struct AlongFactors<R> {
    time: R,
    /// Factors by which C decays from the beginning of the step: to each of the two positions
    /// inside, and to the end.
    left: [R; 3],
}

impl<M: Rule, R: Arithmetic> RuleMuscle<M, R> {
    #[inline(always)]
    fn here(&self, c: R) -> Point<R> {
        if M::ENDS {
            self.muscle.point(c)
        } else {
            Point::NONE
        }
    }
}

impl<M: Rule, R: Arithmetic> Scheme for RuleMuscle<M, R> {
    type State = AlongState<R>;
    type Factors = AlongFactors<R>;

    fn new(spec: &CalciumForceSpec, _: u32) -> Self {
        Self {
            muscle: Muscle::new(spec),
            rule: PhantomData,
        }
    }
    /// Computes the constants of a step of `us` microseconds. The two positions inside the step
    /// must be symmetric about its middle: the product of their decay factors is then that of the
    /// whole step.
    fn factors(&self, us: u32) -> AlongFactors<R> {
        let time = R::from_micros(us);
        let [first, second] = M::INSIDE;
        let near = self.muscle.calcium_decay(time * R::from_f64(first));
        let far = match first == second {
            true => near,
            false => self.muscle.calcium_decay(time * R::from_f64(second)),
        };
        AlongFactors {
            time,
            left: [near, far, near * far],
        }
    }
    fn state_at(&self, c: NumberOf<Self>, f: NumberOf<Self>) -> AlongState<R> {
        let here = self.here(c);
        AlongState { c, f, here }
    }
    #[inline(always)]
    fn step(&self, step: &AlongFactors<R>, state: &mut AlongState<R>) {
        let c = state.c * step.left[2];
        let end = self.here(c);
        let inside = |n: usize| {
            let left = if n == 0 { step.left[0] } else { step.left[1] };
            self.muscle.point(state.c * left)
        };
        let f = M::force(step.time, [state.here, end], inside, state.f);
        *state = AlongState { c, f, here: end };
    }
}

impl<M: Rule, R: Arithmetic> Dense for RuleMuscle<M, R> {
    fn muscle(&self) -> &Muscle<R> {
        &self.muscle
    }
    #[inline(always)]
    fn slope(&self, state: &AlongState<R>) -> R {
        if M::ENDS {
            state.here.slope(state.f)
        } else {
            self.muscle.point(state.c).slope(state.f)
        }
    }
}
