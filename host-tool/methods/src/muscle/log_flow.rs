//! Event-driven integration with the table of the exact solution (`flow`).
//!
//! A pulse takes two look-ups, a logarithm and two powers, a reading one look-up and one power.
//! There are no steps, and nothing can become unstable. The cost is a table of 1.5 kB per muscle in
//! 32-bit arithmetics, which is recomputed whenever K or a time constant changes, as they do with
//! fatigue.

use super::flow::{Flow, Start};
use super::scheme::{Dense, Muscle, Place, Scheme};
use super::{Arithmetic, Integrator};
use firmware::muscle::CalciumForceSpec;
use firmware::units::{Micros, us};

/// A muscle whose force is computed from the table of the exact solution.
#[derive(Clone, Copy, Debug)]
pub struct LogFlow<R> {
    flow: Flow<R>,
    /// State directly after the latest pulse, and the time of that pulse; `None` if C has fallen
    /// below the table.
    start: Option<(Start<R>, Micros)>,
    f: R,
    now: Micros,
}

impl<R: Arithmetic> LogFlow<R> {
    /// Creates a muscle without calcium and force at time 0.
    pub fn new(spec: &CalciumForceSpec) -> Self {
        Self {
            flow: Flow::new(spec),
            start: None,
            f: R::ZERO,
            now: Micros::new(0),
        }
    }

    /// Returns the octave of C at the time `now`, or `None` if C is below the table, and the time
    /// since the pulse.
    #[inline(always)]
    fn place(&self, start: &Start<R>, pulse: Micros) -> (Option<R>, R) {
        let time = R::from_micros(self.now.elapsed_since(pulse));
        let octave = start.octave - time * self.flow.fall;
        ((octave >= R::ZERO).then_some(octave), time)
    }

    /// Computes the force after C has fallen below the table: by the table down to its lower end,
    /// then by decay with τ1. This happens once in each pause between trains.
    #[inline(never)]
    fn leave_table(&mut self, start: &Start<R>, pulse: Micros) {
        let time = start.octave / self.flow.fall;
        let f = self.flow.force(start, time, R::ZERO);
        let us = (time.to_f64() * super::arithmetic::UNIT_US) as u32;
        let left_us = self.now.elapsed_since(pulse).saturating_sub(us);
        self.f = self.flow.relax_force(f, left_us);
        self.start = None;
    }

    fn calcium_number(&self) -> R {
        let octave = self.start.and_then(|(start, at)| self.place(&start, at).0);
        octave.map_or(R::ZERO, Flow::calcium)
    }
}

impl<R: Arithmetic> Integrator for LogFlow<R> {
    fn pulse(&mut self, at: Micros) {
        self.advance(at);
        let octave = Flow::octave(self.calcium_number() + R::ONE);
        self.start = Some((self.flow.start(octave, self.f), at));
    }

    fn advance(&mut self, to: Micros) {
        let ahead_us = to.elapsed_since(self.now);
        self.now += us(ahead_us);
        let Some((start, pulse)) = self.start else {
            self.f = self.flow.relax_force(self.f, ahead_us);
            return;
        };
        // The limit keeps the time within the range of the arithmetics.
        match self.place(&start, pulse) {
            (Some(octave), time) if self.now.elapsed_since(pulse) < 1 << 20 => {
                self.f = self.flow.force(&start, time, octave);
            }
            _ => self.leave_table(&start, pulse),
        }
    }

    fn calcium(&self) -> f64 {
        self.calcium_number().to_f64()
    }

    fn force_n(&self) -> f64 {
        self.f.to_f64()
    }

    fn force_bits(&self) -> u32 {
        self.f.fold_bits()
    }
}

/// Method that takes steps with the table of the exact solution, one look-up per step. Readings
/// inside a step use the cubic of the step.
#[derive(Clone, Copy, Debug)]
pub struct FlowSteps<R> {
    muscle: Muscle<R>,
    flow: Flow<R>,
}

/// C and F, and the corresponding state in the table, which is `None` below the table.
#[derive(Clone, Copy, Debug)]
pub struct FlowState<R> {
    c: R,
    f: R,
    start: Option<Start<R>>,
}

impl<R: Arithmetic> Place for FlowState<R> {
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
pub struct FlowFactors<R> {
    time: R,
    /// Fall of C during the step, octaves.
    fall: R,
    /// Factor by which C decays during the step.
    left: R,
    /// Factor by which F decays during the step below the table, with τ1 alone.
    relaxed: R,
}

impl<R: Arithmetic> Scheme for FlowSteps<R> {
    type State = FlowState<R>;
    type Factors = FlowFactors<R>;

    fn new(spec: &CalciumForceSpec, _: u32) -> Self {
        Self {
            muscle: Muscle::new(spec),
            flow: Flow::new(spec),
        }
    }
    fn factors(&self, us: u32) -> FlowFactors<R> {
        let time = R::from_micros(us);
        FlowFactors {
            time,
            fall: time * self.flow.fall,
            left: self.muscle.calcium_decay(time),
            relaxed: self.flow.relax_force(R::ONE, us),
        }
    }
    fn state_at(&self, c: R, f: R) -> FlowState<R> {
        let octave = Flow::octave(c);
        let start = (c > R::ZERO && octave >= R::ZERO).then(|| self.flow.start(octave, f));
        FlowState { c, f, start }
    }
    #[inline(always)]
    fn step(&self, step: &FlowFactors<R>, state: &mut FlowState<R>) {
        let ends = |start: Start<R>| {
            let octave = start.octave - step.fall;
            (octave >= R::ZERO).then(|| self.flow.advance_start(&start, step.time, octave))
        };
        let (f, start) = match state.start.and_then(ends) {
            Some((f, start)) => (f, Some(start)),
            None => (state.f * step.relaxed, None),
        };
        let c = state.c * step.left;
        *state = FlowState { c, f, start };
    }
}

impl<R: Arithmetic> Dense for FlowSteps<R> {
    fn muscle(&self) -> &Muscle<R> {
        &self.muscle
    }
    fn slope(&self, state: &FlowState<R>) -> R {
        self.muscle.point(state.c).slope(state.f)
    }
}
