//! Judges whether the output at the electrodes was severe.
//!
//! Contains the true properties of hardware and wearer ([`Truth`]), the analogue part of a stage
//! (`stage` its logic, `circuit` its capacitor and load, `electrode` both together), and the rules
//! ([`Rule`]). The judge does not know the session ([`super::check()`] compares with that) and uses
//! nothing of `firmware`: like a wearer, it sees pins, DAC codes and the pump.
//! In: a trace, the pump, a truth. Out: a [`Verdict`] for stages as built (docs/reference/hardware.md) and
//! for bare stages, without protection. Time advances from event to event; the exponentials between
//! events are exact.
//! The exact rules are in docs/evidence/faults.md; tests/tests/judge verifies them and compares with a
//! second judge.

mod account;
mod circuit;
mod direct;
mod electrode;
mod pulse;
mod stage;
mod truth;

pub use account::{Finding, Latched, OutputJudgement, Rule, Truncated};
pub use stage::Cause;
pub use truth::{
    Channel, Fault, Hardware, Line, Pump, QuietInterval, Stage, StageLogic, StuckLine, Truth,
};

use super::levels::{CHANNELS, Levels, State};
use super::record::Trace;
use electrode::Electrode;
use serde::Serialize;

/// Result of judging one recording.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Result for stages with everything that docs/reference/hardware.md requires.
    pub as_built: OutputJudgement,
    /// Result for stages that only follow two lines: no one-shot, no interlock, no series
    /// capacitor, no pump, no comparator. The hardware prevented a violation that is found only
    /// here.
    pub bare: OutputJudgement,
}

/// Bank of each channel's stage (docs/reference/hardware.md, The banks' comparators).
const BANKS: [u8; CHANNELS] = [0, 0, 1, 1, 2, 3, 3, 4, 4, 5];

/// Judges the output from 0 to `end_us` (unwrapped microseconds). A trace or loads out of order are
/// first sorted by time.
#[must_use]
pub fn judge(trace: &Trace, pump: &Pump, truth: &Truth, end_us: u64) -> Verdict {
    let events = events(trace, pump, truth, end_us);
    Verdict {
        as_built: play(&events, truth, Some(&truth.hardware), end_us),
        bare: play(&events, truth, None, end_us),
    }
}

/// External event at a stage.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// State of a channel's lines as it arrives at the stage.
    Lines(u8, State),
    Code(u8, u16),
    /// Code of the trip level of a bank's comparators.
    Trip(u8, u16),
    /// Load, Ω; `None` is an open circuit.
    Load(u8, Option<f64>),
    /// Whether the pump's detector lets high voltage reach the stages.
    Supply(bool),
    /// Last edge of a run of the pump.
    PumpRests,
}

/// Returns all events in order of time; at one instant lines come before codes.
fn events(trace: &Trace, pump: &Pump, truth: &Truth, end_us: u64) -> Vec<(u64, Event)> {
    let mut events = Vec::with_capacity(2 * trace.levels.len() + trace.dac.len() + 16);
    for (channel, channel_truth) in (0u8..).zip(&truth.channels) {
        let loads = channel_truth.loads.iter();
        events.extend(loads.map(|&(t, ohm)| (t, Event::Load(channel, ohm))));
    }
    let (mut pins, mut inputs) = (Levels::ISOLATED, Levels::ISOLATED);
    let mut stuck: Vec<_> = truth.stuck.iter().map(|stuck| stuck.from_us).collect();
    stuck.sort_unstable();
    let mut stuck = stuck.into_iter().peekable();
    let mut levels = trace.levels.iter().peekable();
    loop {
        let next = levels.peek().map_or(u64::MAX, |entry| entry.0);
        let t_us = match stuck.next_if(|&from| from <= next) {
            Some(from) => from,
            None => match levels.next() {
                Some(&(t_us, now)) => {
                    pins = now;
                    t_us
                }
                None => break,
            },
        };
        let arrive = truth.levels_at_stages(pins, t_us);
        for channel in arrive.changed_channels(inputs) {
            events.push((t_us, Event::Lines(channel, arrive.state(channel))));
        }
        inputs = arrive;
    }
    let codes = trace.dac.iter();
    events.extend(codes.map(|write| (write.t_us, Event::Code(write.channel, write.code))));
    let trips = trace.trips.iter();
    events.extend(trips.map(|write| (write.t_us, Event::Trip(write.bank, write.code))));
    pump.report_supply(&truth.hardware, |t_us, event| events.push((t_us, event)));
    events.retain(|event| event.0 <= end_us);
    events.sort_by_key(|event| event.0);
    events
}

/// Simulates ten electrodes through all events.
fn play(
    events: &[(u64, Event)],
    truth: &Truth,
    built: Option<&Hardware>,
    end_us: u64,
) -> OutputJudgement {
    let mut electrodes: [Electrode<'_>; CHANNELS] =
        std::array::from_fn(|channel| Electrode::new(truth, channel as u8, built));
    for &(t_us, event) in events {
        match event {
            Event::Lines(channel, state) => electrodes[usize::from(channel)].set_lines(t_us, state),
            Event::Code(channel, code) => electrodes[usize::from(channel)].set_code(t_us, code),
            Event::Trip(bank, code) => {
                let of_bank = electrodes
                    .iter_mut()
                    .zip(BANKS)
                    .filter(|pair| pair.1 == bank);
                of_bank.for_each(|(e, _)| e.set_trip(t_us, code));
            }
            Event::Load(channel, ohm) => electrodes[usize::from(channel)].set_load(t_us, ohm),
            Event::Supply(on) => electrodes.iter_mut().for_each(|e| e.set_supply(t_us, on)),
            Event::PumpRests => electrodes.iter_mut().for_each(|e| e.rest_pump(t_us)),
        }
    }
    let mut account = OutputJudgement::default();
    for electrode in electrodes {
        account.merge(electrode.finish(end_us));
    }
    account
}
