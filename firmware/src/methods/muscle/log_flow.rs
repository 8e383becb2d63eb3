//! The exact solution over any time, from a table over the logarithm of C.
//!
//! Between pulses C only falls, and always along the same curve: log C is a
//! clock. On it eq. (3) of Lee 2020 is linear with known coefficients, so that
//! one solution Q tells all: F = Q + (F0 − Q0)·2^−R over a time t, with R =
//! t/(τ1·ln 2) − (G0 − G), G = p·log2(1 + C/κ) (`event_driven`). Q, here the
//! one that starts from no force at 32 pulses, and G are smooth in log C: one
//! cubic per half octave gives both, whatever the muscle. A pulse takes two
//! look-ups, a logarithm and two powers, a reading one look-up and one power;
//! there are no steps, and nothing that could become unstable.
//!
//! The price: 1.5 kB per muscle in 32-bit arithmetics, made anew whenever K or
//! a time constant changes, as they do in a muscle that tires.

use super::event_driven::Interval;
use super::scheme::Muscle;
use super::{Arithmetic, Integrator};
use crate::methods::real::Real;
use crate::muscle::CalciumForceSpec;
use crate::units::Micros;
use core::f64::consts::LN_2;

/// log2 of the cells per octave.
const DENSITY: u32 = 1;
/// Octaves from 2^-19 of a pulse, below which F only relaxes with τ1, to the
/// 32 that no train of 200 Hz exceeds.
const OCTAVES: usize = 24;
const LOWEST: f64 = -19.0;
const CELLS: usize = OCTAVES << DENSITY;

/// No exponential over more than this, µs: what a fraction of it could
/// overflow a fixed-point exponent.
const LONGEST_US: u32 = 100_000;

/// a0 + t·(a1 + t·(a2 + t·a3)), t in 0…1 across a cell.
type Cubic<R> = [R; 4];

/// A muscle and where it is.
#[derive(Clone, Copy, Debug)]
pub struct LogFlow<R> {
    /// Octaves that C falls per unit of time.
    fall: R,
    /// 1/(τ1·ln 2).
    rate: R,
    /// Q, N, and G, octaves, from [`LOWEST`] up.
    cells: [(Cubic<R>, Cubic<R>); CELLS],
    /// After the last pulse; `None` once C is below the table.
    start: Option<Start<R>>,
    f: R,
    now: Micros,
}

/// The moment after a pulse.
#[derive(Clone, Copy, Debug)]
struct Start<R> {
    at: Micros,
    /// log2 C − [`LOWEST`].
    octave: R,
    /// F − Q, N.
    gap: R,
    /// G.
    power: R,
}

impl<R: Arithmetic> LogFlow<R> {
    /// A muscle at rest at time 0.
    #[must_use]
    pub fn new(spec: &CalciumForceSpec) -> Self {
        let design = Muscle::<R::Design>::new(spec);
        let octaves = R::Design::of(LN_2);
        Self {
            fall: R::of((design.rate_c / octaves).to_f64()),
            rate: R::of((R::Design::ONE / (design.tau1 * octaves)).to_f64()),
            cells: cells(&design),
            start: None,
            f: R::ZERO,
            now: Micros(0),
        }
    }

    /// Q and G.
    #[inline(always)]
    fn look_up(&self, octave: R) -> (R, R) {
        let (index, t) = octave.split(DENSITY);
        let Some((q, g)) = self.cells.get(index) else {
            return (R::ZERO, R::ZERO);
        };
        let at = |[a0, a1, a2, a3]: &Cubic<R>| *a0 + t * (*a1 + t * (*a2 + t * *a3));
        (at(q), at(g))
    }

    /// Where C is at `now`, if in the table, and the time since the pulse.
    #[inline(always)]
    fn place(&self, start: &Start<R>) -> (Option<R>, R) {
        let time = R::of_micros(self.now.elapsed_since(start.at));
        let octave = start.octave - time * self.fall;
        ((octave >= R::ZERO).then_some(octave), time)
    }

    /// F relaxes with τ1 alone.
    fn relax(&mut self, mut us: u32) {
        while us > 0 && self.f > R::ZERO {
            let part = us.min(LONGEST_US);
            self.f = self.f * (-(R::of_micros(part) * self.rate)).exp2();
            us = us.wrapping_sub(part);
        }
    }

    /// Past the table's lower end, once per silence: there by the table, from
    /// there on by τ1.
    #[inline(never)]
    fn leave(&mut self, start: &Start<R>) {
        let (q, g) = self.look_up(R::ZERO);
        let time = start.octave / self.fall;
        let kept = (start.power - g - time * self.rate).exp2();
        self.f = q + start.gap * kept;
        self.start = None;
        let us = (time.to_f64() * super::arithmetic::UNIT_US) as u32;
        self.relax(self.now.elapsed_since(start.at).saturating_sub(us));
    }

    fn calcium_number(&self) -> R {
        let octave = self.start.and_then(|start| self.place(&start).0);
        octave.map_or(R::ZERO, |o| (o + R::of(LOWEST)).exp2())
    }
}

impl<R: Arithmetic> Integrator for LogFlow<R> {
    fn pulse(&mut self, at: Micros) {
        self.advance(at);
        let c = self.calcium_number() + R::ONE;
        let octave = c.log2() - R::of(LOWEST);
        let (q, power) = self.look_up(octave);
        self.start = Some(Start {
            at,
            octave,
            gap: self.f - q,
            power,
        });
    }

    fn advance(&mut self, to: Micros) {
        let us = to.elapsed_since(self.now);
        self.now = self.now.plus(us);
        let Some(start) = self.start else {
            return self.relax(us);
        };
        // Also keeps the time within what the arithmetics take.
        if self.now.elapsed_since(start.at) >= 1 << 20 {
            return self.leave(&start);
        }
        let (Some(octave), time) = self.place(&start) else {
            return self.leave(&start);
        };
        let (q, g) = self.look_up(octave);
        // Above 0 by no more than rounding.
        let kept = (start.power - g - time * self.rate).exp2();
        self.f = q + start.gap * kept;
    }

    fn calcium(&self) -> f64 {
        self.calcium_number().to_f64()
    }

    fn force_n(&self) -> f64 {
        self.f.to_f64()
    }

    fn force_word(&self) -> u32 {
        self.f.word()
    }
}

/// Cubics through values and slopes of Q and G at both ends of each cell; Q
/// exactly from cell to cell, downwards.
fn cells<R: Arithmetic, D: Arithmetic>(muscle: &Muscle<D>) -> [(Cubic<R>, Cubic<R>); CELLS] {
    let exact = Interval::new(muscle);
    let width = D::of(LN_2 / f64::from(1u32 << DENSITY));
    // The time that C takes across a cell.
    let time = width / muscle.rate_c;
    // Value and slope across a cell at C, of Q and of G.
    let ends = |c: D, q: D| {
        let slope = muscle.slope(super::scheme::State { c, f: q }).f;
        let (g, g_slope) = exact.power_at(c);
        [[q, -(slope * time)], [g, g_slope * width]]
    };
    let cubic = |[y0, m0]: [D; 2], [y1, m1]: [D; 2]| {
        let rise = y1 - y0;
        let [two, three] = [2.0, 3.0].map(D::of);
        let all = [y0, m0, three * rise - two * m0 - m1, m0 + m1 - two * rise];
        all.map(|a| R::of(a.to_f64()))
    };
    let c_at = |node: usize| {
        let octaves = LOWEST * f64::from(1u32 << DENSITY) + node as f64;
        (D::of(octaves) * width).exp()
    };
    let mut cells = [([R::ZERO; 4], [R::ZERO; 4]); CELLS];
    let mut upper_c = c_at(CELLS);
    let mut upper = ends(upper_c, D::ZERO);
    for (node, cell) in cells.iter_mut().enumerate().rev() {
        let (kept, added) = exact.kept_and_added::<10>(time, upper_c);
        let [[q, _], _] = upper;
        let c = c_at(node);
        let lower = ends(c, q * kept + added);
        *cell = (cubic(lower[0], upper[0]), cubic(lower[1], upper[1]));
        (upper_c, upper) = (c, lower);
    }
    cells
}
