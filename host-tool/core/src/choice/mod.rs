//! The cheapest muscle model that will do, found by trying the session.
//!
//! Lives here: `fidelity` (law, telemetry, body), `play` (a session in memory and the true forces of its pulses),
//! `cost` (cycles), `stream` (a live client's worst), `tried` (errors of what is used), `pulsed` (where pulses decide), and the choice. Not here: the
//! models (`firmware::muscle`), how a session runs (`run`).
//! In: a session with `"auto"` models and a tolerance. Out: a [`Choice`]: for each
//! channel what it uses, each rung's error and cycles, and which was taken.

mod cost;
mod fidelity;
mod play;
mod pulsed;
mod stream;
mod tried;

pub use cost::{Cycles, cycles, rungs};
pub use fidelity::{Effect, Fidelity, coarsest};
pub use play::{Played, Pulse, Unplayed, fatigue, forces};
pub use stream::streaming;
pub use tried::{Tried, Uses};

use crate::record::Trial;
use crate::session::{BodySpec, Model, Muscle, Session, Share, rung_name};
use firmware::muscle::Rung;
use tried::Trials;

/// The seed of the simulated wearer under which sessions are tried.
pub const SEED: u64 = 1;

/// What a channel's muscle needs, and what it gets.
#[derive(Clone, PartialEq, Debug)]
pub struct Need {
    /// Its place in [`Session::channels`].
    pub place: usize,
    /// What the session uses of it.
    pub uses: Uses,
    /// The cheapest rung within the tolerance; none if no rung is.
    pub enough: Option<Rung>,
    /// What it gets: the file's rung, or the one that is enough, or else the best.
    pub rung: Rung,
    /// Each rung that the muscle allows, the fullest last.
    pub tried: Vec<Tried>,
    /// The error of what is used with all channels on the rung that they get.
    pub together: f64,
    /// Whether it got more than it needs singly, as all together would not do.
    pub raised: bool,
}

impl Need {
    /// The least error that a rung has, and that rung.
    #[must_use]
    pub fn least(&self) -> (f64, Rung) {
        let all = self.tried.iter().map(|trial| (trial.error(), trial.rung));
        all.min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap_or((0.0, self.rung))
    }
}

/// What a session needs.
#[derive(Clone, PartialEq, Debug)]
pub struct Choice {
    /// What was tolerated.
    pub tolerance: Share,
    /// How much of the session was tried, µs from its start.
    pub tried_us: u64,
    /// How many times it was played.
    pub plays: usize,
    /// Of how many sessions: the file's own, and those within its bounds.
    pub sessions: usize,
    /// Of each channel with a muscle.
    pub needs: Vec<Need>,
    /// What was tried beside the models, of a session with `[fidelity]`.
    pub fidelity: Fidelity,
}

/// Why there is no choice.
#[derive(Debug, thiserror::Error)]
pub enum ChoiceError {
    /// It could not be played.
    #[error("E552 the session cannot be tried: {0}")]
    Unplayed(Unplayed),
    /// No rung is as accurate as that.
    #[error(
        "E553 channel {channel}: no model is within a tolerance of {tolerance}: the least possible here is \
         {least_percent:.2} % ({best}); tolerate that, or set `report = false` where nobody reads the force"
    )]
    NoRung {
        /// From 1.
        channel: u8,
        /// What was asked for.
        tolerance: Share,
        /// The least error, %, rounded up.
        least_percent: f64,
        /// Whose it is.
        best: &'static str,
    },
}

impl From<Unplayed> for ChoiceError {
    fn from(why: Unplayed) -> Self {
        Self::Unplayed(why)
    }
}

impl Share {
    /// As a part.
    #[must_use]
    pub fn part(self) -> f64 {
        f64::from(self.0) * 1e-4
    }
}

/// Tries `session` with every rung that its muscles allow, natively and in memory, on
/// a wearer with this seed, and takes for each channel the cheapest in cycles whose
/// error in what the session uses is within `tolerance`. A channel that is on a rung by
/// the file's word stays there, and goes where its `changes` say.
///
/// A rung is tried on all channels at once: no channel's pulses and report depend on
/// another's rung. Then what was chosen is played together; while any channel errs by
/// more than the tolerance, the one that errs most gets its next rung.
///
/// A session that declares bounds is tried beside the worst within them: the largest
/// error of all counts.
///
/// Of a session longer than [`Session::try_us`] its first part is tried.
///
/// # Errors
/// [`ChoiceError::Unplayed`].
pub fn choose(session: &Session, tolerance: Share, seed: u64) -> Result<Choice, ChoiceError> {
    let tried_us = session.duration_us.min(session.try_us);
    let sessions = stream::sessions(session, tried_us);
    let mut trials = Trials::of(&sessions, seed)?;
    let mut needs: Vec<Need> = (session.channels.iter().enumerate())
        .filter_map(|(place, channel)| {
            let muscle = channel.muscle.as_ref()?;
            let tried = trials.tried(place);
            let within = tried
                .iter()
                .filter(|trial| trial.error() <= tolerance.part());
            let enough = within.min_by(|a, b| a.cost().total_cmp(&b.cost()));
            let enough = enough.map(|trial| trial.rung);
            let mut need = Need {
                place,
                uses: trials.uses(place),
                enough,
                rung: muscle.rung(),
                together: 0.0,
                tried,
                raised: false,
            };
            if muscle.model == Model::Auto {
                need.rung = enough.unwrap_or(need.least().1);
            }
            Some(need)
        })
        .collect();
    loop {
        let together = trials.together(&models(&needs).collect::<Vec<_>>())?;
        for (need, error) in needs.iter_mut().zip(together) {
            need.together = error;
        }
        let is_free = |need: &&mut Need| {
            let muscle = session.channels[need.place].muscle.as_ref();
            let above = need.tried.iter().any(|trial| trial.rung > need.rung);
            muscle.is_some_and(|muscle| muscle.model == Model::Auto && muscle.changes.is_empty())
                && need.enough.is_some()
                && above
                && need.together > tolerance.part()
        };
        let wrong = needs.iter_mut().filter(is_free);
        let Some(worst) = wrong.max_by(|a, b| a.together.total_cmp(&b.together)) else {
            break;
        };
        let next = worst.tried.iter().find(|trial| trial.rung > worst.rung);
        worst.rung = next.map_or(worst.rung, |trial| trial.rung);
        worst.raised = true;
    }
    Ok(Choice {
        tolerance,
        tried_us,
        plays: trials.plays(),
        sessions: sessions.len(),
        fidelity: match session.has_fidelity {
            true => fidelity::tried(&with(session, models(&needs)), tried_us, seed)?,
            false => Fidelity::default(),
        },
        needs,
    })
}

/// Of each place the model that it gets.
fn models(needs: &[Need]) -> impl Iterator<Item = (usize, Rung)> {
    needs.iter().map(|need| (need.place, need.rung))
}

/// `session` with the models that its channels get, by place.
fn with(session: &Session, rungs: impl IntoIterator<Item = (usize, Rung)>) -> Session {
    let mut session = session.clone();
    for (place, rung) in rungs {
        if let Some(muscle) = &mut session.channels[place].muscle {
            muscle.auto = rung;
        }
    }
    session
}

/// Gives `"auto"` models their meaning in this session, and says in its notes what
/// people should know; with `[fidelity]` makes law, telemetry and finger as coarse as
/// its tolerance allows. A session with neither is left alone. One that cannot be played
/// keeps the fullest models, and says so.
///
/// # Errors
/// [`ChoiceError::NoRung`] if the session has a `[fidelity]` that no model meets.
pub fn settle(session: &mut Session) -> Result<(), ChoiceError> {
    let is_auto = |muscle: &Muscle| muscle.model == Model::Auto;
    let mut muscles = session.channels.iter().filter_map(|c| c.muscle.as_ref());
    if !muscles.any(is_auto) && !session.has_fidelity {
        return Ok(());
    }
    let tried_us = session.duration_us.min(session.try_us);
    let found = match pulsed::decide(session) {
        true => pulsed::rungs(session, tried_us, SEED)
            .map(|found| (found, None))
            .map_err(ChoiceError::from),
        false => choose(session, session.tolerance, SEED)
            .map(|choice| (models(&choice.needs).collect(), Some(choice))),
    };
    let (found, choice) = match found {
        Ok(found) => found,
        Err(error) => {
            session.notes.push(format!(
                "{error}; \"auto\" is the fullest model that each muscle allows"
            ));
            return Ok(());
        }
    };
    let choice = choice.filter(|_| session.has_fidelity);
    if let Some(choice) = &choice {
        choice.refuse(session)?;
        session.notes.extend(choice.coarse(session));
    }
    if tried_us < session.duration_us {
        session.notes.push(format!(
            "muscle models were chosen by the first {} s of {} s; `fidelity.try_s` says how much",
            tried_us as f64 * 1e-6,
            session.duration_us as f64 * 1e-6,
        ));
    }
    *session = with(session, found);
    if let Some(choice) = &choice {
        let note = choice.fidelity.settle(session, choice.tolerance.part());
        session
            .notes
            .push(format!("fidelity {}: {note}", choice.tolerance));
    }
    Ok(())
}

/// Gives `"auto"` models and `[fidelity]` the meaning that they had in this trial.
/// Whether it says all of it.
pub fn recall(session: &mut Session, trial: &Trial) -> bool {
    let mut is_known = !session.has_fidelity || trial.fidelity.is_some();
    for channel in &mut session.channels {
        let Some(muscle) = &mut channel.muscle else {
            continue;
        };
        let mut all = trial.channels.iter();
        let of = all.find(|channel_info| channel_info.number == channel.number);
        let name = of.and_then(|channel_info| channel_info.model.as_deref());
        let rung = Rung::ALL
            .into_iter()
            .find(|level| Some(rung_name(*level)) == name);
        muscle.auto = rung.unwrap_or(muscle.auto);
        is_known &= rung.is_some();
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
    }
    is_known
}

impl Choice {
    /// Of each channel whose model the file gives and which errs by more than is
    /// tolerated, that it does.
    fn coarse(&self, session: &Session) -> Vec<String> {
        let coarse = |need: &&Need| need.together > self.tolerance.part();
        let told = self.needs.iter().filter(coarse).map(|need| {
            format!(
                "channel {}: `{}`, as the file says, errs by {:.2} %: more than the tolerance of {}",
                session.channels[need.place].number,
                rung_name(need.rung),
                100.0 * need.together,
                self.tolerance,
            )
        });
        told.collect()
    }

    /// # Errors
    /// [`ChoiceError::NoRung`] of the first channel that no rung is enough for.
    pub fn refuse(&self, session: &Session) -> Result<(), ChoiceError> {
        let Some(need) = self.needs.iter().find(|need| need.enough.is_none()) else {
            return Ok(());
        };
        let (least, best) = need.least();
        Err(ChoiceError::NoRung {
            channel: session.channels[need.place].number,
            tolerance: self.tolerance,
            least_percent: (least * 1e4).ceil() * 1e-2,
            best: rung_name(best),
        })
    }
}
