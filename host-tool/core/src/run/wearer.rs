//! The simulated wearer of a session, and what it wears; of one trial or of several.

use crate::session::{BodySpec, Session, Unit};
use firmware::control::SensorSource;
use firmware::pulse::{GroupSpec, Partner};
use hal_sim::body::arm::{Arm, ArmSpec, InvalidArm};
use hal_sim::body::hand::InvalidHand;
use hal_sim::body::{Body, CHANNELS, Drive, Elbow, Finger, InvalidElbow, InvalidSpec, Load, Still};
use hal_sim::lockstep::Output;
use hal_sim::random;
use hal_sim::world::World;
use std::io;

/// A wearer that cannot be. The message has the reason in full, so it is no cause
/// beside it.
#[derive(Debug, thiserror::Error)]
pub enum BodyError {
    /// A finger.
    #[error("E511 the session's body cannot be: {0}")]
    Finger(InvalidSpec),
    /// A hand.
    #[error("E566 the session's body cannot be: {0}")]
    Hand(InvalidHand),
    /// An elbow.
    #[error("E570 the session's body cannot be: {0}")]
    Elbow(InvalidElbow),
    /// An arm.
    #[error("E740 the session's body cannot be: {0}")]
    Arm(InvalidArm),
}

/// The session's wearer, rested and at their start; `seed` decides their noise.
///
/// # Errors
/// The session names one that cannot be.
pub fn body_of(session: &Session, seed: u64) -> Result<Box<dyn Body>, BodyError> {
    Ok(match &session.body {
        Some(BodySpec::Elbow(spec)) => {
            Box::new(Elbow::new((**spec).clone(), seed).map_err(BodyError::Elbow)?)
        }
        Some(BodySpec::Finger(spec)) => {
            Box::new(Finger::new((**spec).clone(), seed).map_err(BodyError::Finger)?)
        }
        Some(BodySpec::Hand(fitted)) => Box::new(fitted.moving(seed).map_err(BodyError::Hand)?),
        Some(BodySpec::Arm { spec, held }) => {
            // Which arm it is stays; what it and its sensors do by chance is the seed's.
            let seed = random::word(spec.seed, seed);
            let spec = ArmSpec {
                seed,
                ..(**spec).clone()
            };
            let mut arm = Arm::new(spec).map_err(BodyError::Arm)?;
            arm.hold(*held);
            Box::new(arm)
        }
        Some(BodySpec::Still { load_ohm }) => {
            let mut body = Still::new(0.0);
            *body.loads_mut() = [Load::Ohms((*load_ohm).into()); CHANNELS];
            Box::new(body)
        }
        None => Box::new(Still::new(0.0)),
    })
}

/// Gives the wearer of `world` the session's electrodes and angle sensor.
pub fn fit(world: &mut World, session: &Session) {
    if let Some(SensorSource::Adc {
        code_at_0,
        code_at_100,
    }) = session.sensor()
    {
        let zero = f64::from(code_at_0);
        world.connect_joint((f64::from(code_at_100) - zero) / 100.0, zero);
    }
    world.outputs = outputs(session);
}

/// What one wearer and one board need for all of these sessions: the first one, with
/// every channel that any of them has; or the field in which two of them need another
/// wearer, or another board. Nothing of no session.
///
/// # Errors
/// That field.
pub fn worn_alike(sessions: &[Session]) -> Result<Option<Session>, &'static str> {
    let Some(mut worn) = sessions.first().cloned() else {
        return Ok(None);
    };
    let mut sensor = None;
    for session in sessions {
        if session.body != worn.body {
            return Err("body");
        }
        if let Some(own) = session.sensor()
            && *sensor.get_or_insert(own) != own
        {
            return Err("sensor");
        }
        for channel in &session.channels {
            match worn
                .channels
                .iter()
                .find(|item| item.number == channel.number)
            {
                Some(known) if known.spec.stage != channel.spec.stage => {
                    return Err("channel.stage");
                }
                Some(_) => {}
                None => worn.channels.push(channel.clone()),
            }
        }
    }
    worn.channels.sort_by_key(|channel| channel.number);
    Ok(Some(worn))
}

/// In one go of a rest, µs.
const REST_STEP_US: u64 = 1_000_000;

/// Nothing is stimulated for `rest_s` of virtual time; `go_on` is asked every second
/// of it.
///
/// # Errors
/// The device cannot be reached any more.
pub fn rest(world: &mut World, rest_s: f64, go_on: &mut dyn FnMut() -> bool) -> io::Result<()> {
    let until_us = world.now_us() + (rest_s * 1e6).round() as u64; // saturates
    while world.now_us() < until_us && go_on() {
        world.rest(REST_STEP_US.min(until_us - world.now_us()))?;
    }
    Ok(())
}

/// The output stages that the session's board has.
pub(super) fn outputs(session: &Session) -> [Option<Output>; CHANNELS] {
    let mut outputs = [None; CHANNELS];
    for channel in &session.channels {
        let full_scale = f64::from(channel.spec.stage.full_scale().get()) * 1e-3;
        let is_member = |group: &&GroupSpec| group.members & 1 << channel.index() != 0;
        let group = session.groups.iter().find(is_member);
        outputs[usize::from(channel.index())] = Some(Output {
            full_scale: match channel.unit() {
                Unit::Milliampere => Drive::Milliamps(full_scale),
                Unit::Volt => Drive::Volts(full_scale),
            },
            conducted: group.is_some_and(|group| group.partner == Partner::Conducted),
        });
    }
    outputs
}
