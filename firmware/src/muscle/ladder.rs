//! Levels of the muscle model, from none to fatigue, behind one trait, and the change between
//! levels.

use core::fmt;

use fixed::types::U1F31;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::fatigue::{Fatigue, FatigueSpec, FatigueState};
use super::segment::TICK_US;
use super::tabulated::drive;
use super::{
    CalciumForce, CalciumForceSpec, CalciumForceState, Gain, Recruitment, RecruitmentSpec,
    TablePlan, TabulatedForce, TabulatedForceState,
};
use crate::range::OutOfRange;
use crate::units::{Force, Micros, us};

/// Level of detail of a muscle model, lowest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, Schema)]
pub enum MuscleLevel {
    /// No model: no force is predicted, and force control uses the inverse alone.
    None,
    /// Calcium–force model, Lee 2020, equations (2) and (3).
    CalciumForce,
    /// Calcium–force model with parameters that change with fatigue (Ding 2003).
    CalciumForceFatigue,
}

impl MuscleLevel {
    /// All model levels, lowest first.
    pub const ALL: [Self; 3] = [Self::None, Self::CalciumForce, Self::CalciumForceFatigue];
}

/// A model of one muscle with validated parameters. Any number of states can use one model.
pub trait Model {
    /// State of one muscle.
    type State: Copy;
    /// Returns the state of a muscle without force at time `at`.
    fn at_rest(&self, at: Micros) -> Self::State;
    /// Applies a pulse at `at` that drives the muscle with `gain`.
    fn pulse(&self, state: &mut Self::State, at: Micros, gain: Gain);
    /// Advances the state to `to`; an earlier time has no effect.
    fn advance(&self, state: &mut Self::State, to: Micros);
    /// Returns the force at the state's time.
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

/// Error: a model level with fatigue was requested for a muscle without a [`FatigueSpec`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoFatigue;

impl fmt::Display for NoFatigue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the muscle has no fatigue parameters")
    }
}

impl core::error::Error for NoFatigue {}

/// Reason why [`MuscleModel::new`] refuses a muscle.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MuscleModelError {
    /// A parameter is outside its range.
    Range(OutOfRange),
    /// The model level needs a [`FatigueSpec`].
    NoFatigue,
}

/// The muscle of a channel, as a host configures it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct MuscleSpec {
    /// Parameters of the force model.
    pub force: CalciumForceSpec,
    /// Recruitment of the muscle by amplitude.
    pub recruitment: RecruitmentSpec,
    /// Fatigue parameters, which [`MuscleLevel::CalciumForceFatigue`] needs.
    pub fatigue: Option<FatigueSpec>,
    /// Model level at the start.
    pub level: MuscleLevel,
}

impl MuscleSpec {
    /// Creates a muscle without fatigue, at [`MuscleLevel::CalciumForce`].
    #[must_use]
    pub const fn new(force: CalciumForceSpec, recruitment: RecruitmentSpec) -> Self {
        Self {
            force,
            recruitment,
            fatigue: None,
            level: MuscleLevel::CalciumForce,
        }
    }

    /// Derives the constants of the muscle and of its recruitment.
    ///
    /// # Errors
    /// Returns the errors of [`MuscleModel::new`], and [`MuscleModelError::Range`] for the errors
    /// of [`Recruitment::new`].
    pub fn validate(&self) -> Result<(MuscleModel, Recruitment), MuscleModelError> {
        let ladder = MuscleModel::new(self.force, self.fatigue, self.level)?;
        let recruitment = Recruitment::new(self.recruitment).map_err(MuscleModelError::Range)?;
        Ok((ladder, recruitment))
    }
}

/// One muscle at any model level: validated parameters and the initial level.
///
/// A muscle without fatigue may have a [`TabulatedForce`], whose memory and time the caller has: one
/// that is complete is [adopted](Self::adopt), and then goes with every call. Until then, and for a
/// muscle without a table, [`CalciumForce`] integrates the force.
#[derive(Clone, Copy, Debug)]
pub struct MuscleModel {
    fresh: CalciumForce,
    plan: Option<TablePlan>,
    fatigue: Option<Fatigue>,
    first: MuscleLevel,
}

/// State of one muscle at any model level.
#[derive(Clone, Copy, Debug)]
pub struct MuscleModelState {
    /// Muscle with the parameters that fatigue has left.
    muscle: CalciumForce,
    tired: FatigueState,
    /// Gain of the last pulse that reached the muscle, before fatigue, Q31.
    gain: u32,
    level: MuscleLevel,
    /// State of the calcium–force model; unchanged while no model runs, and with a table.
    motion: CalciumForceState,
    /// State by the table, once that is adopted.
    tabulated: Option<TabulatedForceState>,
}

impl MuscleModelState {
    /// Returns the present model level.
    #[must_use]
    pub const fn model_level(&self) -> MuscleLevel {
        self.level
    }

    /// Returns the share of A that fatigue has left, 0…1; 1 for a muscle without fatigue.
    #[must_use]
    pub const fn strength(&self) -> U1F31 {
        U1F31::from_bits(self.tired.a)
    }
}

impl MuscleModel {
    /// Derives the constants of a muscle that starts at the model level `first`.
    ///
    /// # Errors
    /// Returns [`MuscleModelError::Range`] for the errors of [`CalciumForce::new`] and for
    /// parameters of `fatigue` outside their ranges; [`MuscleModelError::NoFatigue`] if `first`
    /// needs fatigue parameters that are absent.
    pub fn new(
        force: CalciumForceSpec,
        fatigue: Option<FatigueSpec>,
        first: MuscleLevel,
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
        if first == MuscleLevel::CalciumForceFatigue && fatigue.is_none() {
            return Err(MuscleModelError::NoFatigue);
        }
        // Fatigue changes K and τ1 once a second, and the whole table with them.
        let plan = match fatigue {
            None => TablePlan::new(&force).map_err(MuscleModelError::Range)?,
            Some(_) => None,
        };
        Ok(Self {
            fresh,
            plan,
            fatigue,
            first,
        })
    }

    /// Returns the plan of the muscle's table; `None` for a muscle with fatigue, and where
    /// [`TablePlan::new`] has none.
    #[must_use]
    pub const fn plan(&self) -> Option<TablePlan> {
        self.plan
    }

    /// Lets a complete table of [`Self::plan`] compute the force from now on. Force and calcium stay
    /// as they are.
    pub fn adopt(&self, table: &TabulatedForce, state: &mut MuscleModelState) {
        let at = state.motion.at();
        let share = state.muscle.share(&state.motion);
        let calcium = state.muscle.calcium(&state.motion).to_bits();
        let gain = state.tired.fatigued_gain(state.gain);
        state.tabulated = Some(table.state_of(at, share, calcium, gain));
    }

    /// Returns the model level at which a muscle starts.
    #[must_use]
    pub const fn initial_model_level(&self) -> MuscleLevel {
        self.first
    }

    /// Changes the model level at `now`. Between the upper two levels, force and calcium stay as
    /// they are. From [`MuscleLevel::None`] they begin at rest, as if no pulse had come before; in
    /// a train, the force is right after about five times τ1 + τ2. At lower levels than
    /// [`MuscleLevel::CalciumForceFatigue`] fatigue neither grows nor recovers, and keeps its
    /// effect.
    ///
    /// # Errors
    /// Returns [`NoFatigue`] if the level needs fatigue parameters that are absent; nothing
    /// changes.
    pub fn switch(
        &self,
        state: &mut MuscleModelState,
        level: MuscleLevel,
        now: Micros,
    ) -> Result<(), NoFatigue> {
        if level == MuscleLevel::CalciumForceFatigue && self.fatigue.is_none() {
            return Err(NoFatigue);
        }
        if state.level == MuscleLevel::None {
            state.motion = CalciumForceState::at_rest(now);
            state.tabulated = state.tabulated.map(|_| TabulatedForceState::at_rest(now));
        }
        state.level = level;
        Ok(())
    }

    /// Returns the force at the state's time, or `None` while no model runs. `table` is the adopted
    /// one, or any before that.
    #[must_use]
    pub fn predicted_force(
        &self,
        table: &TabulatedForce,
        state: &MuscleModelState,
    ) -> Option<Force> {
        let force = || match &state.tabulated {
            Some(tabulated) => table.force(tabulated),
            None => state.muscle.force(&state.motion),
        };
        (state.level != MuscleLevel::None).then(force)
    }

    /// Applies a pulse; a pulse with [`Gain::ZERO`] reaches no fibre and changes nothing. `table` is
    /// as for [`Self::predicted_force`].
    #[inline(always)]
    pub fn pulse_by(
        &self,
        table: &TabulatedForce,
        state: &mut MuscleModelState,
        at: Micros,
        gain: Gain,
    ) {
        if gain == Gain::ZERO || state.level == MuscleLevel::None {
            return;
        }
        state.gain = gain.get().to_bits();
        if let Some(tabulated) = &mut state.tabulated {
            // The most common case; it has no fatigue.
            return table.pulse_with(tabulated, at, drive(state.gain));
        }
        let gain = state.tired.fatigued_gain(state.gain);
        if state.level == MuscleLevel::CalciumForce {
            state.muscle.pulse_with(&mut state.motion, at, gain);
        } else {
            self.pulse_with_fatigue(state, at, gain);
        }
    }

    /// Advances the state to `to`; an earlier time has no effect. `table` is as for
    /// [`Self::predicted_force`].
    #[inline(always)]
    pub fn advance_by(&self, table: &TabulatedForce, state: &mut MuscleModelState, to: Micros) {
        match (state.level, &mut state.tabulated) {
            (MuscleLevel::None, _) => {}
            (_, Some(tabulated)) => table.advance(tabulated, to),
            (MuscleLevel::CalciumForce, None) => state.muscle.advance(&mut state.motion, to),
            (MuscleLevel::CalciumForceFatigue, None) => self.advance_with_fatigue(state, to),
        }
    }
}

/// The model without a table.
impl Model for MuscleModel {
    type State = MuscleModelState;

    fn at_rest(&self, at: Micros) -> MuscleModelState {
        MuscleModelState {
            muscle: self.fresh,
            tired: FatigueState::NONE,
            gain: 0,
            level: self.first,
            motion: CalciumForceState::at_rest(at),
            tabulated: None,
        }
    }

    fn pulse(&self, state: &mut MuscleModelState, at: Micros, gain: Gain) {
        self.pulse_by(&TabulatedForce::NONE, state, at, gain);
    }

    fn advance(&self, state: &mut MuscleModelState, to: Micros) {
        self.advance_by(&TabulatedForce::NONE, state, to);
    }

    /// Returns [`Self::predicted_force`], or 0 N while no model runs.
    fn force(&self, state: &MuscleModelState) -> Force {
        let force = self.predicted_force(&TabulatedForce::NONE, state);
        force.unwrap_or_default()
    }
}

impl MuscleModel {
    /// Applies a pulse at [`MuscleLevel::CalciumForceFatigue`].
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

    /// Implements [`Self::advance`] for any time, in steps of at most 1 ms, each counted as work;
    /// at rest, in steps of a second.
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

    /// Adds the work of `us` microseconds. After an update of A, adapts the drive of the latest
    /// pulse.
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
