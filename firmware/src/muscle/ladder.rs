//! The fidelity ladder: models of the same muscle, from cheap to complete,
//! behind one trait.

use super::{CalciumForce, CalciumForceState, Gain};
use crate::units::{Force, Micros};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// How much of a muscle is modelled, cheapest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, Schema)]
pub enum Rung {
    /// Recruitment only: force follows amplitude and pulse rate at once.
    Static,
    /// Rise and fall time constants, gain by frequency.
    Lag,
    /// Lee 2020, equations (2) and (3).
    CalciumForce,
    /// The same, with parameters that tire.
    CalciumForceFatigue,
}

/// A model of one muscle: validated parameters. Any number of states can run
/// on one.
pub trait Model {
    /// Where a muscle is.
    type State: Copy;
    /// A muscle without force.
    fn at_rest(&self, at: Micros) -> Self::State;
    /// A pulse at `at` that drives the muscle with `gain`.
    fn pulse(&self, state: &mut Self::State, at: Micros, gain: Gain);
    /// Lets time pass until `to`; an earlier time changes nothing.
    fn advance(&self, state: &mut Self::State, to: Micros);
    /// The force at the state's time.
    fn force(&self, state: &Self::State) -> Force;
}

impl Model for CalciumForce {
    type State = CalciumForceState;
    fn at_rest(&self, at: Micros) -> Self::State {
        CalciumForceState::at_rest(at)
    }
    fn pulse(&self, state: &mut Self::State, at: Micros, gain: Gain) {
        self.pulse(state, at, gain);
    }
    fn advance(&self, state: &mut Self::State, to: Micros) {
        self.advance(state, to);
    }
    fn force(&self, state: &Self::State) -> Force {
        self.force(state)
    }
}
