//! Integration of a whole step from a table over the logarithm of C.
//!
//! Over a step without a pulse F ← E(C)·F + S(C), where E is the remaining share of F and S the
//! force added from zero. Both are smooth in log C, and log C falls by the same amount in every
//! step, so that a step takes one look-up and no function call. Parts of steps use the table of the
//! exact solution (`flow`). The cost is 4.6 kB per muscle in 32-bit arithmetics, recomputed with
//! every change of a parameter.

use super::Arithmetic;
use super::event_driven::Interval;
use super::flow::{Flow, LOWEST, OCTAVES};
use super::scheme::{Dense, Muscle, Place, Scheme};
use crate::real::Real;
use core::f64::consts::LN_2;
use firmware::muscle::CalciumForceSpec;

/// Logarithm to base 2 of the number of table entries per octave of C.
const DENSITY: u32 = 4;
const ENTRIES: usize = (OCTAVES << DENSITY) + 1;

/// Table of one muscle for one length of step. With `DENSE`, C is also stored as such, so that
/// steps can be read inside.
#[derive(Clone, Copy, Debug)]
pub struct LogTable<R, const DENSE: bool> {
    muscle: Muscle<R>,
    flow: Flow<R>,
    step_us: u32,
    /// Pairs of E and S for each sixteenth of an octave of C, from [`LOWEST`] upwards.
    entries: [(R, R); ENTRIES],
}

/// State of a muscle: the octave of C, log2 C − [`LOWEST`], and the force F, N. With `DENSE`, it
/// also has C itself.
#[derive(Clone, Copy, Debug)]
pub struct LogState<R, const DENSE: bool> {
    octave: R,
    c: R,
    f: R,
}

impl<R: Arithmetic, const DENSE: bool> Place for LogState<R, DENSE> {
    type Number = R;
    fn calcium(&self) -> R {
        match DENSE {
            true => self.c,
            false => Flow::calcium(self.octave),
        }
    }
    fn force(&self) -> R {
        self.f
    }
}

/// Constants that depend only on the length of a step.
#[derive(Clone, Copy, Debug)]
pub struct LogFactors<R> {
    us: u32,
    time: R,
    /// Fall of C during the step, octaves.
    fall: R,
    /// Factor by which C decays during the step; 1 without `DENSE`.
    left: R,
}

impl<R: Arithmetic, const DENSE: bool> LogTable<R, DENSE> {
    /// Returns E and S at this octave of C, interpolated linearly between entries. Without calcium,
    /// S is 0.
    #[inline(always)]
    fn entry(&self, octave: R) -> (R, R) {
        if octave <= R::ZERO {
            return (self.entries[0].0, R::ZERO);
        }
        let (index, rest) = octave.split_scaled(DENSITY);
        match self.entries.get(index..index.saturating_add(2)) {
            Some(&[(e, s), (e1, s1)]) => (e + (e1 - e) * rest, s + (s1 - s) * rest),
            _ => (R::ONE, R::ZERO), // beyond 32 pulses, which never occurs
        }
    }

    /// Advances the state by a part of a step, with the table of the exact solution.
    #[inline(never)]
    fn advance_part(&self, part: &LogFactors<R>, state: &mut LogState<R, DENSE>) {
        let end = state.octave - part.fall;
        if end >= R::ZERO {
            let start = self.flow.start(state.octave, state.f);
            state.f = self.flow.force(&start, part.time, end);
            state.octave = end;
        } else {
            state.f = self.flow.relax_force(state.f, part.us);
            state.octave = R::ZERO;
        }
    }
}

impl<R: Arithmetic, const DENSE: bool> Scheme for LogTable<R, DENSE> {
    type State = LogState<R, DENSE>;
    type Factors = LogFactors<R>;

    fn new(spec: &CalciumForceSpec, step_us: u32) -> Self {
        let exact = Interval::new(&Muscle::<R::Design>::new(spec));
        let time = R::Design::from_micros(step_us);
        let width = R::Design::from_f64(LN_2 / f64::from(1u32 << DENSITY));
        let lowest = R::Design::from_f64(LOWEST * LN_2);
        let entry = |index: usize| {
            let c = (lowest + width * R::Design::from_f64(index as f64)).exp();
            let (kept, added) = exact.decay_and_gain::<4>(time, c);
            (R::from_f64(kept.to_f64()), R::from_f64(added.to_f64()))
        };
        Self {
            muscle: Muscle::new(spec),
            flow: Flow::new(spec),
            step_us,
            entries: core::array::from_fn(entry),
        }
    }
    fn factors(&self, us: u32) -> LogFactors<R> {
        let time = R::from_micros(us);
        LogFactors {
            us,
            time,
            fall: time * self.flow.fall,
            left: match DENSE {
                true => self.muscle.calcium_decay(time),
                false => R::ONE,
            },
        }
    }
    /// Returns the state with this C and this force. A C below 2^-19, the lower end of the table,
    /// is treated as 0.
    fn state_at(&self, c: R, f: R) -> LogState<R, DENSE> {
        let octave = match c > R::ZERO {
            true => Flow::octave(c),
            false => R::ZERO,
        };
        LogState { octave, c, f }
    }
    #[inline(always)]
    fn step(&self, step: &LogFactors<R>, state: &mut LogState<R, DENSE>) {
        if step.us != self.step_us {
            return self.advance_part(step, state);
        }
        let (kept, added) = self.entry(state.octave);
        state.f = state.f * kept + added;
        let end = state.octave - step.fall;
        state.octave = if end > R::ZERO { end } else { R::ZERO };
        if DENSE {
            state.c = state.c * step.left;
        }
    }
}

impl<R: Arithmetic> Dense for LogTable<R, true> {
    fn muscle(&self) -> &Muscle<R> {
        &self.muscle
    }
    fn slope(&self, state: &LogState<R, true>) -> R {
        self.muscle.point(state.c).slope(state.f)
    }
}
