//! Counts the pulses that a session played, and finds the likely reason if there were none.

use crate::session::{Course, ForceCourse, Session};
use firmware::pulse::CHANNELS;
use firmware::safety::Stimulus;
use firmware::units::Amplitude;
use hal_sim::trace::{Edge, State, Trace};

/// Counts the pulses of `session` that a simulated device output from the device time `epoch_us`
/// on. A pulse counts by its first phase, if the DAC code of that phase is above 0. Pulses of the
/// electrode check come earlier and are not counted.
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

/// Returns the most likely reason why `session` output no pulse in its first `length_us`.
/// `idle_triggers` is the number of trigger edges that arrived while no train was waiting for one.
pub(super) fn silence_reason(
    session: &Session,
    length_us: u64,
    idle_triggers: u64,
) -> &'static str {
    let trains = || session.channels.iter().map(|c| c.spec.train);
    if trains().all(|train| train.trigger.is_some()) {
        return if idle_triggers > 0 {
            "trigger edges arrived while no train was waiting for them"
        } else {
            "every channel waits for a trigger, and none arrived before the end; \
             [simulated_trigger] in the session file simulates trigger edges"
        };
    }
    let first = trains().filter(|train| train.trigger.is_none());
    let first = first.map(|train| u64::from(train.offset_us)).min();
    if first.is_some_and(|offset| offset >= length_us) {
        return "the session ended before the first pulse was due (offset_us of the first channel)";
    }
    if trains().all(|train| u64::from(train.offset_us + train.period_us) >= length_us) {
        return "the session ended within the first pulse period, and amplitudes rise from 0";
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
            "all amplitudes of the session are 0"
        }
        Course::KeepAlive if !setpoints.programs.is_empty() => {
            "the session's programs contain no amplitude above 0 before its end"
        }
        Course::KeepAlive if session.wall.is_none() => {
            "the session has neither amplitudes nor a virtual wall"
        }
        Course::KeepAlive => "the joint did not touch the virtual wall",
        Course::AngleSine { .. } | Course::AngleSteps(_) => {
            "the controller requested no amplitude above 0: the joint was already at its \
             reference, or its angle was not measured"
        }
        Course::Force(_, wanted) if is_nothing(wanted) => "the reference force is 0",
        Course::Force(..) => {
            "the reference force is nearer to 0 than to the smallest force of the muscle; a lower \
             min_frequency_hz allows a smaller force"
        }
        Course::Held(points) if points.iter().all(|(_, is_held)| !is_held) => "no object was held",
        Course::Held(_) => "while an object was held, every share was 0, or no elbow had moved yet",
        Course::Wrench(_) => "the reference force at the hand needs no muscle",
        Course::Amplitudes(_) | Course::Stimulus(..) => {
            "every amplitude was below the first step of its DAC, or the ramp \
                                  had not begun"
        }
    }
}
