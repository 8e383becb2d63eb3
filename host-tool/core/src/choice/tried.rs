//! Errors of the outputs in use, for a session on each model level.

use super::cost::{Cycles, cycles, measured_levels};
use super::play::{PlayError, PlayedSession, force_or_zero};
use crate::session::{Muscle, Session};
use firmware::muscle::MuscleLevel;
use rayon::prelude::*;

/// Resolution of a reported force, N. Forces are reported in whole mN, so a smaller difference
/// comes from rounding and does not count as an error of the model.
const RESOLUTION_N: f64 = 1e-3;

/// Which outputs of a channel's muscle model the session uses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ModelUses {
    /// Whether the session uses the force that the model predicts.
    pub report: bool,
    /// Whether the model determines the channel's own pulses, as under force control.
    pub steering: bool,
}

/// Errors and cost of one model level on one channel. Errors are shares of the largest true force.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LevelResult {
    /// Model level that was tried.
    pub level: MuscleLevel,
    /// Error of the reported force against the true force of the same pulses; `None` if the session
    /// does not use the report.
    pub report: Option<f64>,
    /// Error of the true force compared with the true force under the most detailed level; `None`
    /// if the model does not determine the channel's pulses.
    pub steering: Option<f64>,
    /// Cycles of the level; `None` if they were not measured.
    pub cycles: Option<Cycles>,
    /// Rate of the pulses that the model has to compute, pulses per second.
    pub pulses_per_s: f64,
}

impl LevelResult {
    /// Returns the larger of the errors of the outputs in use; 0 if the session uses neither.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.report.unwrap_or(0.0).max(self.steering.unwrap_or(0.0))
    }

    /// Combines the results of this level in two sessions: keeps the larger of each error and of
    /// the pulse rates.
    fn max_with(self, other: &Self) -> Self {
        let larger = |a: Option<f64>, b: Option<f64>| a.map(|a| a.max(b.unwrap_or(0.0))).or(b);
        Self {
            report: larger(self.report, other.report),
            steering: larger(self.steering, other.steering),
            pulses_per_s: self.pulses_per_s.max(other.pulses_per_s),
            ..self
        }
    }

    /// Returns the processor cycles per second that the level needs; infinity if they were not
    /// measured.
    #[must_use]
    pub fn cost(&self) -> f64 {
        let cost = self
            .cycles
            .map(|cycles| cycles.per_second(self.pulses_per_s));
        cost.unwrap_or(f64::INFINITY)
    }
}

/// Every session that is tried for one choice, with its results.
pub(super) struct Trials<'a>(Vec<Trial<'a>>);

impl<'a> Trials<'a> {
    /// Plays each of `sessions` once for each model level that can make a difference to it.
    pub(super) fn play(sessions: &'a [Session], seed: u64) -> Result<Self, PlayError> {
        let trials = sessions
            .par_iter()
            .map(|session| Trial::play(session, seed));
        Ok(Self(trials.collect::<Result<_, _>>()?))
    }

    /// Returns the results of a channel's model levels, with the largest errors over all sessions.
    /// `place` is the index of the channel.
    pub(super) fn level_results(&self, place: usize) -> Vec<LevelResult> {
        let results = self.0.iter().map(|trial| trial.tried[place].clone());
        let worse = |a: Vec<LevelResult>, b: Vec<LevelResult>| {
            let pairs = a.into_iter().zip(b);
            pairs.map(|(a, b)| a.max_with(&b)).collect()
        };
        results.reduce(worse).unwrap_or_default()
    }

    /// Returns how many times a session has been played so far.
    pub(super) fn play_count(&self) -> usize {
        self.0.iter().map(|trial| trial.plays).sum()
    }

    /// Returns which outputs of the channel with index `place` are used; they are the same in every
    /// session.
    pub(super) fn used_outputs(&self, place: usize) -> ModelUses {
        let first = self.0.first().map(|trial| trial.used_outputs(place));
        first.unwrap_or(ModelUses {
            report: false,
            steering: false,
        })
    }

    /// Returns the largest error of each channel over all sessions when the channels run together.
    /// `levels` has the index and the model level of each channel.
    pub(super) fn combined_errors(
        &mut self,
        levels: &[(usize, MuscleLevel)],
    ) -> Result<Vec<f64>, PlayError> {
        let results = self
            .0
            .par_iter_mut()
            .map(|trial| trial.combined_errors(levels));
        let errors: Vec<Vec<f64>> = results.collect::<Result<_, _>>()?;
        let worst = |n: usize| errors.iter().map(|values| values[n]).fold(0.0, f64::max);
        Ok((0..levels.len()).map(worst).collect())
    }
}

/// One session that is tried, with the results of playing it.
struct Trial<'a> {
    session: &'a Session,
    seed: u64,
    /// Played sessions by model level. All muscles had this level, except for muscles that allow
    /// only less detailed levels: these had the most detailed level that they allow.
    played: Vec<(MuscleLevel, PlayedSession)>,
    plays: usize,
    /// Results of the model levels, by channel; empty for a channel without a muscle.
    tried: Vec<Vec<LevelResult>>,
    /// True force at each millisecond under the most detailed levels, by channel, N; empty for
    /// channels whose pulses the model does not determine.
    steered: Vec<Vec<f64>>,
}

impl<'a> Trial<'a> {
    /// Plays `session` once for each model level that can make a difference to it.
    fn play(session: &'a Session, seed: u64) -> Result<Self, PlayError> {
        let muscles = || session.channels.iter().filter_map(|c| c.muscle.as_ref());
        let fullest = muscles().map(most_detailed_level).max();
        let steers = session.channels.iter().any(|c| c.force.is_some());
        let matters = |level: &MuscleLevel| {
            // A model that does not run reports nothing, which needs no trial.
            Some(*level) <= fullest
                && (steers || cycles(*level).is_none_or(|cycles| cycles.tick > 0))
        };
        let levels: Vec<MuscleLevel> = measured_levels().filter(matters).collect();
        let played = levels.into_par_iter().map(|level| {
            let mut variant =
                session_at_levels(session, |_, muscle| level.min(most_detailed_level(muscle)));
            // Later changes in the file are not an effect of this model level.
            let muscles = variant
                .channels
                .iter_mut()
                .filter_map(|c| c.muscle.as_mut());
            muscles.for_each(|muscle| muscle.changes.clear());
            Ok((level, PlayedSession::play(&variant, seed)?))
        });
        let played: Vec<(MuscleLevel, PlayedSession)> = played.collect::<Result<_, PlayError>>()?;
        let mut trials = Self {
            session,
            seed,
            plays: played.len(),
            played,
            tried: Vec::new(),
            steered: Vec::new(),
        };
        let places: Vec<usize> = (0..session.channels.len()).collect();
        let judged = places.into_par_iter().map(|place| trials.try_levels(place));
        (trials.tried, trials.steered) = judged.collect::<Vec<_>>().into_iter().unzip();
        Ok(trials)
    }

    fn used_outputs(&self, place: usize) -> ModelUses {
        let channel = &self.session.channels[place];
        ModelUses {
            report: channel.muscle.as_ref().is_some_and(|muscle| muscle.report),
            steering: channel.force.is_some(),
        }
    }

    /// Returns the results of each model level on the channel with index `place`. Also returns its
    /// true force at each millisecond under the most detailed level.
    fn try_levels(&self, place: usize) -> (Vec<LevelResult>, Vec<f64>) {
        let Some(muscle) = &self.session.channels[place].muscle else {
            return Default::default();
        };
        let (uses, top) = (self.used_outputs(place), most_detailed_level(muscle));
        let on = |level: MuscleLevel| {
            self.played
                .iter()
                .find(|pair| pair.0 == level)
                .map(|pair| &pair.1)
        };
        let Some(best) = on(top) else {
            return Default::default(); // every muscle's fullest was played
        };
        let steered = match uses.steering {
            true => best.true_force(muscle, place, &millisecond_times(best)),
            false => Vec::new(),
        };
        let tried = measured_levels()
            .filter(|level| *level <= top)
            .map(|level| {
                let played = on(level);
                let (report, steering) = match played {
                    Some(played) => self.errors(place, muscle, played, &steered),
                    // The model never ran: where there is any force, its report of none is completely
                    // wrong.
                    None => {
                        let is_still = best.pulses[place].is_empty();
                        (Some(f64::from(u8::from(!is_still))), None)
                    }
                };
                LevelResult {
                    level,
                    report: report.filter(|_| uses.report),
                    steering: steering.filter(|_| uses.steering),
                    cycles: cycles(level),
                    pulses_per_s: played.unwrap_or(best).pulses[place].len() as f64
                        / (best.length_us as f64 * 1e-6),
                }
            });
        (tried.collect(), steered)
    }

    /// Returns the error of a channel's reported force, and the error that its model causes in the
    /// true force by determining the pulses. `steered` is the true force under the most detailed
    /// level.
    fn errors(
        &self,
        place: usize,
        muscle: &Muscle,
        played: &PlayedSession,
        steered: &[f64],
    ) -> (Option<f64>, Option<f64>) {
        let before = &self.session.channels[..place];
        let column = before.iter().filter(|c| c.muscle.is_some()).count();
        let times: Vec<u64> = played.reports.iter().map(|report| report.0).collect();
        let truth = played.true_force(muscle, place, &times);
        let reports = played.reports.iter();
        let reported_forces = reports.map(|(_, forces)| force_or_zero(forces, column));
        let report = worst_error(&truth, reported_forces, RESOLUTION_N);
        let steering = (!steered.is_empty()).then(|| {
            let true_force = played.true_force(muscle, place, &millisecond_times(played));
            worst_error(steered, true_force.into_iter(), 0.0)
        });
        (Some(report), steering)
    }

    /// Returns the error of each channel when the channels run together. `levels` has the index and
    /// the model level of each channel.
    fn combined_errors(&mut self, levels: &[(usize, MuscleLevel)]) -> Result<Vec<f64>, PlayError> {
        let chosen_level = |place: usize, muscle: &Muscle| {
            let found = levels.iter().find(|pair| pair.0 == place);
            found.map_or(muscle.initial_level(), |pair| pair.1)
        };
        let variant = session_at_levels(self.session, chosen_level);
        let same = self.played.iter().find(|(level, _)| {
            levels.iter().all(|(place, own)| {
                let muscle = self.session.channels[*place].muscle.as_ref();
                muscle.is_some_and(|muscle| {
                    *own == most_detailed_level(muscle).min(*level) && muscle.changes.is_empty()
                })
            })
        });
        let anew;
        let played = match same {
            Some((_, played)) => played,
            None => {
                self.plays += 1;
                anew = PlayedSession::play(&variant, self.seed)?;
                &anew
            }
        };
        let errors = levels.par_iter().map(|&(place, _)| {
            let Some(muscle) = &self.session.channels[place].muscle else {
                return 0.0;
            };
            let uses = self.used_outputs(place);
            let (report, steering) = self.errors(place, muscle, played, &self.steered[place]);
            let report = report.filter(|_| uses.report).unwrap_or(0.0);
            report.max(steering.filter(|_| uses.steering).unwrap_or(0.0))
        });
        Ok(errors.collect())
    }
}

/// Returns the most detailed model level that a muscle allows.
fn most_detailed_level(muscle: &Muscle) -> MuscleLevel {
    match muscle.fatigue {
        Some(_) => MuscleLevel::CalciumForceFatigue,
        None => MuscleLevel::CalciumForce,
    }
}

/// Returns the part of `session` that is tried, with each muscle at the model level that `chosen_level`
/// returns for its channel's index.
fn session_at_levels(
    session: &Session,
    chosen_level: impl Fn(usize, &Muscle) -> MuscleLevel,
) -> Session {
    let mut variant = session.clone();
    variant.duration_us = session.duration_us.min(session.try_us);
    for (place, channel) in variant.channels.iter_mut().enumerate() {
        if let Some(muscle) = &mut channel.muscle {
            let level = chosen_level(place, muscle);
            muscle.model = crate::session::Model::Fixed(level);
        }
    }
    variant
}

/// Returns the times of all whole milliseconds of the played session, µs.
fn millisecond_times(played: &PlayedSession) -> Vec<u64> {
    (0..=played.length_us / 1000).map(|ms| ms * 1000).collect()
}

/// Returns the largest absolute difference at any time, reduced by `resolution`, as a share of the
/// largest true force. If the true force is always 0, returns 1 for any difference and 0 for none.
fn worst_error(truth: &[f64], other: impl Iterator<Item = f64>, resolution: f64) -> f64 {
    let peak = truth.iter().copied().fold(0.0, f64::max);
    let off = truth
        .iter()
        .zip(other)
        .map(|(truth, other)| (truth - other).abs() - resolution);
    let off = off.fold(0.0, f64::max);
    if peak > 0.0 {
        off / peak
    } else {
        f64::from(u8::from(off > 0.0))
    }
}
