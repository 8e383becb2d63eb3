//! The fidelity ladder: how much of a muscle is modelled, from nothing to fatigue,
//! behind one trait, and the change from one to another.

use core::fmt;

use fixed::types::U1F31;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::fatigue::{Fatigue, FatigueSpec, FatigueState};
use super::segment::TICK_US;
use super::{
    CalciumForce, CalciumForceSpec, CalciumForceState, Gain, Recruitment, RecruitmentSpec,
};
use crate::range::OutOfRange;
use crate::units::{Force, Micros, us};

/// How much of a muscle is modelled, least first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, Schema)]
pub enum Rung {
    /// Nothing: no force is predicted, and force control has the inverse alone.
    None,
    /// Lee 2020, equations (2) and (3).
    CalciumForce,
    /// The same, with parameters that tire (Ding 2003).
    CalciumForceFatigue,
}

impl Rung {
    /// All rungs, lowest first.
    pub const ALL: [Self; 3] = [Self::None, Self::CalciumForce, Self::CalciumForceFatigue];
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

/// A rung that tires was asked of a muscle without a [`FatigueSpec`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoFatigue;

impl fmt::Display for NoFatigue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the muscle has no fatigue parameters")
    }
}

impl core::error::Error for NoFatigue {}

/// What [`MuscleModel::new`] refuses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MuscleModelError {
    /// A parameter outside its range.
    Range(OutOfRange),
    /// The rung needs a [`FatigueSpec`].
    NoFatigue,
}

/// A muscle under a channel, as a host configures it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct MuscleSpec {
    /// Its force model.
    pub force: CalciumForceSpec,
    /// How amplitude recruits it.
    pub recruitment: RecruitmentSpec,
    /// How it tires: needed for [`Rung::CalciumForceFatigue`].
    pub fatigue: Option<FatigueSpec>,
    /// The rung it starts on.
    pub rung: Rung,
}

impl MuscleSpec {
    /// A muscle that does not tire, on [`Rung::CalciumForce`].
    #[must_use]
    pub const fn new(force: CalciumForceSpec, recruitment: RecruitmentSpec) -> Self {
        Self {
            force,
            recruitment,
            fatigue: None,
            rung: Rung::CalciumForce,
        }
    }

    /// Derives the constants of the muscle and of its recruitment.
    ///
    /// # Errors
    /// As [`MuscleModel::new`]; [`MuscleModelError::Range`] as [`Recruitment::new`].
    pub fn validate(&self) -> Result<(MuscleModel, Recruitment), MuscleModelError> {
        let ladder = MuscleModel::new(self.force, self.fatigue, self.rung)?;
        let recruitment = Recruitment::new(self.recruitment).map_err(MuscleModelError::Range)?;
        Ok((ladder, recruitment))
    }
}

/// One muscle on any rung: validated parameters and the rung it starts on.
#[derive(Clone, Copy, Debug)]
pub struct MuscleModel {
    fresh: CalciumForce,
    fatigue: Option<Fatigue>,
    first: Rung,
}

/// Where one muscle on some rung is.
#[derive(Clone, Copy, Debug)]
pub struct MuscleModelState {
    /// The muscle as tired as it is.
    muscle: CalciumForce,
    tired: FatigueState,
    /// Gain of the last pulse that reached the muscle, as it came, Q31.
    gain: u32,
    rung: Rung,
    /// Stands still where no model runs.
    motion: CalciumForceState,
}

impl MuscleModelState {
    /// The rung it is on.
    #[must_use]
    pub const fn model_level(&self) -> Rung {
        self.rung
    }

    /// What work has left of A, 0…1: 1 for a muscle that does not tire.
    #[must_use]
    pub const fn strength(&self) -> U1F31 {
        U1F31::from_bits(self.tired.a)
    }
}

impl MuscleModel {
    /// Derives the constants of a muscle that starts on `initial_model_level`.
    ///
    /// # Errors
    /// [`MuscleModelError::Range`] as [`CalciumForce::new`], and the same for the
    /// parameters of `fatigue`; [`MuscleModelError::NoFatigue`] if `initial_model_level` needs it.
    pub fn new(
        force: CalciumForceSpec,
        fatigue: Option<FatigueSpec>,
        first: Rung,
    ) -> Result<Self, MuscleModelError> {
        let (fresh, fatigue) = match fatigue {
            None => (
                CalciumForce::new(force).map_err(MuscleModelError::Range)?,
                None,
            ),
            Some(spec) => {
                let (fresh, fatigue) =
                    Fatigue::new(force, spec).map_err(MuscleModelError::Range)?;
                (fresh, Some(fatigue))
            }
        };
        if first == Rung::CalciumForceFatigue && fatigue.is_none() {
            return Err(MuscleModelError::NoFatigue);
        }
        Ok(Self {
            fresh,
            fatigue,
            first,
        })
    }

    /// The rung a muscle starts on.
    #[must_use]
    pub const fn initial_model_level(&self) -> Rung {
        self.first
    }

    /// Changes the rung at `now`. Between the upper two force and calcium stay what
    /// they are. From [`Rung::None`] they begin at rest, as if no pulse had come before:
    /// in a train, force is right after some five times τ1 + τ2. Fatigue stands still
    /// below its own rung, neither growing nor recovering, and keeps its effect there.
    ///
    /// # Errors
    /// [`NoFatigue`], and nothing changes.
    pub fn switch(
        &self,
        state: &mut MuscleModelState,
        rung: Rung,
        now: Micros,
    ) -> Result<(), NoFatigue> {
        if rung == Rung::CalciumForceFatigue && self.fatigue.is_none() {
            return Err(NoFatigue);
        }
        if state.rung == Rung::None {
            state.motion = CalciumForceState::at_rest(now);
        }
        state.rung = rung;
        Ok(())
    }

    /// The force at the state's time; none where no model runs.
    #[must_use]
    pub fn predicted_force(&self, state: &MuscleModelState) -> Option<Force> {
        (state.rung != Rung::None).then(|| state.muscle.force(&state.motion))
    }
}

impl Model for MuscleModel {
    type State = MuscleModelState;

    fn at_rest(&self, at: Micros) -> MuscleModelState {
        MuscleModelState {
            muscle: self.fresh,
            tired: FatigueState::NONE,
            gain: 0,
            rung: self.first,
            motion: CalciumForceState::at_rest(at),
        }
    }

    /// A pulse with [`Gain::ZERO`] reaches no fibre and changes nothing.
    #[inline(always)]
    fn pulse(&self, state: &mut MuscleModelState, at: Micros, gain: Gain) {
        if gain == Gain::ZERO || state.rung == Rung::None {
            return;
        }
        state.gain = gain.get().to_bits();
        let gain = state.tired.fatigued_gain(state.gain);
        // What most muscles run on goes first, without a call.
        if state.rung == Rung::CalciumForce {
            state.muscle.pulse_with(&mut state.motion, at, gain);
        } else {
            self.pulse_with_fatigue(state, at, gain);
        }
    }

    #[inline(always)]
    fn advance(&self, state: &mut MuscleModelState, to: Micros) {
        match state.rung {
            Rung::CalciumForce => state.muscle.advance(&mut state.motion, to),
            Rung::None => {}
            Rung::CalciumForceFatigue => self.advance_with_fatigue(state, to),
        }
    }

    /// [`Self::predicted_force`]; 0 N where no model runs.
    fn force(&self, state: &MuscleModelState) -> Force {
        self.predicted_force(state).unwrap_or_default()
    }
}

impl MuscleModel {
    /// A pulse on [`Rung::CalciumForceFatigue`].
    #[inline(never)]
    fn pulse_with_fatigue(&self, state: &mut MuscleModelState, at: Micros, gain: u32) {
        let before = state.motion.at();
        state.muscle.pulse_with(&mut state.motion, at, gain);
        let passed_us = state.motion.at().elapsed_since(before);
        if passed_us > 0 {
            self.apply_fatigue(state, passed_us);
        }
    }

    #[inline(never)]
    fn advance_with_fatigue(&self, state: &mut MuscleModelState, to: Micros) {
        if (to - state.motion.at()).us() == TICK_US.cast_signed() {
            state.muscle.advance(&mut state.motion, to);
            self.apply_fatigue(state, TICK_US);
        } else {
            self.integrate_with_fatigue(state, to);
        }
    }

    /// [`Self::advance`] by any time: steps of at most 1 ms, each counted as work; at
    /// rest, of a second.
    #[cold]
    #[inline(never)]
    fn integrate_with_fatigue(&self, state: &mut MuscleModelState, to: Micros) {
        loop {
            let ahead_us = to.elapsed_since(state.motion.at());
            if ahead_us == 0 {
                return;
            }
            let longest_us = if state.motion.is_at_rest() {
                super::fatigue::UPDATE_US
            } else {
                TICK_US
            };
            let step_us = ahead_us.min(longest_us);
            let end = state.motion.at() + us(step_us);
            state.muscle.advance(&mut state.motion, end);
            self.apply_fatigue(state, step_us);
        }
    }

    /// `us` passed: at an update, the pulses' gains follow A.
    #[inline]
    fn apply_fatigue(&self, state: &mut MuscleModelState, us: u32) {
        let Some(fatigue) = &self.fatigue else {
            return;
        };
        let force = state.muscle.share(&state.motion);
        if fatigue.advance(&mut state.tired, &mut state.muscle, force, us) {
            let gain = state.tired.fatigued_gain(state.gain);
            state.muscle.drive_with(&mut state.motion, gain);
        }
    }
}
