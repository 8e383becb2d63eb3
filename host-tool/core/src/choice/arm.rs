//! How coarse the time step of a simulated arm may be: found by playing the session with each step.

use super::deviation::largest_deviations;
use super::effect::Effect;
use super::play::PlayError;
use crate::session::{BodySpec, Session, Unit};
use hal_sim::body::Drive;
use hal_sim::body::arm::{Muscle, reached_muscles};

/// Time steps of a simulated arm that are tried, ms; the first is the finest.
pub const ARM_STEPS_MS: [u32; 5] = [1, 2, 5, 10, 20];

/// Plays `session` with each time step and each of these seeds of the wearer's noise. Returns the
/// largest error of each step over all seeds, the finest step first. An error is the root mean
/// square difference from the play with the finest step, sampled every millisecond: of the true
/// force at the hand, as a share of the largest true force, if the session uses that force and a
/// cuff holds the arm; else of the elbow angle, as a share of its range. The list is empty without
/// a simulated arm.
///
/// # Errors
/// Returns [`PlayError`] if the session cannot be played.
pub fn try_arm_steps(session: &Session, seeds: &[u64]) -> Result<Vec<Effect>, PlayError> {
    if !matches!(session.body, Some(BodySpec::Arm { .. })) {
        return Ok(Vec::new());
    }
    // The arm stands still within a step: rows every few steps would all see the same part of it.
    let mut dense = session.clone();
    dense.telemetry_ms = 1;
    let levels = ARM_STEPS_MS.map(|step_ms| with_arm_step(&dense, step_ms));
    let errors = largest_deviations(&levels, seeds)?;
    let pairs = ARM_STEPS_MS.into_iter().zip(errors);
    Ok(pairs
        .map(|(setting, error)| Effect { setting, error })
        .collect())
}

/// Returns `session` with a simulated arm that moves in steps of `step_ms` milliseconds.
#[must_use]
pub fn with_arm_step(session: &Session, step_ms: u32) -> Session {
    let mut session = session.clone();
    if let Some(BodySpec::Arm { step_ms: own, .. }) = &mut session.body {
        *own = step_ms;
    }
    session
}

/// Returns the muscles of a simulated arm that a channel of `session` can reach at its limit; `None`
/// without a simulated arm. The others never receive a pulse, and the simulation skips them.
#[must_use]
pub fn arm_muscles(session: &Session) -> Option<Vec<Muscle>> {
    let Some(BodySpec::Arm { spec, .. }) = &session.body else {
        return None;
    };
    let mut muscles: Vec<Muscle> = Vec::new();
    for channel in &session.channels {
        let most = f64::from(channel.spec.limit.get()) * 1e-3;
        let drive = match channel.unit() {
            Unit::Milliampere => Drive::Milliamps(most),
            Unit::Volt => Drive::Volts(most),
        };
        let train = &channel.spec.train;
        let width_us = train.width_us.max(train.max_width_us);
        let reached = reached_muscles(spec, channel.index().into(), drive, width_us.into());
        muscles.extend(reached);
    }
    muscles.sort_by_key(|muscle| *muscle as usize);
    muscles.dedup();
    Some(muscles)
}
