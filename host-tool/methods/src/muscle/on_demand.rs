//! A method that steps from event to event, where events are pulses and readings. It has no grid:
//! whole steps follow one another only where two events are further apart than the longest step.

use super::scheme::{NumberOf, Place, Scheme};
use super::{Arithmetic, Integrator};
use crate::real::Real;
use firmware::muscle::CalciumForceSpec;
use firmware::units::Micros;

/// A muscle whose steps end at pulses and readings.
#[derive(Clone, Copy, Debug)]
pub struct OnDemand<S: Scheme> {
    scheme: S,
    longest_us: u32,
    /// Constants of the longest step.
    longest: S::Factors,
    /// Length of the latest shorter step, µs. Equal steps often follow one another.
    part_us: u32,
    /// Constants of the latest shorter step.
    part: S::Factors,
    state: S::State,
    at: Micros,
}

impl<S: Scheme> OnDemand<S> {
    /// Creates a muscle without calcium and force at time 0, with steps of at most `longest_us`
    /// microseconds, at least 1.
    pub fn new(spec: &CalciumForceSpec, longest_us: u32) -> Self {
        let scheme = S::new(spec, longest_us);
        let longest = scheme.factors(longest_us);
        Self {
            longest_us,
            longest,
            part_us: longest_us,
            part: longest,
            state: scheme.state_at(NumberOf::<S>::ZERO, NumberOf::<S>::ZERO),
            at: Micros::new(0),
            scheme,
        }
    }
}

impl<S: Scheme> Integrator for OnDemand<S> {
    fn pulse(&mut self, at: Micros) {
        self.advance(at);
        let c = self.state.calcium() + NumberOf::<S>::ONE;
        self.state = self.scheme.state_at(c, self.state.force());
    }

    #[inline(never)]
    fn advance(&mut self, to: Micros) {
        let mut left_us = to.elapsed_since(self.at);
        self.at = to;
        while left_us >= self.longest_us {
            self.scheme.step(&self.longest, &mut self.state);
            left_us = left_us.wrapping_sub(self.longest_us);
        }
        if left_us == 0 {
            return;
        }
        if left_us != self.part_us {
            self.part_us = left_us;
            self.part = self.scheme.factors(left_us);
        }
        self.scheme.step(&self.part, &mut self.state);
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
