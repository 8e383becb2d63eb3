//! Chooses the cheapest muscle model that is accurate enough, by trying the session.
//!
//! The submodules are `fidelity` (control law, telemetry, body), `hand` (motor units of a simulated
//! hand), `arm` (time step of a simulated arm), `deviation` (of a coarser limb), `effect` (the error
//! of a setting), `play` (a session in memory and the true forces of its pulses), `cost` (cycles),
//! `stream` (the worst that a live client may send), `tried` (errors of the outputs in use) and
//! `pulsed` (sessions where pulses alone decide).
//! The models are in `firmware::muscle`, and `run` runs sessions. The input is a session with
//! `"auto"` models and a tolerance. The output is a [`Choice`]: for each channel the outputs in
//! use, each model level's error and cycles, and the chosen level.

mod arm;
mod cost;
mod deviation;
mod effect;
mod fidelity;
mod hand;
mod play;
mod pulsed;
mod stream;
mod tried;

pub use arm::{ARM_STEPS_MS, arm_muscles, try_arm_steps, with_arm_step};
pub use cost::{Cycles, cycles, measured_levels};
pub use effect::{Effect, coarsest};
pub use fidelity::Fidelity;
pub use hand::{UNITS, try_units, with_units};
pub use play::{PlayError, PlayedSession, Pulse, fatigue, muscle_forces};
pub use stream::with_courses;
pub use tried::{LevelResult, ModelUses};

use crate::record::Trial;
use crate::session::{BodySpec, Model, Muscle, Session, Share, level_name};
use firmware::muscle::MuscleLevel;
use tried::Trials;

/// Seed of the simulated wearer with which sessions are tried.
pub const SEED: u64 = 1;

/// Result of the choice for one channel: the model level that its muscle needs, and the level that
/// it gets.
#[derive(Clone, PartialEq, Debug)]
pub struct Need {
    /// Index of the channel in [`Session::channels`].
    pub place: usize,
    /// Outputs of the muscle model that the session uses.
    pub uses: ModelUses,
    /// Cheapest model level whose error is within the tolerance; `None` if there is none.
    pub enough: Option<MuscleLevel>,
    /// Model level that the muscle gets: the level that the session file fixes, or with `"auto"`
    /// the cheapest level within the tolerance, or else the most accurate level.
    pub level: MuscleLevel,
    /// Results of each model level that the muscle allows, the most detailed last.
    pub tried: Vec<LevelResult>,
    /// Error of the channel's outputs in use when every channel runs at the level that it gets.
    pub together: f64,
    /// Whether the muscle got a more detailed level than it needs by itself, because the levels
    /// together were not accurate enough.
    pub raised: bool,
}

impl Need {
    /// Returns the smallest error of any model level, and that level.
    #[must_use]
    pub fn smallest_error(&self) -> (f64, MuscleLevel) {
        let results = self.tried.iter().map(|trial| (trial.error(), trial.level));
        results
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((0.0, self.level))
    }
}

/// Result of the choice for all channels of a session.
#[derive(Clone, PartialEq, Debug)]
pub struct Choice {
    /// Largest error that was allowed, as a share of the largest true force.
    pub tolerance: Share,
    /// Length of the part that was tried, µs from the session's start.
    pub tried_us: u64,
    /// Number of times that a session was played, over all variants and model levels.
    pub plays: usize,
    /// Number of variants of the session that were tried: the file's own, and one for each worst
    /// course within its declared bounds.
    pub sessions: usize,
    /// Results for the channels that have a muscle.
    pub needs: Vec<Need>,
    /// Errors of the settings besides the models; empty for a session without `[fidelity]`.
    pub fidelity: Fidelity,
}

/// Reason why no model levels could be chosen.
#[derive(Debug, thiserror::Error)]
pub enum ChoiceError {
    /// The session could not be played (E552).
    #[error("E552 the session cannot be simulated to choose its muscle models: {0}")]
    Unplayed(PlayError),
    /// No model level is within the tolerance (E553).
    #[error(
        "E553 channel {channel}: no model level has an error within the tolerance of {tolerance}; the smallest error is \
         {least_percent:.2} % ({best}); allow that error, or set `report = false` if nobody reads the force"
    )]
    NoRung {
        /// Channel, counted from 1.
        channel: u8,
        /// Tolerance that was requested.
        tolerance: Share,
        /// Smallest error of any model level on this channel, %, rounded up.
        least_percent: f64,
        /// Name of the model level with the smallest error.
        best: &'static str,
    },
}

impl From<PlayError> for ChoiceError {
    fn from(why: PlayError) -> Self {
        Self::Unplayed(why)
    }
}

impl Share {
    /// Returns the share as a fraction, from 0 for 0 % to 1 for 100 %.
    #[must_use]
    pub fn fraction(self) -> f64 {
        f64::from(self.0) * 1e-4
    }
}

/// Tries `session` with every model level that its muscles allow, on the native backend, in memory,
/// and with a simulated wearer whose noise `seed` determines. For each channel it chooses the
/// cheapest level, in cycles, whose error in the outputs in use is within `tolerance`. A channel
/// whose level the file fixes keeps that level and the file's later `changes`.
///
/// A level is tried on all channels at once, because no channel's pulses and report depend on
/// another's level. Then the chosen levels are played together. While any channel's error exceeds
/// the tolerance, the channel with the largest error gets its next level.
///
/// A session that declares bounds for a live client is also tried with the worst courses within
/// these bounds. The largest error of all variants counts.
///
/// Of a session longer than [`Session::try_us`], only the first part is tried.
///
/// # Errors
/// [`ChoiceError::Unplayed`].
pub fn choose(session: &Session, tolerance: Share, seed: u64) -> Result<Choice, ChoiceError> {
    let tried_us = session.duration_us.min(session.try_us);
    let sessions = stream::trial_sessions(session, tried_us);
    let mut trials = Trials::play(&sessions, seed)?;
    let mut needs: Vec<Need> = (session.channels.iter().enumerate())
        .filter_map(|(place, channel)| {
            let muscle = channel.muscle.as_ref()?;
            let tried = trials.level_results(place);
            let within = tried
                .iter()
                .filter(|trial| trial.error() <= tolerance.fraction());
            let enough = within.min_by(|a, b| a.cost().total_cmp(&b.cost()));
            let enough = enough.map(|trial| trial.level);
            let mut need = Need {
                place,
                uses: trials.used_outputs(place),
                enough,
                level: muscle.initial_level(),
                together: 0.0,
                tried,
                raised: false,
            };
            if muscle.model == Model::Auto {
                need.level = enough.unwrap_or(need.smallest_error().1);
            }
            Some(need)
        })
        .collect();
    loop {
        let together = trials.combined_errors(&chosen_levels(&needs).collect::<Vec<_>>())?;
        for (need, error) in needs.iter_mut().zip(together) {
            need.together = error;
        }
        let is_free = |need: &&mut Need| {
            let muscle = session.channels[need.place].muscle.as_ref();
            let above = need.tried.iter().any(|trial| trial.level > need.level);
            muscle.is_some_and(|muscle| muscle.model == Model::Auto && muscle.changes.is_empty())
                && need.enough.is_some()
                && above
                && need.together > tolerance.fraction()
        };
        let wrong = needs.iter_mut().filter(is_free);
        let Some(worst) = wrong.max_by(|a, b| a.together.total_cmp(&b.together)) else {
            break;
        };
        let next = worst.tried.iter().find(|trial| trial.level > worst.level);
        worst.level = next.map_or(worst.level, |trial| trial.level);
        worst.raised = true;
    }
    Ok(Choice {
        tolerance,
        tried_us,
        plays: trials.play_count(),
        sessions: sessions.len(),
        fidelity: match session.has_fidelity {
            true => fidelity::try_settings(
                &with_levels(session, chosen_levels(&needs)),
                tried_us,
                seed,
            )?,
            false => Fidelity::default(),
        },
        needs,
    })
}

/// Returns the index of each channel that has a muscle, with the model level that it gets.
fn chosen_levels(needs: &[Need]) -> impl Iterator<Item = (usize, MuscleLevel)> {
    needs.iter().map(|need| (need.place, need.level))
}

/// Returns a copy of `session` in which these channels, given by index, have these `"auto"` levels.
fn with_levels(
    session: &Session,
    levels: impl IntoIterator<Item = (usize, MuscleLevel)>,
) -> Session {
    let mut session = session.clone();
    for (place, level) in levels {
        if let Some(muscle) = &mut session.channels[place].muscle {
            muscle.auto = level;
        }
    }
    session
}

/// Replaces the `"auto"` models of `session` by model levels, and adds notes for the user. With
/// `[fidelity]` it also makes control law, telemetry and simulated finger as coarse as the
/// tolerance allows. A session with neither is left unchanged. If the session cannot be played, its
/// muscles keep the most detailed models, and a note says so.
///
/// # Errors
/// [`ChoiceError::NoRung`] if the session has a `[fidelity]` that no model meets.
pub fn resolve_auto_models(session: &mut Session) -> Result<(), ChoiceError> {
    let is_auto = |muscle: &Muscle| muscle.model == Model::Auto;
    let mut muscles = session.channels.iter().filter_map(|c| c.muscle.as_ref());
    if !muscles.any(is_auto) && !session.has_fidelity {
        return Ok(());
    }
    let tried_us = session.duration_us.min(session.try_us);
    let found = match pulsed::is_decided_by_pulses(session) {
        true => pulsed::choose_levels(session, tried_us, SEED)
            .map(|found| (found, None))
            .map_err(ChoiceError::from),
        false => choose(session, session.tolerance, SEED)
            .map(|choice| (chosen_levels(&choice.needs).collect(), Some(choice))),
    };
    let (found, choice) = match found {
        Ok(found) => found,
        Err(error) => {
            session.notes.push(format!(
                "{error}; \"auto\" therefore uses the most detailed model that each muscle allows"
            ));
            return Ok(());
        }
    };
    let choice = choice.filter(|_| session.has_fidelity);
    if let Some(choice) = &choice {
        choice.check_tolerance(session)?;
        session.notes.extend(choice.tolerance_notes(session));
    }
    if tried_us < session.duration_us {
        session.notes.push(format!(
            "muscle models were chosen from the first {} s of {} s; `fidelity.try_s` sets this time",
            tried_us as f64 * 1e-6,
            session.duration_us as f64 * 1e-6,
        ));
    }
    *session = with_levels(session, found);
    if let Some(choice) = &choice {
        let note = choice
            .fidelity
            .coarsen_session(session, choice.tolerance.fraction());
        let note = match note.is_empty() {
            true => "no setting may be coarser".to_owned(),
            false => note,
        };
        session
            .notes
            .push(format!("fidelity {}: {note}", choice.tolerance));
    }
    Ok(())
}

/// Sets `"auto"` models and `[fidelity]` of `session` to the values that a recorded trial had, so
/// that a rerun repeats it. Returns whether the trial recorded all of them.
pub fn restore_choice(session: &mut Session, trial: &Trial) -> bool {
    let mut is_known = !session.has_fidelity || trial.fidelity.is_some();
    for channel in &mut session.channels {
        let Some(muscle) = &mut channel.muscle else {
            continue;
        };
        let mut recorded_channels = trial.channels.iter();
        let recorded_channel =
            recorded_channels.find(|channel_info| channel_info.number == channel.number);
        let name = recorded_channel.and_then(|channel_info| channel_info.model.as_deref());
        let level = MuscleLevel::ALL
            .into_iter()
            .find(|level| Some(level_name(*level)) == name);
        muscle.auto = level.unwrap_or(muscle.auto);
        is_known &= level.is_some();
    }
    if let Some(found) = trial.fidelity {
        session.telemetry_ms = found.telemetry_ms;
        if let (Some(joint), Some(ms)) = (&mut session.joint, found.law_period_ms) {
            joint.law_period_ms = ms;
        }
        if let (Some(BodySpec::Finger(finger)), Some(us)) =
            (&mut session.body, found.finger_step_us)
        {
            finger.step_us = us;
        }
        if let Some(BodySpec::Hand(hand)) = &mut session.body {
            hand.simulated_units = found.hand_units.map(|units| units as usize);
        }
        if let (Some(BodySpec::Arm { step_ms, .. }), Some(ms)) =
            (&mut session.body, found.arm_step_ms)
        {
            *step_ms = ms;
        }
    }
    is_known
}

impl Choice {
    /// Returns a note for each channel whose error exceeds the tolerance because the session file
    /// fixes its model.
    fn tolerance_notes(&self, session: &Session) -> Vec<String> {
        let coarse = |need: &&Need| need.together > self.tolerance.fraction();
        let notes = self.needs.iter().filter(coarse).map(|need| {
            format!(
                "channel {}: the file's model `{}` has an error of {:.2} %, above the tolerance of {}",
                session.channels[need.place].number,
                level_name(need.level),
                100.0 * need.together,
                self.tolerance,
            )
        });
        notes.collect()
    }

    /// Checks that every channel has a model level within the tolerance.
    ///
    /// # Errors
    /// [`ChoiceError::NoRung`] for the first channel for which no level is accurate enough.
    pub fn check_tolerance(&self, session: &Session) -> Result<(), ChoiceError> {
        let Some(need) = self.needs.iter().find(|need| need.enough.is_none()) else {
            return Ok(());
        };
        let (least, best) = need.smallest_error();
        Err(ChoiceError::NoRung {
            channel: session.channels[need.place].number,
            tolerance: self.tolerance,
            least_percent: (least * 1e4).ceil() * 1e-2,
            best: level_name(best),
        })
    }
}
