//! Exponential time differencing: C decays exactly, F relaxes exactly towards
//! a target that is held over the step, or integrated at Gauss nodes
//! (Hochbruck & Ostermann, Acta Numerica 19, 2010, section 2).

use super::Arithmetic;
use super::scheme::{Muscle, Scheme, State};
use firmware::muscle::CalciumForceSpec;

/// Target and rate held as they are at one place of the step: 0 is ETD1 (order
/// 1), a half is the midpoint method (order 2), the device's.
#[derive(Clone, Copy, Debug)]
pub struct Held<R, const MIDDLE: bool>(Muscle<R>);

/// ETD1.
pub type Etd1<R> = Held<R, false>;
/// ETD midpoint.
pub type EtdMidpoint<R> = Held<R, true>;

/// What a step of [`Held`] needs.
#[derive(Clone, Copy, Debug)]
pub struct HeldFactors<R> {
    time: R,
    /// What is left of C at the place where x is taken, and at the end.
    left: [R; 2],
}

impl<R: Arithmetic, const MIDDLE: bool> Scheme for Held<R, MIDDLE> {
    type State = State<R>;
    type Factors = HeldFactors<R>;

    fn new(spec: &CalciumForceSpec, _: u32) -> Self {
        Self(Muscle::new(spec))
    }
    fn factors(&self, us: u32) -> HeldFactors<R> {
        let time = R::of_micros(us);
        let left = if MIDDLE {
            let middle = self.0.left(time * R::of(0.5));
            [middle, middle * middle]
        } else {
            [R::ONE, self.0.left(time)]
        };
        HeldFactors { time, left }
    }
    #[inline(always)]
    fn step(&self, step: &HeldFactors<R>, state: &mut State<R>) {
        let muscle = &self.0;
        let [held, end] = step.left;
        let x = muscle.bound(if MIDDLE { state.c * held } else { state.c });
        let tau = muscle.tau(x);
        let share = R::ONE - (-(step.time / tau)).exp();
        state.f = state.f + share * (muscle.a * x * tau - state.f);
        state.c = state.c * end;
    }
}

/// Nodes of the two-point Gauss rule on 0…1: (1 ∓ 1/√3)/2.
const NODES: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];

/// Variation of constants with both integrals at two Gauss nodes; order 4.
///
/// With rates r1, r2 = 1/τ at the nodes and the rate linear between them, F
/// keeps e^(−h(r1 + r2)/2) over the step. From node i to its end the linear
/// rate's integral is h(1 − n_i)·(r1 + (r2 − r1)·m_i), m_i = ((n_i + 1)/2 −
/// n_1)/(n_2 − n_1) the place of the middle of that stretch.
#[derive(Clone, Copy, Debug)]
pub struct GaussExponential<R>(Muscle<R>);

/// What a step of [`GaussExponential`] needs.
#[derive(Clone, Copy, Debug)]
pub struct GaussFactors<R> {
    time: R,
    /// What is left of C at the nodes and at the end.
    left: [R; 3],
}

impl<R: Arithmetic> GaussExponential<R> {
    /// F after a step in which C falls from `c`.
    #[inline(always)]
    pub(super) fn force_after(&self, step: &GaussFactors<R>, c: R, f: R) -> R {
        const SPAN: f64 = NODES[1] - NODES[0];
        const PLACES: [f64; 2] = [
            ((NODES[0] + 1.0) / 2.0 - NODES[0]) / SPAN,
            ((NODES[1] + 1.0) / 2.0 - NODES[0]) / SPAN,
        ];
        let muscle = &self.0;
        let x = [step.left[0], step.left[1]].map(|left| muscle.bound(c * left));
        let rate = x.map(|x| step.time / muscle.tau(x));
        let slope = rate[1] - rate[0];
        // From a node to the end of the step.
        let kept = |node: f64, place: f64| {
            let mean = rate[0] + slope * R::of(place);
            (-(mean * R::of(1.0 - node))).exp()
        };
        let source = x[0] * kept(NODES[0], PLACES[0]) + x[1] * kept(NODES[1], PLACES[1]);
        let half = R::of(0.5);
        f * (-(half * (rate[0] + rate[1]))).exp() + muscle.a * step.time * half * source
    }
}

impl<R: Arithmetic> Scheme for GaussExponential<R> {
    type State = State<R>;
    type Factors = GaussFactors<R>;

    fn new(spec: &CalciumForceSpec, _: u32) -> Self {
        Self(Muscle::new(spec))
    }
    fn factors(&self, us: u32) -> GaussFactors<R> {
        let time = R::of_micros(us);
        // The nodes lie symmetrically: together they are the whole step.
        let first = self.0.left(time * R::of(NODES[0]));
        let second = self.0.left(time * R::of(NODES[1]));
        GaussFactors {
            time,
            left: [first, second, first * second],
        }
    }
    fn step(&self, step: &GaussFactors<R>, state: &mut State<R>) {
        state.f = self.force_after(step, state.c, state.f);
        state.c = state.c * step.left[2];
    }
}
