//! Explicit methods: Euler, Heun and the classical Runge–Kutta method (Hairer, Nørsett & Wanner,
//! Solving ODEs I, II.1). Here they integrate both C and F; in [`super::along`] F alone.

use super::Arithmetic;
use super::scheme::{Muscle, NumberOf, Scheme, State};
use core::marker::PhantomData;
use firmware::muscle::CalciumForceSpec;

/// Position within a step at which a slope is evaluated.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SlopePosition {
    /// Beginning of the step.
    Begin,
    /// Middle of the step.
    Middle,
    /// End of the step.
    End,
}

/// Explicit method that advances the state of a muscle by one step.
pub trait Explicit {
    /// Whether the method evaluates slopes in the middle of a step.
    const MIDDLE: bool = false;
    /// Advances the state `from` by a step of length `time`. `slope` returns the slope of a state
    /// at a position in the step.
    fn advance_state<R: Arithmetic>(
        time: R,
        from: State<R>,
        slope: impl Fn(SlopePosition, State<R>) -> State<R>,
    ) -> State<R>;
}

/// Euler's method, of order 1.
#[derive(Clone, Copy, Debug)]
pub struct Euler;

/// Heun's method, of order 2. It uses the mean of two slopes: at the beginning of the step, and at
/// the end that Euler's method predicts.
#[derive(Clone, Copy, Debug)]
pub struct Heun;

/// Classical Runge–Kutta method, of order 4.
#[derive(Clone, Copy, Debug)]
pub struct RungeKutta4;

impl Explicit for Euler {
    #[inline(always)]
    fn advance_state<R: Arithmetic>(
        time: R,
        from: State<R>,
        slope: impl Fn(SlopePosition, State<R>) -> State<R>,
    ) -> State<R> {
        from.add_scaled(time, slope(SlopePosition::Begin, from))
    }
}

impl Explicit for Heun {
    #[inline(always)]
    fn advance_state<R: Arithmetic>(
        time: R,
        from: State<R>,
        slope: impl Fn(SlopePosition, State<R>) -> State<R>,
    ) -> State<R> {
        let first = slope(SlopePosition::Begin, from);
        let second = slope(SlopePosition::End, from.add_scaled(time, first));
        let half = time * R::from_f64(0.5);
        from.add_scaled(half, first).add_scaled(half, second)
    }
}

impl Explicit for RungeKutta4 {
    const MIDDLE: bool = true;
    #[inline(always)]
    fn advance_state<R: Arithmetic>(
        time: R,
        from: State<R>,
        slope: impl Fn(SlopePosition, State<R>) -> State<R>,
    ) -> State<R> {
        let half = time * R::from_f64(0.5);
        let k1 = slope(SlopePosition::Begin, from);
        let k2 = slope(SlopePosition::Middle, from.add_scaled(half, k1));
        let k3 = slope(SlopePosition::Middle, from.add_scaled(half, k2));
        let k4 = slope(SlopePosition::End, from.add_scaled(time, k3));
        let average = |p: fn(State<R>) -> R| {
            let outer = p(k1) + p(k4);
            let inner = p(k2) + p(k3);
            (outer + inner + inner) * R::from_f64(1.0 / 6.0)
        };
        let mean = State {
            c: average(|k| k.c),
            f: average(|k| k.f),
        };
        from.add_scaled(time, mean)
    }
}

/// A muscle for which an explicit method integrates both C and F.
#[derive(Clone, Copy, Debug)]
pub struct ExplicitMuscle<M, R> {
    muscle: Muscle<R>,
    rule: PhantomData<M>,
}

impl<M: Explicit, R: Arithmetic> Scheme for ExplicitMuscle<M, R> {
    type State = State<R>;
    /// Length of the step, in units of [`UNIT_US`](super::arithmetic::UNIT_US).
    type Factors = R;

    fn new(spec: &CalciumForceSpec, _: u32) -> Self {
        Self {
            muscle: Muscle::new(spec),
            rule: PhantomData,
        }
    }
    fn factors(&self, us: u32) -> R {
        R::from_micros(us)
    }
    fn state_at(&self, c: NumberOf<Self>, f: NumberOf<Self>) -> State<R> {
        State { c, f }
    }
    fn step(&self, time: &R, state: &mut State<R>) {
        *state = M::advance_state(*time, *state, |_, state| self.muscle.slope(state));
    }
}
