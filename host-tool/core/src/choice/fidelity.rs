//! The settings that `[fidelity]` makes coarser besides the models: the period of the control law,
//! the period of telemetry, and the level of detail of a simulated finger, hand or arm. Each is
//! found by playing the session with it.

use super::arm::try_arm_steps;
use super::effect::{Effect, coarsest};
use super::hand::try_units;
use super::play::{PlayError, play_trial};
use crate::analysis::limit_cycles;
use crate::record::{Sample, Samples};
use crate::session::{BodySpec, Session};
use firmware::control::{Joint, JointSpec};
use rayon::prelude::*;

/// Periods of the control law that are tried, ms; the first is the finest.
const LAW_PERIODS_MS: [u8; 5] = [1, 2, 5, 11, 20];
/// Periods of telemetry that are tried, ms; the first is the finest.
const TELEMETRY_MS: [u16; 7] = [1, 2, 5, 10, 20, 50, 100];
/// Simulation steps of the finger that are tried, µs; the first is the finest.
const STEPS_US: [u32; 4] = [1_000, 2_000, 5_000, 10_000];

/// Errors of the settings besides the models, finest setting first. A list is empty if the session
/// does not use the setting, or fixes it in its file.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Fidelity {
    /// Errors of the telemetry periods. The error is the largest difference between the values that
    /// the device reports every millisecond and straight lines through the values at this period.
    /// Forces, the measured angle and the true angle of an arm are compared. Empty if none of them
    /// varies.
    pub telemetry: Vec<Effect>,
    /// Errors of the periods of the control law: increase of the root mean square tracking error.
    pub law: Vec<Effect>,
    /// Errors of the finger's simulation steps: absolute change of the root mean square tracking
    /// error.
    pub step: Vec<Effect>,
    /// Errors of the numbers of motor units of a simulated hand, largest number first.
    pub hand: Vec<Effect>,
    /// Errors of the time steps of a simulated arm, the finest first.
    pub arm: Vec<Effect>,
}

/// Tries all settings on the first `length_us` of `session`.
///
/// # Errors
/// Returns [`PlayError`] if the session cannot be played.
pub(super) fn try_settings(
    session: &Session,
    length_us: u64,
    seed: u64,
) -> Result<Fidelity, PlayError> {
    let mut finest = session.clone();
    finest.duration_us = length_us;
    let mut dense = finest.clone();
    dense.telemetry_ms = TELEMETRY_MS[0];
    let mut fidelity = Fidelity {
        telemetry: telemetry_effects(&dense, &play_trial(&dense, seed)?.samples),
        ..Fidelity::default()
    };
    let off = |sessions: Vec<(u32, Session)>| {
        let errors = sessions.par_iter().map(|(us, session)| {
            let trial = play_trial(session, seed)?;
            // A loop that oscillates by itself is not a coarser loop but an unusable one.
            let swings = limit_cycles(&trial).next().is_some();
            let error = if swings {
                f64::INFINITY
            } else {
                tracking_error(&trial.samples)
            };
            Ok((*us, error))
        });
        errors.collect::<Result<Vec<_>, PlayError>>()
    };
    if let Some(joint) = session.joint.as_ref().filter(|_| session.law_is_free) {
        let law_sessions = LAW_PERIODS_MS.into_iter().filter_map(|ms| {
            let law_period_ms = ms;
            let joint = JointSpec {
                law_period_ms,
                ..joint.clone()
            };
            Joint::new(&joint).ok()?;
            let joint = Some(joint);
            Some((
                u32::from(ms) * 1_000,
                Session {
                    joint,
                    ..finest.clone()
                },
            ))
        });
        fidelity.law = relative_effects(&off(law_sessions.collect())?, |value, finest| {
            value - finest
        });
    }
    if let (Some(BodySpec::Finger(finger)), true) = (&session.body, session.joint.is_some()) {
        let step_sessions = STEPS_US.into_iter().map(|step_us| {
            let mut finger = finger.clone();
            finger.step_us = step_us;
            let body = Some(BodySpec::Finger(finger));
            (
                step_us,
                Session {
                    body,
                    ..finest.clone()
                },
            )
        });
        fidelity.step = relative_effects(&off(step_sessions.collect())?, |value, finest| {
            (value - finest).abs()
        });
    }
    let seeds = [seed, seed.wrapping_add(1)];
    fidelity.hand = try_units(&finest, &seeds)?;
    fidelity.arm = try_arm_steps(&finest, &seeds)?;
    Ok(fidelity)
}

/// Converts the errors of the settings into effects relative to the first, which is the finest
/// setting. `off` computes the effect from a setting's error and the finest setting's error.
fn relative_effects(tried: &[(u32, f64)], off: impl Fn(f64, f64) -> f64) -> Vec<Effect> {
    let finest = tried.first().map_or(0.0, |pair| pair.1);
    let effect = |&(setting, error): &(u32, f64)| Effect {
        setting,
        error: off(error, finest).max(0.0),
    };
    tried.iter().map(effect).collect()
}

/// Returns the root mean square of wanted minus true angle, as a share of the wanted angle's range.
/// The first fifth of the session is left out, because the joint is still leaving its initial
/// position.
fn tracking_error(samples: &Samples) -> f64 {
    let settled = samples.iter().skip(samples.len() / 5);
    let pairs = settled.filter_map(|sample| Some((sample.target_deg?, sample.true_deg?)));
    let (mut sum, mut count, mut low, mut high) = (0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY);
    for (wanted, angle) in pairs {
        sum += (wanted - angle) * (wanted - angle);
        count += 1.0;
        (low, high) = (wanted.min(low), wanted.max(high));
    }
    match high > low {
        true => f64::sqrt(sum / count) / (high - low),
        false => 0.0,
    }
}

/// Returns the effect of each telemetry period, from samples that were reported every millisecond.
fn telemetry_effects(session: &Session, dense: &Samples) -> Vec<Effect> {
    let muscles = dense.first().map_or(0, |sample| sample.forces_n.len());
    let force = |n: usize| -> Vec<f64> {
        dense
            .iter()
            .map(|sample| reported_force(&sample, n))
            .collect()
    };
    let angle: Vec<f64> = dense
        .iter()
        .filter_map(|sample| sample.measured_deg)
        .collect();
    // Each course reads all samples, so only those that the session can have.
    let axes = if session.limb.is_some() { 3 } else { 0 };
    let hand = (0..axes).flat_map(|axis| {
        let along = |forces: &[Option<f64>]| forces.get(axis).copied().flatten();
        let reported = dense.iter().filter_map(|s| along(&s.hand_n)).collect();
        let exact = dense.iter().filter_map(|s| along(&s.hand_true_n)).collect();
        [reported, exact]
    });
    let is_arm = matches!(session.body, Some(BodySpec::Arm { .. }));
    let elbow = is_arm.then(|| dense.iter().filter_map(|s| s.true_deg).collect());
    let courses = (0..muscles).map(force);
    let courses = courses.chain(hand).chain([angle]).chain(elbow);
    let courses: Vec<(Vec<f64>, f64)> = courses
        .map(|course| {
            let low = course.iter().copied().fold(f64::INFINITY, f64::min);
            let high = course.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            (course, high - low)
        })
        .filter(|(_, span)| *span > 0.0)
        .collect();
    if courses.is_empty() {
        return Vec::new();
    }
    let effect = |ms: u16| Effect {
        setting: u32::from(ms) * 1_000,
        error: (courses.iter())
            .map(|(course, span)| interpolation_error(course, ms.into()) / span)
            .fold(0.0, f64::max),
    };
    TELEMETRY_MS.map(effect).to_vec()
}

/// Returns the reported force of a muscle, N; 0 if none was reported.
fn reported_force(sample: &Sample, muscle: usize) -> f64 {
    super::play::force_or_zero(&sample.forces_n, muscle)
}

/// Returns the largest difference between `course` and straight lines that connect every `apart`th
/// of its points.
fn interpolation_error(course: &[f64], apart: usize) -> f64 {
    let pieces = (0..course.len().saturating_sub(apart)).step_by(apart);
    let missed = pieces.flat_map(|from| {
        let (a, b) = (course[from], course[from + apart]);
        let line = move |n: usize| a + (b - a) * n as f64 / apart as f64;
        (1..apart).map(move |n| (course[from + n] - line(n)).abs())
    });
    missed.fold(0.0, f64::max)
}

impl Fidelity {
    /// Sets the coarsest periods and step within `tolerance` in `session`. Returns a note for the
    /// user that lists them.
    pub(super) fn coarsen_session(&self, session: &mut Session, tolerance: f64) -> String {
        let mut notes = Vec::new();
        if let Some(effect) = coarsest(&self.telemetry, tolerance) {
            session.telemetry_ms = (effect.setting / 1_000) as u16; // at most 100
            notes.push(format!("telemetry every {} ms", effect.setting / 1_000));
        }
        if let (Some(BodySpec::Finger(finger)), Some(effect)) =
            (&mut session.body, coarsest(&self.step, tolerance))
        {
            finger.step_us = effect.setting;
            notes.push(format!(
                "finger simulated in steps of {} ms",
                effect.setting / 1_000
            ));
        }
        if let (Some(BodySpec::Hand(hand)), Some(effect)) =
            (&mut session.body, coarsest(&self.hand, tolerance))
        {
            let units = effect.setting as usize; // at most 256
            hand.simulated_units = (units < hand.spec.units).then_some(units);
            notes.push(format!(
                "hand simulated with {units} of {} motor units per pool",
                hand.spec.units
            ));
        }
        if let (Some(BodySpec::Arm { step_ms, .. }), Some(effect)) =
            (&mut session.body, coarsest(&self.arm, tolerance))
        {
            *step_ms = effect.setting;
            notes.push(format!("arm simulated in steps of {step_ms} ms"));
        }
        if let (Some(joint), Some(effect)) = (&mut session.joint, coarsest(&self.law, tolerance)) {
            joint.law_period_ms = (effect.setting / 1_000) as u8; // at most 20
            notes.push(format!("controller every {} ms", effect.setting / 1_000));
        }
        notes.join(", ")
    }
}
