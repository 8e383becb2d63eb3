//! Explicit methods, on C and F alike: Euler, Heun and the classical
//! Runge–Kutta method (Hairer, Nørsett & Wanner, Solving ODEs I, II.1).

use super::Arithmetic;
use super::scheme::{Muscle, Scheme, State};
use core::marker::PhantomData;
use firmware::muscle::CalciumForceSpec;

/// How an explicit method moves a state over a time.
pub trait Rule {
    /// Over `time`.
    fn moved<R: Arithmetic>(muscle: &Muscle<R>, time: R, from: State<R>) -> State<R>;
}

/// Order 1.
#[derive(Clone, Copy, Debug)]
pub struct Euler;

/// Order 2: the mean of the slopes at the beginning and at Euler's end.
#[derive(Clone, Copy, Debug)]
pub struct Heun;

/// Order 4.
#[derive(Clone, Copy, Debug)]
pub struct RungeKutta4;

impl Rule for Euler {
    fn moved<R: Arithmetic>(muscle: &Muscle<R>, time: R, from: State<R>) -> State<R> {
        from.moved(time, muscle.slope(from))
    }
}

impl Rule for Heun {
    fn moved<R: Arithmetic>(muscle: &Muscle<R>, time: R, from: State<R>) -> State<R> {
        let first = muscle.slope(from);
        let second = muscle.slope(from.moved(time, first));
        let half = time * R::of(0.5);
        from.moved(half, first).moved(half, second)
    }
}

impl Rule for RungeKutta4 {
    fn moved<R: Arithmetic>(muscle: &Muscle<R>, time: R, from: State<R>) -> State<R> {
        let half = time * R::of(0.5);
        let k1 = muscle.slope(from);
        let k2 = muscle.slope(from.moved(half, k1));
        let k3 = muscle.slope(from.moved(half, k2));
        let k4 = muscle.slope(from.moved(time, k3));
        let both = |p: fn(State<R>) -> R| {
            let outer = p(k1) + p(k4);
            let inner = p(k2) + p(k3);
            (outer + inner + inner) * R::of(1.0 / 6.0)
        };
        let mean = State {
            c: both(|k| k.c),
            f: both(|k| k.f),
        };
        from.moved(time, mean)
    }
}

/// A muscle under an explicit method.
#[derive(Clone, Copy, Debug)]
pub struct Explicit<M, R> {
    muscle: Muscle<R>,
    rule: PhantomData<M>,
}

impl<M: Rule, R: Arithmetic> Scheme for Explicit<M, R> {
    type State = State<R>;
    /// The step's length.
    type Factors = R;

    fn new(spec: &CalciumForceSpec, _: u32) -> Self {
        Self {
            muscle: Muscle::new(spec),
            rule: PhantomData,
        }
    }
    fn factors(&self, us: u32) -> R {
        R::of_micros(us)
    }
    fn step(&self, time: &R, state: &mut State<R>) {
        *state = M::moved(&self.muscle, *time, *state);
    }
}
