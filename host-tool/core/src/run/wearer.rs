//! Builds the simulated wearer of a session and its sensors, for one trial or several.

use crate::session::{BodySpec, Session, Unit};
use firmware::control::SensorSource;
use firmware::pulse::{GroupSpec, Partner};
use hal_sim::body::arm::{Arm, ArmSpec, InvalidArm};
use hal_sim::body::hand::InvalidHand;
use hal_sim::body::{
    Body, CHANNELS, Drive, Elbow, Finger, FixedLoad, InvalidElbow, InvalidSpec, Load,
};
use hal_sim::lockstep::Output;
use hal_sim::random;
use hal_sim::world::World;
use std::io;

/// Reason why a session's simulated wearer is impossible. The message contains the reason in full,
/// so that it is not reported again as the source of the error.
#[derive(Debug, thiserror::Error)]
pub enum BodyError {
    /// The parameters of the simulated finger are not possible (E511).
    #[error("E511 the finger of the session's [body] is impossible: {0}; correct [body]")]
    Finger(InvalidSpec),
    /// The parameters of the simulated hand are not possible (E566).
    #[error("E566 the hand of the session's [body] is impossible: {0}; correct [body]")]
    Hand(InvalidHand),
    /// The parameters of the simulated elbow are not possible (E570).
    #[error("E570 the elbow of the session's [body] is impossible: {0}; correct [body]")]
    Elbow(InvalidElbow),
    /// The parameters of the simulated arm are not possible (E740).
    #[error("E740 the arm of the session's [body] is impossible: {0}; correct [body]")]
    Arm(InvalidArm),
}

/// Creates the session's simulated wearer, not fatigued and in the initial position. `seed`
/// determines the noise.
///
/// # Errors
/// The session describes a wearer that cannot exist.
pub fn create_body(session: &Session, seed: u64) -> Result<Box<dyn Body>, BodyError> {
    Ok(match &session.body {
        Some(BodySpec::Elbow(spec)) => {
            Box::new(Elbow::new((**spec).clone(), seed).map_err(BodyError::Elbow)?)
        }
        Some(BodySpec::Finger(spec)) => {
            Box::new(Finger::new((**spec).clone(), seed).map_err(BodyError::Finger)?)
        }
        // Nothing in a session depends on the other digits.
        Some(BodySpec::Hand(fitted)) => {
            Box::new(fitted.to_index_finger(seed).map_err(BodyError::Hand)?)
        }
        Some(BodySpec::Arm {
            spec,
            held,
            step_ms,
        }) => {
            // The session fixes which arm is simulated; `seed` determines the random part of its
            // motion and of its sensors.
            let seed = random::word(spec.seed, seed);
            let spec = ArmSpec {
                seed,
                ..(**spec).clone()
            };
            let mut arm = Arm::in_steps_of(spec, *step_ms).map_err(BodyError::Arm)?;
            arm.set_support(*held);
            Box::new(arm)
        }
        Some(BodySpec::Still { load_ohm }) => {
            let mut body = FixedLoad::new(0.0);
            *body.loads_mut() = [Load::Ohms((*load_ohm).into()); CHANNELS];
            Box::new(body)
        }
        None => Box::new(FixedLoad::new(0.0)),
    })
}

/// Connects the wearer of `world` to the session's output stages, and to its angle sensor if the
/// device reads one.
pub fn attach_electrodes(world: &mut World, session: &Session) {
    if let Some(SensorSource::Adc {
        code_at_0,
        code_at_100,
    }) = session.sensor()
    {
        let zero = f64::from(code_at_0);
        world.connect_joint((f64::from(code_at_100) - zero) / 100.0, zero);
    }
    world.outputs = output_stages(session);
}

/// Returns a session that describes the wearer and the board for all of these sessions, so that
/// they can run one after the other on the same device. It is the first session with all channels
/// that occur in any session. Returns `None` for an empty list.
///
/// # Errors
/// The name of the field in which two sessions need different wearers or boards.
pub fn merge_sessions(sessions: &[Session]) -> Result<Option<Session>, &'static str> {
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

/// Longest simulated time of a rest between two calls of `go_on`, µs.
const REST_STEP_US: u64 = 1_000_000;

/// Lets the wearer rest: `rest_s` seconds of virtual time pass without stimulation. Calls `go_on`
/// before every second of that time; if it returns false, the rest ends early.
///
/// # Errors
/// The device can no longer be reached.
pub fn rest_wearer(
    world: &mut World,
    rest_s: f64,
    go_on: &mut dyn FnMut() -> bool,
) -> io::Result<()> {
    let until_us = world.now_us() + (rest_s * 1e6).round() as u64; // saturates
    while world.now_us() < until_us && go_on() {
        world.run_silently(REST_STEP_US.min(until_us - world.now_us()))?;
    }
    Ok(())
}

/// Returns the output stage of each of the board's channels; `None` for a channel that the session
/// does not use.
pub(super) fn output_stages(session: &Session) -> [Option<Output>; CHANNELS] {
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
