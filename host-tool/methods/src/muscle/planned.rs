//! A method with steps of one length, planned from each pulse on and read inside the steps through
//! the cubic that has F and dF/dt of both ends (Hairer, Nørsett & Wanner, Solving ODEs I, II.6).
//! Readings do not split a step. A pulse ends the step in which it falls and costs one exponential,
//! that of C at its time.

use super::scheme::{Dense, NumberOf, Place};
use super::{Arithmetic, Integrator};
use crate::real::Real;
use firmware::muscle::CalciumForceSpec;
use firmware::units::{Micros, us};

/// A muscle with the step that is planned from the latest pulse, or from the end of the previous
/// step.
#[derive(Clone, Copy, Debug)]
pub struct PlannedStep<S: Dense> {
    scheme: S,
    whole: S::Factors,
    step_us: u32,
    /// Reciprocal of the step's length, per unit of time.
    per_step: NumberOf<S>,
    /// C at the beginning of the step.
    c: NumberOf<S>,
    /// Coefficients of the cubic for F inside the step, in powers of the time since the beginning
    /// of the step.
    cubic: [NumberOf<S>; 4],
    from: Micros,
    /// State of the muscle at the end of the step.
    end: S::State,
    /// Slope dF/dt at the end of the step, N per unit of time.
    slope: NumberOf<S>,
    now: Micros,
}

impl<S: Dense> PlannedStep<S> {
    /// Creates a muscle without calcium and force at time 0, with steps of `step_us` microseconds,
    /// at least 1.
    pub fn new(spec: &CalciumForceSpec, step_us: u32) -> Self {
        let zero = NumberOf::<S>::ZERO;
        let scheme = S::new(spec, step_us);
        Self {
            whole: scheme.factors(step_us),
            step_us,
            per_step: NumberOf::<S>::ONE / NumberOf::<S>::from_micros(step_us),
            c: zero,
            cubic: [zero; 4],
            from: Micros::new(0),
            end: scheme.state_at(zero, zero),
            slope: zero,
            now: Micros::new(0),
            scheme,
        }
    }

    /// Plans the next step, which begins at the end of the previous one: computes its end and the
    /// cubic between both.
    #[inline(always)]
    fn plan(&mut self) {
        let (f, slope) = (self.end.force(), self.slope);
        self.c = self.end.calcium();
        self.scheme.step(&self.whole, &mut self.end);
        self.slope = self.scheme.slope(&self.end);
        let mean = (self.end.force() - f) * self.per_step;
        let (first, last) = (mean - slope, self.slope - mean);
        let third = (last - first) * self.per_step;
        let second = first * self.per_step - third;
        self.cubic = [f, slope, second, third * self.per_step];
    }

    fn time(&self) -> NumberOf<S> {
        NumberOf::<S>::from_micros(self.now.elapsed_since(self.from))
    }

    #[inline(always)]
    fn force(&self) -> NumberOf<S> {
        let time = self.time();
        let [a0, a1, a2, a3] = self.cubic;
        a0 + time * (a1 + time * (a2 + time * a3))
    }

    fn calcium_number(&self) -> NumberOf<S> {
        self.c * self.scheme.muscle().calcium_decay(self.time())
    }

    #[inline(never)]
    fn plan_until(&mut self, to: Micros) {
        while to.elapsed_since(self.from) > self.step_us {
            self.from += us(self.step_us);
            self.plan();
        }
    }
}

impl<S: Dense> Integrator for PlannedStep<S> {
    #[inline(never)]
    fn pulse(&mut self, at: Micros) {
        self.advance(at);
        let c = self.calcium_number() + NumberOf::<S>::ONE;
        self.end = self.scheme.state_at(c, self.force());
        self.slope = self.scheme.slope(&self.end);
        self.from = at;
        self.plan();
    }
    fn advance(&mut self, to: Micros) {
        if to.elapsed_since(self.from) > self.step_us {
            self.plan_until(to);
        }
        self.now = to;
    }
    fn calcium(&self) -> f64 {
        self.calcium_number().to_f64()
    }
    fn force_n(&self) -> f64 {
        self.force().to_f64()
    }
    fn force_bits(&self) -> u32 {
        self.force().fold_bits()
    }
}
