//! Exponential time differencing: F relaxes exactly towards a steady state that is held over the
//! step, or integrated at Gauss nodes (Hochbruck & Ostermann, Acta Numerica 19, 2010, section 2).

use super::Arithmetic;
use super::along::{Rule, RuleMuscle};
use super::scheme::Point;

/// Exponential time differencing: the steady state and the rate of F are constant over a step.
/// Their values are those at the beginning of the step for ETD1 (order 1), or in the middle for the
/// midpoint method (order 2).
#[derive(Clone, Copy, Debug)]
pub struct HeldRate<const MIDDLE: bool>;

/// Exponential time differencing with the values at the beginning of the step, of order 1.
pub type Etd1 = HeldRate<false>;
/// A muscle that the exponential midpoint method integrates, of order 2.
pub type EtdMidpoint<R> = RuleMuscle<HeldRate<true>, R>;

impl<const MIDDLE: bool> Rule for HeldRate<MIDDLE> {
    const ENDS: bool = !MIDDLE;
    #[inline(always)]
    fn force<R: Arithmetic>(
        time: R,
        [begin, _]: [Point<R>; 2],
        inside: impl Fn(usize) -> Point<R>,
        f: R,
    ) -> R {
        let held = if MIDDLE { inside(0) } else { begin };
        let share = R::ONE - (-held.time_over_tau(time)).exp();
        f + share * (held.source * held.tau - f)
    }
}

/// Variation of constants, with both integrals evaluated at the two Gauss nodes (1 ∓ 1/√3)/2; of
/// order 4.
///
/// The rates at the nodes are r1 and r2, each 1/τ, and the rate is taken as linear between them.
/// Over a step of length h, F then decays by the factor e^(−h(r1 + r2)/2). From node n_i to the end
/// of the step, the integral of the linear rate is h(1 − n_i)·(r1 + (r2 − r1)·m_i). Here m_i =
/// ((n_i + 1)/2 − n_1)/(n_2 − n_1) is the position of the middle of that interval between the
/// nodes.
#[derive(Clone, Copy, Debug)]
pub struct GaussExponential;

impl Rule for GaussExponential {
    const INSIDE: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];
    const ENDS: bool = false;
    #[inline(always)]
    fn force<R: Arithmetic>(
        time: R,
        _: [Point<R>; 2],
        inside: impl Fn(usize) -> Point<R>,
        f: R,
    ) -> R {
        let nodes = const { <Self as Rule>::INSIDE };
        let span = nodes[1] - nodes[0];
        let points = [inside(0), inside(1)];
        let rate = points.map(|p| p.time_over_tau(time));
        let slope = rate[1] - rate[0];
        // Contribution of a node, decayed to the end of the step.
        let source = |n: usize| {
            let place = ((nodes[n] + 1.0) / 2.0 - nodes[0]) / span;
            let mean = rate[0] + slope * R::from_f64(place);
            points[n].source * (-(mean * R::from_f64(1.0 - nodes[n]))).exp()
        };
        let half = R::from_f64(0.5);
        let kept = (-(half * (rate[0] + rate[1]))).exp();
        f * kept + time * half * (source(0) + source(1))
    }
}
