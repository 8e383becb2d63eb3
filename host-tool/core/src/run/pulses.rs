//! Counts the pulses that a session played, and finds the likely reason if there were none.

use crate::session::{Course, ForceCourse, Session};
use firmware::pulse::CHANNELS;
use firmware::safety::Stimulus;
use firmware::units::Amplitude;
use hal_sim::trace::{Edge, State, Trace};

/// Counts the pulses of `session` in a simulated device's trace from `epoch_us` on: first phases
/// with a DAC code above 0. Pulses of the electrode check come earlier and are not counted.
pub(super) fn count_pulses(session: &Session, trace: &Trace, epoch_us: u64) -> u64 {
    let first: [Option<State>; CHANNELS] = std::array::from_fn(|channel| {
        let shape = session.channel(channel as u8)?.spec.train.shape;
        Some(match shape.cathodic_first() {
            true => State::Cathodic,
            false => State::Anodic,
        })
    });
    let edges = trace.edges_from(epoch_us);
    let first = |edge: &Edge| first[usize::from(edge.channel)] == Some(edge.state);
    edges
        .filter(|edge| edge.dac_code > 0 && first(edge))
        .count() as u64
}

/// Returns the likely reason why `session` played no pulse in `length_us`. `idle_triggers` is the
/// number of trigger edges that arrived when no train was ready.
pub(super) fn silence_reason(
    session: &Session,
    length_us: u64,
    idle_triggers: u64,
) -> &'static str {
    let trains = || session.channels.iter().map(|c| c.spec.train);
    if trains().all(|train| train.trigger.is_some()) {
        return if idle_triggers > 0 {
            "edges came to the trigger input when no train was ready for them"
        } else {
            "every channel waits for a trigger, and none came before the end; \
             [simulated_trigger] in the session file gives a simulator edges"
        };
    }
    let first = trains().filter(|train| train.trigger.is_none());
    let first = first.map(|train| u64::from(train.offset_us)).min();
    if first.is_some_and(|offset| offset >= length_us) {
        return "it ended before the first channel's offset_us";
    }
    if trains().all(|train| u64::from(train.offset_us + train.period_us) >= length_us) {
        return "it ended with the first pulses, and amplitudes rise from 0";
    }
    let setpoints = &session.setpoints;
    let is_nothing = |wanted: &ForceCourse| match wanted {
        ForceCourse::Ramp(points) => points.iter().all(|&(_, millinewton)| millinewton == 0),
        ForceCourse::Sine {
            offset_n,
            amplitude_n,
            ..
        } => *offset_n == 0.0 && *amplitude_n == 0.0,
    };
    let is_zero = |values: &[(u8, Stimulus)]| {
        let amplitudes = values.iter().map(|(_, stimulus)| stimulus.amplitude);
        amplitudes
            .into_iter()
            .all(|amplitude| amplitude == Amplitude::ZERO)
    };
    match &setpoints.course {
        Course::Amplitudes(values) if is_zero(values) && is_zero(&setpoints.beside) => {
            "all amplitudes that it asks for are 0"
        }
        Course::KeepAlive if !setpoints.programs.is_empty() => {
            "its programs ask for no amplitude above 0 before its end"
        }
        Course::KeepAlive if session.wall.is_none() => {
            "nothing asks for an amplitude: the session has neither amplitudes nor a wall"
        }
        Course::KeepAlive => "nothing asked for an amplitude: the wall was not touched",
        Course::AngleSine { .. } | Course::AngleSteps(_) => {
            "the control law asked for no amplitude above 0: the joint was where it should be, or \
             nothing measured it"
        }
        Course::Force(_, wanted) if is_nothing(wanted) => "the wanted force is 0",
        Course::Force(..) => {
            "the wanted force is nearer to none than to the least that the muscle gives; a lower \
             min_frequency_hz lets it give less"
        }
        Course::Held(points) if points.iter().all(|(_, is_held)| !is_held) => "no object was held",
        Course::Held(_) => {
            "no share was above 0 while an object was held, or no elbow had moved yet"
        }
        Course::Wrench(_) => "no force at the hand was wanted that recruits a muscle",
        Course::Amplitudes(_) | Course::Stimulus(..) => {
            "every amplitude was below the first step of its DAC, or the ramp \
                                  had not begun"
        }
    }
}
