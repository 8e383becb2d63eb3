//! Finds channels that a session configures but that never receive an amplitude.

use firmware::control::JointSpec;
use firmware::haptics::{ModulationSpec, WallSpec};
use firmware::safety::Stimulus;
use firmware::units::Amplitude;

use super::{BodySpec, Channel, Course, Session};

/// Adds a note for each channel that is configured but never receives an amplitude above 0, unless
/// the file means it to stay at 0.
pub(super) fn note_silent_channels(session: &mut Session) {
    let silent = session.channels.iter();
    let silent = silent.filter(|channel| {
        !is_driven(session, channel.index()) && !is_meant_silent(session, channel)
    });
    let notes: Vec<String> = silent
        .map(|channel| {
            let (number, zero) = (channel.number, channel.format_amplitude(Amplitude::ZERO));
            format!(
                "channel {number}: it is configured, but never receives an amplitude, so it stays \
                 at {zero}; name it in `[setpoints]` or in a controller, or delete it"
            )
        })
        .collect();
    session.notes.extend(notes);
}

/// Returns whether the file means a channel to stay at 0. This is so for a channel of a group whose
/// value is a constant 0, for a channel on which a live client may play lists of pulses, and for
/// the biceps or triceps of a simulated elbow, of which a session may use only one.
fn is_meant_silent(session: &Session, channel: &Channel) -> bool {
    let index = channel.index();
    let mut groups = session.groups.iter();
    let is_partner = groups.any(|group| group.members & (1 << index) != 0);
    let is_zero = constant_amplitudes(session)
        .iter()
        .any(|(own, _)| *own == index);
    let is_muscle = match &session.body {
        Some(BodySpec::Elbow(elbow)) => {
            [elbow.triceps.channel, elbow.biceps.channel].contains(&usize::from(index))
        }
        _ => false,
    };
    (is_partner && is_zero) || channel.spec.train.lists || is_muscle
}

/// Returns the constant amplitudes that the host streams, each with its channel on the link (0–9).
fn constant_amplitudes(session: &Session) -> &[(u8, Stimulus)] {
    match &session.setpoints.course {
        Course::Amplitudes(values) => values,
        _ => &session.setpoints.beside,
    }
}

/// Returns whether anything may ask for an amplitude above 0 on a channel (0–9 on the link) at any
/// time of the session. A live client within its bounds counts, too.
fn is_driven(session: &Session, channel: u8) -> bool {
    let setpoints = &session.setpoints;
    let joint = session.joint.iter().flat_map(JointSpec::points);
    let wall = session.wall.iter().flat_map(WallSpec::demands);
    let bounds = setpoints.bounds.iter();
    joint
        .map(|point_spec| point_spec.channel)
        .any(|value| value == channel)
        || wall.into_iter().any(|wall| drives(wall.0, wall.1, channel))
        || is_modulated(session, channel)
        || is_recruited(session, channel)
        || is_streamed(session, channel)
        || bounds
            .map(|bounds| bounds.channel)
            .any(|value| value == channel)
}

fn drives(own: u8, most: Amplitude, channel: u8) -> bool {
    own == channel && most > Amplitude::ZERO
}

/// Returns whether a modulated joint drives the channel (0–9 on the link) at a time when an object
/// is held.
fn is_modulated(session: &Session, channel: u8) -> bool {
    let joints = session.modulations.iter();
    let demands = joints.flat_map(|joint| ModulationSpec::demands(&joint.spec));
    let is_grabbed = match &session.setpoints.course {
        Course::Held(points) => points.iter().any(|(_, is_held)| *is_held),
        _ => false,
    };
    is_grabbed
        && demands
            .into_iter()
            .any(|demand| drives(demand.0, demand.1, channel))
}

/// Returns whether the channel's muscle (0–9 on the link) can contribute to a force at the hand
/// that the session asks for.
fn is_recruited(session: &Session, channel: u8) -> bool {
    let lines = session.limb.iter().flat_map(|limb| &limb.lines);
    let is_wanted = match &session.setpoints.course {
        Course::Wrench(course) => course.0.iter().any(|(_, force_mn)| *force_mn != [0; 3]),
        _ => false,
    };
    is_wanted && lines.into_iter().any(|line| line.channel == channel)
}

/// Returns whether the host streams an amplitude, a force or a list of pulses above 0 to the
/// channel (0–9 on the link).
fn is_streamed(session: &Session, channel: u8) -> bool {
    let setpoints = &session.setpoints;
    let most = match &setpoints.course {
        Course::Stimulus(own, course) if *own == channel => {
            let peaks = course.peaks().into_iter();
            peaks.map(|(_, stimulus)| stimulus.amplitude.get()).max()
        }
        _ => setpoints.extremes(channel).map(|(_, most)| most),
    };
    let lists = setpoints.lists.iter().map(|(_, list)| list);
    let own = lists.filter(|list| list.channel == channel);
    let listed = own.flat_map(|list| {
        list.pulses
            .iter()
            .map(|listed_pulse| listed_pulse.amplitude.get())
    });
    most.max(listed.max()) > Some(0)
}
