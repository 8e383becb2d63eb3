//! The fidelity ladder: models of the same muscle, from cheap to complete,
//! behind one trait, and the change from one to another.

use core::fmt;

use fixed::types::U1F31;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::calcium_force::TICK_US;
use super::fatigue::{Fatigue, FatigueSpec, Tiredness};
use super::lag::LagState;
use super::rhythm::{Rhythm, calcium};
use super::steady::StaticState;
use super::{
    CalciumForce, CalciumForceSpec, CalciumForceState, Gain, Recruitment, RecruitmentSpec,
};
use crate::range::OutOfRange;
use crate::units::{Force, Micros, us};

/// How much of a muscle is modelled, least first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize, Schema)]
pub enum Rung {
    /// Recruitment only: force follows amplitude and pulse rate at once.
    Static,
    /// Rise and fall time constants, gain by frequency.
    Lag,
    /// Lee 2020, equations (2) and (3).
    CalciumForce,
    /// The same, with parameters that tire (Ding 2003).
    CalciumForceFatigue,
}

impl Rung {
    /// All rungs, lowest first.
    pub const ALL: [Self; 4] = [
        Self::Static,
        Self::Lag,
        Self::CalciumForce,
        Self::CalciumForceFatigue,
    ];
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

/// What [`Ladder::new`] refuses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LadderError {
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
    /// As [`Ladder::new`]; [`LadderError::Range`] as [`Recruitment::new`].
    pub fn validate(&self) -> Result<(Ladder, Recruitment), LadderError> {
        let ladder = Ladder::new(self.force, self.fatigue, self.rung)?;
        let recruitment = Recruitment::new(self.recruitment).map_err(LadderError::Range)?;
        Ok((ladder, recruitment))
    }
}

/// One muscle on any rung: validated parameters and the rung it starts on.
#[derive(Clone, Copy, Debug)]
pub struct Ladder {
    fresh: CalciumForce,
    fatigue: Option<Fatigue>,
    first: Rung,
}

/// Where one muscle on some rung is.
#[derive(Clone, Copy, Debug)]
pub struct LadderState {
    /// The muscle as tired as it is.
    muscle: CalciumForce,
    tired: Tiredness,
    rhythm: Rhythm,
    motion: Motion,
}

/// Force and what drives it, by rung.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Motion {
    Static(StaticState),
    Lag(LagState),
    CalciumForce(CalciumForceState),
    CalciumForceFatigue(CalciumForceState),
}

impl LadderState {
    /// The rung it is on.
    #[must_use]
    pub const fn rung(&self) -> Rung {
        match self.motion {
            Motion::Static(_) => Rung::Static,
            Motion::Lag(_) => Rung::Lag,
            Motion::CalciumForce(_) => Rung::CalciumForce,
            Motion::CalciumForceFatigue(_) => Rung::CalciumForceFatigue,
        }
    }

    /// The time the state holds for: a pulse that was told of early may have
    /// carried it up to 1 ms ahead.
    #[must_use]
    pub const fn at(&self) -> Micros {
        match &self.motion {
            Motion::Static(state) => state.at,
            Motion::Lag(state) => state.at,
            Motion::CalciumForce(state) | Motion::CalciumForceFatigue(state) => state.at(),
        }
    }

    /// F over full scale, Q63.
    fn force(&self) -> i64 {
        match &self.motion {
            Motion::Static(state) => state.force(),
            Motion::Lag(state) => state.force,
            Motion::CalciumForce(state) | Motion::CalciumForceFatigue(state) => {
                i64::from(self.muscle.share(state)) << 32
            }
        }
    }

    /// What work has left of A, 0…1: 1 for a muscle that does not tire.
    #[must_use]
    pub const fn strength(&self) -> U1F31 {
        U1F31::from_bits(self.tired.a)
    }
}

impl Ladder {
    /// Derives the constants of a muscle that starts on `first`.
    ///
    /// # Errors
    /// [`LadderError::Range`] as [`CalciumForce::new`], and the same for the
    /// parameters of `fatigue`; [`LadderError::NoFatigue`] if `first` needs it.
    pub fn new(
        force: CalciumForceSpec,
        fatigue: Option<FatigueSpec>,
        first: Rung,
    ) -> Result<Self, LadderError> {
        let (fresh, fatigue) = match fatigue {
            None => (CalciumForce::new(force).map_err(LadderError::Range)?, None),
            Some(spec) => {
                let (fresh, fatigue) = Fatigue::new(force, spec).map_err(LadderError::Range)?;
                (fresh, Some(fatigue))
            }
        };
        if first == Rung::CalciumForceFatigue && fatigue.is_none() {
            return Err(LadderError::NoFatigue);
        }
        Ok(Self {
            fresh,
            fatigue,
            first,
        })
    }

    /// The rung a muscle starts on.
    #[must_use]
    pub const fn first(&self) -> Rung {
        self.first
    }

    /// Changes the rung. The force of this moment stays what it is, but for
    /// rounding (2^-31 of full scale); from there on it follows the new rung.
    ///
    /// Lag takes the force over as its own; Static lets the difference fade
    /// with τ1 + τ2; calcium, which they do not know, becomes that of a steady
    /// train with the last interval. Fatigue stands still below its own rung,
    /// neither growing nor recovering, and keeps its effect there.
    ///
    /// # Errors
    /// [`NoFatigue`], and nothing changes.
    pub fn switch(&self, state: &mut LadderState, rung: Rung) -> Result<(), NoFatigue> {
        if rung == Rung::CalciumForceFatigue && self.fatigue.is_none() {
            return Err(NoFatigue);
        }
        if rung == state.rung() {
            return Ok(());
        }
        let (at, force) = (state.at(), state.force());
        match &state.motion {
            // The clock may have wrapped since the last pulse.
            Motion::CalciumForce(motion) | Motion::CalciumForceFatigue(motion)
                if motion.is_at_rest() =>
            {
                state.rhythm.forget();
            }
            _ => state.rhythm.pass(at),
        }
        let (muscle, rhythm) = (&state.muscle, &state.rhythm);
        let gain = state.tired.of(rhythm.gain);
        state.motion = match rung {
            Rung::Static => Motion::Static(StaticState::at(at, force, muscle, rhythm, gain)),
            Rung::Lag => Motion::Lag(LagState::at(at, force, muscle, rhythm, gain)),
            Rung::CalciumForce | Rung::CalciumForceFatigue => {
                let state = match state.motion {
                    Motion::CalciumForce(same) | Motion::CalciumForceFatigue(same) => same,
                    Motion::Static(_) | Motion::Lag(_) => {
                        let calcium = calcium(muscle, rhythm, at);
                        muscle.resumed(at, (force >> 32) as i32, calcium, gain)
                    }
                };
                if rung == Rung::CalciumForce {
                    Motion::CalciumForce(state)
                } else {
                    Motion::CalciumForceFatigue(state)
                }
            }
        };
        Ok(())
    }
}

impl Model for Ladder {
    type State = LadderState;

    fn at_rest(&self, at: Micros) -> LadderState {
        let (muscle, rhythm) = (self.fresh, Rhythm::NONE);
        let motion = match self.first {
            Rung::Static => Motion::Static(StaticState::at(at, 0, &muscle, &rhythm, 0)),
            Rung::Lag => Motion::Lag(LagState::at(at, 0, &muscle, &rhythm, 0)),
            Rung::CalciumForce => Motion::CalciumForce(CalciumForceState::at_rest(at)),
            Rung::CalciumForceFatigue => {
                Motion::CalciumForceFatigue(CalciumForceState::at_rest(at))
            }
        };
        LadderState {
            muscle,
            tired: Tiredness::NONE,
            rhythm,
            motion,
        }
    }

    /// A pulse with [`Gain::ZERO`] reaches no fibre and changes nothing.
    #[inline(always)]
    fn pulse(&self, state: &mut LadderState, at: Micros, gain: Gain) {
        if gain == Gain::ZERO {
            return;
        }
        let bits = gain.get().to_bits();
        state.rhythm.beat(at, bits);
        let gain = state.tired.of(bits);
        // What most muscles run on goes first, without a call.
        if let Motion::CalciumForce(motion) = &mut state.motion {
            state.muscle.pulse_with(motion, at, gain);
        } else {
            self.pulse_other(state, at, gain);
        }
    }

    #[inline(always)]
    fn advance(&self, state: &mut LadderState, to: Micros) {
        if let Motion::CalciumForce(motion) = &mut state.motion {
            state.muscle.advance(motion, to);
        } else if let Motion::Lag(motion) = &mut state.motion {
            motion.advance(&mut state.rhythm, to);
        } else {
            self.advance_other(state, to);
        }
    }

    fn force(&self, state: &LadderState) -> Force {
        state.muscle.newtons((state.force() >> 32) as u32)
    }
}

impl Ladder {
    /// A pulse on another rung than [`Rung::CalciumForce`].
    #[inline(never)]
    fn pulse_other(&self, state: &mut LadderState, at: Micros, gain: u32) {
        match &mut state.motion {
            Motion::Static(motion) => motion.pulse(&state.muscle, &mut state.rhythm, at, gain),
            Motion::Lag(motion) => motion.pulse(&state.muscle, &mut state.rhythm, at, gain),
            Motion::CalciumForce(motion) | Motion::CalciumForceFatigue(motion) => {
                let before = motion.at();
                state.muscle.pulse_with(motion, at, gain);
                let passed_us = motion.at().elapsed_since(before);
                if passed_us > 0 {
                    self.tire(state, passed_us);
                }
            }
        }
    }

    #[inline(never)]
    fn advance_other(&self, state: &mut LadderState, to: Micros) {
        match &mut state.motion {
            Motion::Lag(motion) => motion.advance(&mut state.rhythm, to),
            Motion::Static(motion) => motion.advance(&mut state.rhythm, to),
            Motion::CalciumForce(motion) | Motion::CalciumForceFatigue(motion) => {
                if (to - motion.at()).us() == TICK_US.cast_signed() {
                    state.muscle.advance(motion, to);
                    self.tire(state, TICK_US);
                } else {
                    self.advance_tiring(state, to);
                }
            }
        }
    }

    /// [`Self::advance`] by any time: steps of at most 1 ms, each counted as work; at rest, of a second.
    #[inline(never)]
    fn advance_tiring(&self, state: &mut LadderState, to: Micros) {
        while let Motion::CalciumForceFatigue(motion) = &mut state.motion {
            let ahead_us = to.elapsed_since(motion.at());
            if ahead_us == 0 {
                return;
            }
            let longest_us = if motion.is_at_rest() {
                super::fatigue::UPDATE_US
            } else {
                TICK_US
            };
            let step_us = ahead_us.min(longest_us);
            let end = motion.at() + us(step_us);
            state.muscle.advance(motion, end);
            self.tire(state, step_us);
        }
    }

    /// `us` passed: at an update, the pulses' gains follow A.
    #[inline]
    fn tire(&self, state: &mut LadderState, us: u32) {
        let (Motion::CalciumForceFatigue(motion), Some(fatigue)) =
            (&mut state.motion, &self.fatigue)
        else {
            return;
        };
        let force = state.muscle.share(motion);
        if fatigue.pass(&mut state.tired, &mut state.muscle, force, us) {
            state
                .muscle
                .drive_with(motion, state.tired.of(state.rhythm.gain));
        }
    }
}
