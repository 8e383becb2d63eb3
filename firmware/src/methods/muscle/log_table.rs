//! A whole step from a table over the logarithm of C.
//!
//! Over a step without a pulse F ← E(C)·F + S(C): E is what F keeps, S what
//! the muscle adds from zero. Both are smooth in log C, and log C falls by the
//! same amount in every step, so that a step is one look-up and no function.

use super::Arithmetic;
use super::event_driven::Interval;
use super::exponential::{GaussExponential, GaussFactors};
use super::scheme::{Muscle, Scheme, State};
use crate::methods::real::Real;
use crate::muscle::CalciumForceSpec;

/// log2 of the entries per octave.
const DENSITY: u32 = 4;
/// Octaves from 2^-16 of a pulse, where no muscle's force can be told from
/// none's, to 2^3, which 200 Hz reach.
const OCTAVES: usize = 19;
const LOWEST: f64 = -16.0;
const ENTRIES: usize = (OCTAVES << DENSITY) + 1;

/// The table of one muscle and step; parts of steps go by two Gauss nodes.
#[derive(Clone, Copy, Debug)]
pub struct LogTable<R> {
    muscle: Muscle<R>,
    part: GaussExponential<R>,
    step_us: u32,
    /// (E, S) at log2 C = −16, −15 15/16 … 3.
    entries: [(R, R); ENTRIES],
}

/// log2 C − [`LOWEST`], and F.
#[derive(Clone, Copy, Debug)]
pub struct LogState<R> {
    octave: R,
    f: R,
}

/// A step's look-up or computation, and by how much log2 C falls.
#[derive(Clone, Copy, Debug)]
pub struct LogFactors<R> {
    fall: R,
    /// `None` for a whole step.
    part: Option<GaussFactors<R>>,
}

impl<R: Arithmetic> LogTable<R> {
    fn calcium(&self, state: &LogState<R>) -> R {
        (state.octave + R::of(LOWEST)).exp2()
    }

    /// E and S between entries, linearly; outside, the outermost.
    #[inline(always)]
    fn entry(&self, octave: R) -> (R, R) {
        if octave < R::ZERO {
            return (self.entries[0].0, R::ZERO);
        }
        let (index, rest) = octave.split(DENSITY);
        // index + 1 < ENTRIES.
        let index = index.min(ENTRIES - 2);
        match self.entries.get(index..=index + 1) {
            Some(&[(e, s), (e1, s1)]) => (e + (e1 - e) * rest, s + (s1 - s) * rest),
            _ => (R::ONE, R::ZERO),
        }
    }
}

impl<R: Arithmetic> Scheme for LogTable<R> {
    type Number = R;
    type State = LogState<R>;
    type Factors = LogFactors<R>;

    fn new(spec: &CalciumForceSpec, step_us: u32) -> Self {
        let exact = Interval::new(&Muscle::<R::Design>::new(spec));
        let time = R::Design::of_micros(step_us);
        let density = R::Design::of(core::f64::consts::LN_2 / f64::from(1u32 << DENSITY));
        let lowest = R::Design::of(LOWEST * core::f64::consts::LN_2);
        let entry = |index: usize| {
            let c = (lowest + density * R::Design::of(index as f64)).exp();
            let (kept, added) = exact.kept_and_added::<10>(time, c);
            (R::of(kept.to_f64()), R::of(added.to_f64()))
        };
        Self {
            muscle: Muscle::new(spec),
            part: GaussExponential::new(spec, step_us),
            step_us,
            entries: core::array::from_fn(entry),
        }
    }
    fn rest(&self) -> LogState<R> {
        // Far below the table.
        LogState {
            octave: R::of(LOWEST),
            f: R::ZERO,
        }
    }
    fn factors(&self, us: u32) -> LogFactors<R> {
        let part = (us != self.step_us).then(|| self.part.factors(us));
        LogFactors {
            fall: R::of_micros(us) * self.muscle.rate_c * R::of(core::f64::consts::LOG2_E),
            part,
        }
    }
    #[inline(always)]
    fn step(&self, step: &LogFactors<R>, state: &mut LogState<R>) {
        state.f = if let Some(part) = &step.part {
            self.part.force_after(part, self.calcium(state), state.f)
        } else {
            let (kept, added) = self.entry(state.octave);
            state.f * kept + added
        };
        // As far as below the table nothing matters.
        if state.octave > R::of(LOWEST) {
            state.octave = state.octave - step.fall;
        }
    }
    fn pulse(&self, state: &mut LogState<R>) {
        let c = self.calcium(state) + R::ONE;
        state.octave = c.log2() - R::of(LOWEST);
    }
    fn reading(&self, state: &LogState<R>) -> State<R> {
        State {
            c: self.calcium(state),
            f: state.f,
        }
    }
}
