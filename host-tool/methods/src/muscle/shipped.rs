//! The product's own model behind the trait of this module, called as the device calls it: pulses
//! as they occur, then time.

use super::Integrator;
use firmware::muscle::{CalciumForce, CalciumForceSpec, CalciumForceState, Gain};
use firmware::range::OutOfRange;
use firmware::units::Micros;

/// The device's own muscle model, `muscle::CalciumForce`, with its state.
#[derive(Clone, Copy, Debug)]
pub struct Shipped {
    muscle: CalciumForce,
    state: CalciumForceState,
}

impl Shipped {
    /// Creates a muscle without calcium and force at time 0.
    ///
    /// # Errors
    /// Fails as [`CalciumForce::new`].
    pub fn new(spec: &CalciumForceSpec) -> Result<Self, OutOfRange> {
        Ok(Self {
            muscle: CalciumForce::new(*spec)?,
            state: CalciumForceState::at_rest(Micros::new(0)),
        })
    }
}

impl Integrator for Shipped {
    fn pulse(&mut self, at: Micros) {
        self.muscle.pulse(&mut self.state, at, Gain::FULL);
    }
    fn advance(&mut self, to: Micros) {
        self.muscle.advance(&mut self.state, to);
    }
    fn calcium(&self) -> f64 {
        self.muscle.calcium(&self.state).to_num()
    }
    fn force_n(&self) -> f64 {
        self.muscle.force(&self.state).get().to_num()
    }
    fn force_bits(&self) -> u32 {
        self.muscle
            .force(&self.state)
            .get()
            .to_bits()
            .cast_unsigned()
    }
}
