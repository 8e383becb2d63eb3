//! Hermite–Simpson: Lobatto IIIA with three stages, collocation at the ends and the middle of a
//! step (Hairer & Wanner, Solving ODEs II, IV.5), order 4.
//!
//! The cubic of F through both ends must satisfy eq. (3) in the middle too. As eq. (3) is linear in
//! F, this is one equation for F at the end. With v = h/6τ and s = A·x at the beginning (0), the
//! middle (m) and the end (1):
//!
//! F1 = F0 + (h/6·(s0 + 4sm + s1 − 3vm(s0 − s1)) − F0·(v0 + 4vm + v1 + 3vm(v1 − v0)))/(1 + 2vm + v1
//! + 3vm·v1)

use super::Arithmetic;
use super::along::Rule;
use super::scheme::Point;

/// Hermite–Simpson rule for F.
#[derive(Clone, Copy, Debug)]
pub struct HermiteSimpson;

impl Rule for HermiteSimpson {
    #[inline(always)]
    fn force<R: Arithmetic>(
        time: R,
        [begin, end]: [Point<R>; 2],
        inside: impl Fn(usize) -> Point<R>,
        f: R,
    ) -> R {
        let middle = inside(0);
        let sixth = time * R::from_f64(1.0 / 6.0);
        let [v0, vm, v1] = [begin, middle, end].map(|point| sixth * point.rate);
        let twice = |r: R| r + r;
        let (vm2, vm3) = (twice(vm), twice(vm) + vm);
        let sources = begin.source + end.source + twice(twice(middle.source));
        let added = sixth * (sources - vm3 * (begin.source - end.source));
        let lost = f * (v0 + v1 + twice(vm2) + vm3 * (v1 - v0));
        f + (added - lost) / (R::ONE + vm2 + v1 + vm3 * v1)
    }
}
