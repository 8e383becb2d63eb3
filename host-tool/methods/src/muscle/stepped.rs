//! A method run in steps of one length, split at pulses.

use super::scheme::{NumberOf, Place, Scheme};
use super::{Arithmetic, Integrator};
use crate::real::Real;
use firmware::muscle::CalciumForceSpec;
use firmware::units::{Micros, us};

/// When a pulse that occurs inside a step acts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Pulses {
    /// At its own time, in whole µs, which splits its step in two.
    Split,
    /// At the beginning of its step, as in programs that compute only whole steps.
    Snapped,
}

/// A muscle that is integrated in steps of one length. A reading inside a step splits the step,
/// too; with [`Pulses::Snapped`], it instead returns the force at the end of the last whole step.
#[derive(Clone, Copy, Debug)]
pub struct SteppedMuscle<S: Scheme> {
    scheme: S,
    whole: S::Factors,
    step_us: u32,
    pulses: Pulses,
    state: S::State,
    at: Micros,
    /// Time since the beginning of the present step, µs, below `step_us`.
    over_us: u32,
}

impl<S: Scheme> SteppedMuscle<S> {
    /// Creates a muscle without calcium and force at time 0, with steps of `step_us` microseconds,
    /// at least 1.
    pub fn new(spec: &CalciumForceSpec, step_us: u32, pulses: Pulses) -> Self {
        let scheme = S::new(spec, step_us);
        Self {
            whole: scheme.factors(step_us),
            state: scheme.state_at(NumberOf::<S>::ZERO, NumberOf::<S>::ZERO),
            scheme,
            step_us,
            pulses,
            at: Micros::new(0),
            over_us: 0,
        }
    }

    /// Advances to the time `to`: first by the rest of the present step, then by whole steps, then
    /// by a part of a step.
    #[inline(never)]
    fn advance_any(&mut self, to: Micros) {
        let mut left_us = to.elapsed_since(self.at);
        if self.over_us > 0 && left_us > 0 {
            let us = left_us.min(self.step_us.wrapping_sub(self.over_us));
            self.advance_part(us);
            left_us = left_us.wrapping_sub(us);
        }
        while left_us >= self.step_us {
            self.scheme.step(&self.whole, &mut self.state);
            left_us = left_us.wrapping_sub(self.step_us);
        }
        if left_us > 0 && self.pulses == Pulses::Split {
            self.advance_part(left_us);
            left_us = 0;
        }
        // In snapped mode, the time of an incomplete step remains pending.
        if to.has_reached(self.at) {
            self.at = to - us(left_us);
        }
    }

    /// Advances by a part of a step and adds its length to the elapsed part of the step.
    #[inline(never)]
    fn advance_part(&mut self, us: u32) {
        self.scheme.step(&self.scheme.factors(us), &mut self.state);
        self.over_us = self.over_us.wrapping_add(us);
        if self.over_us >= self.step_us {
            self.over_us = 0;
        }
    }
}

impl<S: Scheme> Integrator for SteppedMuscle<S> {
    fn pulse(&mut self, at: Micros) {
        self.advance_any(at);
        let c = self.state.calcium() + NumberOf::<S>::ONE;
        self.state = self.scheme.state_at(c, self.state.force());
    }

    fn advance(&mut self, to: Micros) {
        // Fast path for the usual case of one whole step.
        if self.over_us == 0 && (to - self.at).us() == self.step_us.cast_signed() {
            self.at = to;
            self.scheme.step(&self.whole, &mut self.state);
        } else {
            self.advance_any(to);
        }
    }

    fn calcium(&self) -> f64 {
        self.state.calcium().to_f64()
    }

    fn force_n(&self) -> f64 {
        self.state.force().to_f64()
    }

    fn force_bits(&self) -> u32 {
        self.state.force().fold_bits()
    }
}
