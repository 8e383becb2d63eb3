//! The exact solution over any time, from a table over the logarithm of C.
//!
//! Between pulses C only falls, always along the same curve, so that log C measures time. Over log
//! C, eq. (3) of Lee 2020 is linear with known coefficients, and one solution Q determines all
//! others: F = Q + (F0 − Q0)·2^−R over a time t, with R = t/(τ1·ln 2) − (G0 − G), G = p·log2(1 +
//! C/κ) (`event_driven`). Q (here the solution that starts from zero force at 32 pulses) and G are
//! smooth in log C: one cubic per half octave represents both, for any muscle.

use super::Arithmetic;
use super::event_driven::Interval;
use super::scheme::{Muscle, State};
use crate::real::Real;
use core::f64::consts::LN_2;
use firmware::muscle::CalciumForceSpec;

/// Logarithm to base 2 of the number of table cells per octave of C.
const DENSITY: u32 = 1;
/// Number of octaves of C that the table covers, from [`LOWEST`] up to 2^5 = 32, which no train of
/// 200 Hz exceeds.
pub(super) const OCTAVES: usize = 24;
/// Lower end of the table: log2 of the smallest C. Below it, F only decays with τ1.
pub(super) const LOWEST: f64 = -19.0;
const CELLS: usize = OCTAVES << DENSITY;

/// Longest time for which one exponential is computed, µs. A longer time could overflow the
/// exponent in fixed point.
const LONGEST_US: u32 = 100_000;

/// Coefficients of the cubic a0 + t·(a1 + t·(a2 + t·a3)), where t runs from 0 to 1 across a cell.
type Cubic<R> = [R; 4];

/// Table of the exact solution for one muscle. Its argument is the octave of C, log2 C −
/// [`LOWEST`].
#[derive(Clone, Copy, Debug)]
pub struct Flow<R> {
    /// Octaves by which C falls per unit of time, [`UNIT_US`](super::arithmetic::UNIT_US).
    pub fall: R,
    /// Rate 1/(τ1·ln 2) at which F decays without calcium, in octaves per unit of time.
    rate: R,
    /// Cubics of Q, N, and of G, octaves, for each cell from [`LOWEST`] upwards.
    cells: [(Cubic<R>, Cubic<R>); CELLS],
}

/// State of a muscle at one time, from which [`Flow`] computes later forces.
#[derive(Clone, Copy, Debug)]
pub struct Start<R> {
    /// Octave of C: log2 C − [`LOWEST`].
    pub octave: R,
    /// Difference F − Q, N.
    gap: R,
    /// Value of G, octaves.
    power: R,
}

impl<R: Arithmetic> Flow<R> {
    /// Computes the table from the parameters of a muscle.
    pub fn new(spec: &CalciumForceSpec) -> Self {
        let design = Muscle::<R::Design>::new(spec);
        let octaves = R::Design::from_f64(LN_2);
        Self {
            fall: R::from_f64((design.rate_c / octaves).to_f64()),
            rate: R::from_f64((R::Design::ONE / (design.tau1 * octaves)).to_f64()),
            cells: cells(&design),
        }
    }

    /// Returns C from its octave; 0 at or below the lower end of the table.
    pub fn calcium(octave: R) -> R {
        if octave <= R::ZERO {
            return R::ZERO;
        }
        (octave + R::from_f64(LOWEST)).exp2()
    }

    /// Returns the octave of C: log2 C − [`LOWEST`].
    pub fn octave(c: R) -> R {
        c.log2() - R::from_f64(LOWEST)
    }

    /// Returns Q, N, and G, octaves, at this octave of C.
    #[inline(always)]
    fn look_up(&self, octave: R) -> (R, R) {
        let (index, t) = octave.split_scaled(DENSITY);
        let Some((q, g)) = self.cells.get(index) else {
            return (R::ZERO, R::ZERO);
        };
        let at = |[a0, a1, a2, a3]: &Cubic<R>| *a0 + t * (*a1 + t * (*a2 + t * *a3));
        (at(q), at(g))
    }

    /// Returns the state of a muscle with force `f`, N. `octave` is that of C; it must not be
    /// negative.
    #[inline(always)]
    pub fn start(&self, octave: R, f: R) -> Start<R> {
        let (q, power) = self.look_up(octave);
        Start {
            octave,
            gap: f - q,
            power,
        }
    }

    /// Returns the force at a time `time` after `start`, N. `octave` is that of C at the later time
    /// and must not be below 0.
    #[inline(always)]
    pub fn force(&self, start: &Start<R>, time: R, octave: R) -> R {
        self.advance_start(start, time, octave).0
    }

    /// Returns the force as [`Self::force`] does, and the state at the later time.
    #[inline(always)]
    pub fn advance_start(&self, start: &Start<R>, time: R, octave: R) -> (R, Start<R>) {
        let (q, power) = self.look_up(octave);
        // The exponent exceeds 0 only by rounding.
        let gap = start.gap * (start.power - power - time * self.rate).exp2();
        (q + gap, Start { octave, gap, power })
    }

    /// Returns what remains of the force `f` after `us` microseconds of decay with τ1 alone,
    /// without calcium.
    pub fn relax_force(&self, mut f: R, mut us: u32) -> R {
        while us > 0 && f > R::ZERO {
            let part = us.min(LONGEST_US);
            f = f * (-(R::from_micros(part) * self.rate)).exp2();
            us = us.wrapping_sub(part);
        }
        f
    }
}

/// Computes the cubics of Q and G for all cells. Each cubic has the exact values and slopes of Q or
/// G at both ends of its cell. Q is computed from the highest cell, where it is 0, down to the
/// lowest, because C falls with time; each cell continues from the value at the end of the cell
/// above.
fn cells<R: Arithmetic, D: Arithmetic>(muscle: &Muscle<D>) -> [(Cubic<R>, Cubic<R>); CELLS] {
    let exact = Interval::new(muscle);
    let width = D::from_f64(LN_2 / f64::from(1u32 << DENSITY));
    // Time in which C crosses a cell.
    let time = width / muscle.rate_c;
    // Value and slope across a cell at C, of Q and of G.
    let ends = |c: D, q: D| {
        let slope = muscle.slope(State { c, f: q }).f;
        let (g, g_slope) = exact.power_at(c);
        [[q, -(slope * time)], [g, g_slope * width]]
    };
    let cubic = |[y0, m0]: [D; 2], [y1, m1]: [D; 2]| {
        let rise = y1 - y0;
        let [two, three] = [2.0, 3.0].map(D::from_f64);
        let coefficients = [y0, m0, three * rise - two * m0 - m1, m0 + m1 - two * rise];
        coefficients.map(|a| R::from_f64(a.to_f64()))
    };
    let c_at = |node: usize| {
        let octaves = LOWEST * f64::from(1u32 << DENSITY) + node as f64;
        (D::from_f64(octaves) * width).exp()
    };
    let mut cells = [([R::ZERO; 4], [R::ZERO; 4]); CELLS];
    let mut upper_c = c_at(CELLS);
    let mut upper = ends(upper_c, D::ZERO);
    for (node, cell) in cells.iter_mut().enumerate().rev() {
        let (kept, added) = exact.decay_and_gain::<4>(time, upper_c);
        let [[q, _], _] = upper;
        let c = c_at(node);
        let lower = ends(c, q * kept + added);
        *cell = (cubic(lower[0], upper[0]), cubic(lower[1], upper[1]));
        (upper_c, upper) = (c, lower);
    }
    cells
}
