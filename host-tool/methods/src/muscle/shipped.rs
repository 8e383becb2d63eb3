//! The product's own model behind the trait of this module, called as the device calls it: pulses
//! as they occur, then time.

use super::Integrator;
use firmware::muscle::{
    CalciumForce, CalciumForceSpec, CalciumForceState, Gain, TabulatedForce, TabulatedForceState,
};
use firmware::range::OutOfRange;
use firmware::units::Micros;

/// The device's muscle model where a muscle has a table, `muscle::TabulatedForce`, complete from the
/// start.
#[derive(Clone, Debug)]
pub struct Tabulated {
    muscle: TabulatedForce,
    state: TabulatedForceState,
    /// [`Gain::FULL`]. Unlike a constant it is one of many, as in the device.
    gain: Gain,
}

/// The device's muscle model where a muscle has no table, `muscle::CalciumForce`.
#[derive(Clone, Copy, Debug)]
pub struct Integrated {
    muscle: CalciumForce,
    state: CalciumForceState,
}

impl Tabulated {
    /// Creates a muscle without calcium and force at time 0; `None` for a muscle without a table.
    #[must_use]
    pub fn new(spec: &CalciumForceSpec) -> Option<Self> {
        Some(Self {
            muscle: TabulatedForce::new(spec)?,
            state: TabulatedForceState::at_rest(Micros::new(0)),
            gain: Gain::FULL,
        })
    }
}

impl Integrated {
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

impl Integrator for Tabulated {
    fn pulse(&mut self, at: Micros) {
        self.muscle.pulse(&mut self.state, at, self.gain);
    }
    #[inline(always)] // as in the device
    fn advance(&mut self, to: Micros) {
        self.muscle.advance(&mut self.state, to);
    }
    fn calcium(&self) -> f64 {
        self.muscle.calcium(&self.state).to_num()
    }
    fn force_n(&self) -> f64 {
        self.muscle.force(&self.state).get().to_num()
    }
    #[inline(always)] // as in the device
    fn force_bits(&self) -> u32 {
        let force = self.muscle.force(&self.state).get();
        force.to_bits().cast_unsigned()
    }
}

impl Integrator for Integrated {
    fn pulse(&mut self, at: Micros) {
        self.muscle.pulse(&mut self.state, at, Gain::FULL);
    }
    #[inline(always)] // as in the device
    fn advance(&mut self, to: Micros) {
        self.muscle.advance(&mut self.state, to);
    }
    fn calcium(&self) -> f64 {
        self.muscle.calcium(&self.state).to_num()
    }
    fn force_n(&self) -> f64 {
        self.muscle.force(&self.state).get().to_num()
    }
    #[inline(always)] // as in the device
    fn force_bits(&self) -> u32 {
        let force = self.muscle.force(&self.state).get();
        force.to_bits().cast_unsigned()
    }
}
