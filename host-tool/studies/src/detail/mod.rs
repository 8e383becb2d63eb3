//! Judges the level of detail that `[fidelity]` chooses for a simulated hand or arm, on random
//! sessions, and plays the session with which its cost is counted.
//!
//! `hands` and `arms` generate the sessions of a limb, `judged` computes verdicts and tables. The
//! choice itself is in `host_core::choice`, the figure in `figures`. Seeds, tolerances, sessions and
//! levels were fixed before the first judged run, and not changed because of its results.

mod arms;
mod hands;
mod judged;

pub use judged::{Row, Summary, Verdict, csv, read_csv};

use crate::hamana2022::{Participants, Population, TwoPointsError};
use crate::ladder::DrawError;
use host_core::choice::{ARM_STEPS_MS, Effect, PlayError, SEED, try_arm_steps, try_units};
use host_core::run::{DeviceName, run};
use host_core::session::{Session, Share};
use rayon::prelude::*;
use std::fmt::Display;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Seed of the sessions on which the choice is judged.
pub const JUDGED: u64 = 2_027;
/// Seed of the sessions that were used while the choice was developed; they are not judged.
pub const DEVELOPMENT: u64 = 8;
/// Number of sessions on which the choice is judged.
pub const SESSIONS: usize = 200;
/// Noise seeds with which `[fidelity]` chooses.
const CHOSEN: [u64; 2] = [SEED, SEED + 1];
/// Noise seed of the simulated wearer on which a choice is judged. The choice itself was made with
/// other seeds.
pub const NOISE: u64 = 101;

/// Largest number of sessions of an arm that are generated for one that can be judged.
const ATTEMPTS: usize = 50;

/// A simulated limb whose level of detail is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limb {
    /// Forearm and hand; its level is the number of motor units per pool.
    Hand,
    /// Arm; its level is the time step, ms.
    Arm,
}

/// Reason why a session was not judged.
#[derive(Debug, thiserror::Error)]
pub enum DetailError {
    /// A hand is invalid, or its searches failed.
    #[error(transparent)]
    Hand(#[from] TwoPointsError),
    /// The session cannot be simulated.
    #[error(transparent)]
    Play(#[from] PlayError),
    /// No random limb has a session.
    #[error(transparent)]
    Draw(#[from] DrawError),
}

impl DetailError {
    /// Returns the error for a session of this program that is invalid, which is a defect.
    fn invalid<E: Display>(error: E) -> Self {
        Self::Hand(TwoPointsError::Declaration(format!(
            "a session with which the detail of a limb is judged: {error}"
        )))
    }
}

impl Limb {
    /// Every limb, in the order in which it is judged.
    pub const ALL: [Self; 2] = [Self::Hand, Self::Arm];

    /// Returns the word for the limb in commands and file names.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hand => "hand",
            Self::Arm => "arm",
        }
    }

    /// Returns the column of the setting in the table of costs.
    #[must_use]
    pub const fn setting(self) -> &'static str {
        match self {
            Self::Hand => "units",
            Self::Arm => "step_ms",
        }
    }

    /// Returns the tolerances at which the choice is judged.
    #[must_use]
    pub const fn tolerances(self) -> &'static [Share] {
        match self {
            Self::Hand => &[Share(100), Share(300), Share(1_000), Share(3_000)],
            Self::Arm => &[Share(10), Share(30), Share(100), Share(300), Share(1_000)],
        }
    }

    /// Returns the length of the session with which the limb's cost is counted, s.
    #[must_use]
    pub const fn counted_s(self) -> f64 {
        match self {
            Self::Hand => 4.0,
            Self::Arm => 6.0,
        }
    }

    /// Returns the levels whose cost is counted, the most detailed first.
    ///
    /// # Errors
    /// Fails if the counted session is invalid.
    pub fn counted_levels(self) -> Result<Vec<u32>, DetailError> {
        match self {
            Self::Hand => hands::counted_units(self.counted_s()),
            Self::Arm => Ok(ARM_STEPS_MS.to_vec()),
        }
    }

    /// Plays the counted session at this level once, for a program that counts instructions.
    ///
    /// # Errors
    /// Fails if the session is invalid or ends early.
    pub fn play_counted(self, level: u32) -> Result<(), DetailError> {
        let file = match self {
            Self::Hand => hands::counted(level, self.counted_s()),
            Self::Arm => arms::counted(level, self.counted_s()),
        }?;
        let port = DeviceName::Native.open(&file.session, SEED);
        let (outcome, _) = run(&file, port.map_err(PlayError::from)?, None, |_: f64| ());
        outcome
            .error
            .map_or(Ok(()), |error| Err(PlayError::from(error).into()))
    }

    fn try_levels(self, session: &Session, seeds: &[u64]) -> Result<Vec<Effect>, PlayError> {
        match self {
            Self::Hand => try_units(session, seeds),
            Self::Arm => try_arm_steps(session, seeds),
        }
    }

    /// Judges the first `count` sessions of `seed`; `step` receives the finished part, 0 to 1.
    ///
    /// # Errors
    /// Fails if a session cannot be generated or simulated.
    pub fn campaign(
        self,
        seed: u64,
        count: usize,
        step: impl Fn(f64) + Sync,
    ) -> Result<Vec<Row>, DetailError> {
        let population = Population::load_embedded()?;
        let participants = Participants::load(None)?;
        let done = AtomicUsize::new(0);
        let rows = (0..count).into_par_iter().map(|index| {
            let row = match self {
                Self::Hand => {
                    let (wearer, method, session) =
                        hands::session(seed, index, (&population, &participants))?;
                    let facts = vec![("wearer", wearer), ("method", method.name().to_owned())];
                    self.judge(index, facts, &session)?
                }
                Self::Arm => judge_arm(seed, index)?,
            };
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            step(done as f64 / count as f64);
            Ok(row)
        });
        rows.collect()
    }

    fn judge(
        self,
        index: usize,
        facts: Vec<(&'static str, String)>,
        session: &Session,
    ) -> Result<Row, PlayError> {
        Ok(Row {
            session: index,
            facts,
            duration_s: session.duration_us as f64 * 1e-6,
            tried: self.try_levels(session, &CHOSEN)?,
            judged: self.try_levels(session, &[NOISE])?,
        })
    }
}

/// Judges a random session of an arm. One that the device ends early in any play, and one in which
/// no muscle acts, so that no step has an error, is generated again.
fn judge_arm(seed: u64, index: usize) -> Result<Row, DetailError> {
    for attempt in 0..ATTEMPTS {
        let (held, session) = arms::session(seed, index, attempt)?;
        let facts = vec![("held", held.to_owned())];
        let judged = Limb::Arm.judge(index, facts, &session);
        let acts = |row: &Row| row.judged.iter().any(|effect| effect.error > 0.0);
        if let Some(row) = judged.ok().filter(acts) {
            return Ok(row);
        }
    }
    Err(DetailError::Draw(DrawError {
        index,
        why: format!("none of {ATTEMPTS} random arms could be played"),
    }))
}
