//! Promises about a board's outputs and answers that hold for any input, checked from the output
//! alone, without knowledge of the scheduler.

use firmware::link::{Decoder, Event, Response};
use firmware::lockstep::Sink;
use firmware::pulse::{CHANNELS, Levels, State as Line};
use firmware::safety::State;
use firmware::units::{DacCode, Micros, us};

/// Longest time from an arm request to the last pulse of the electrode check: two windows until the
/// request is processed, and ten pulses 2 ms apart.
const CHECK_US: u32 = 25_000;

/// Time for which rendered windows play on after a change of state: two windows.
const RENDERED_US: u32 = 500;

/// Longest phase (design, "Pulses").
const MAX_PHASE_US: u32 = 500;

/// Disconnected time between opposite drive (design, "Pulses": a board constant).
const DEAD_TIME_US: u32 = firmware::pulse::DEAD_TIME_US as u32;

/// Output state of one channel.
#[derive(Clone, Copy)]
struct Channel {
    line: Line,
    since: Micros,
    /// Direction of the latest drive, and time at which it ended.
    drive: Option<(Line, Micros)>,
}

/// Checker of everything that a board outputs.
pub struct Watch {
    /// Time until which driven outputs are allowed.
    may_drive: Option<Micros>,
    channels: [Channel; CHANNELS],
    answers: Decoder,
    /// Times at which the board reported a fault.
    pub faults: Vec<Micros>,
    /// Whether any output has been driven.
    pub has_driven: bool,
    /// Number of requests that the board carried out.
    pub acknowledged: u32,
    /// Number of requests or frames that the board refused.
    pub refused: u32,
}

impl Default for Watch {
    fn default() -> Self {
        let quiet = Channel {
            line: Line::Isolated,
            since: Micros::new(0),
            drive: None,
        };
        Self {
            may_drive: None,
            channels: [quiet; CHANNELS],
            answers: Decoder::default(),
            faults: Vec::new(),
            has_driven: false,
            acknowledged: 0,
            refused: 0,
        }
    }
}

impl Watch {
    /// Notes that the host has asked the board to arm.
    pub fn note_arm_request(&mut self, now: Micros) {
        self.allow_until(now + us(CHECK_US));
    }

    /// Notes that the board is in `state` at `now`; must be called at least once in every window.
    pub fn note_state(&mut self, now: Micros, state: State) {
        if matches!(state, State::Armed | State::Stimulating | State::Stopping) {
            self.allow_until(now + us(RENDERED_US));
        }
    }

    fn allow_until(&mut self, until: Micros) {
        if self.may_drive.is_none_or(|before| before.is_before(until)) {
            self.may_drive = Some(until);
        }
    }

    fn check_change(&mut self, index: usize, line: Line, at: Micros) {
        let channel = &mut self.channels[index];
        if is_driven(channel.line) {
            let length = at.get().wrapping_sub(channel.since.get());
            assert!(length <= MAX_PHASE_US, "channel {index}: {length} µs phase");
            channel.drive = Some((channel.line, at));
        }
        if is_driven(line) {
            if let Some((before, end)) = channel.drive {
                let apart = at.get().wrapping_sub(end.get());
                let is_safe = before == line || apart >= DEAD_TIME_US;
                assert!(is_safe, "channel {index}: reversed within {apart} µs");
            }
            let may_drive = self.may_drive.is_some_and(|until| at.is_before(until));
            assert!(may_drive, "channel {index} driven at {at:?} unarmed");
            self.has_driven = true;
        }
        (channel.line, channel.since) = (line, at);
    }
}

const fn is_driven(line: Line) -> bool {
    matches!(line, Line::Anodic | Line::Cathodic)
}

impl Sink for Watch {
    fn write_levels(&mut self, at: Micros, levels: Levels) {
        for index in 0..CHANNELS {
            let line = levels.state(index);
            if line != self.channels[index].line {
                self.check_change(index, line, at);
            }
        }
    }

    fn write_dac(&mut self, _: Micros, channel: u8, _: DacCode) {
        assert!(usize::from(channel) < CHANNELS, "DAC of channel {channel}");
    }

    fn write_bytes(&mut self, _: Micros, bytes: &[u8]) {
        for &byte in bytes {
            let Some(result) = self.answers.push(byte) else {
                continue;
            };
            let message = result.expect("the board frames what it says");
            match postcard::from_bytes(message).expect("the board says what it means") {
                Response::Ack { .. } | Response::Hello(_) => self.acknowledged += 1,
                Response::Refused { .. } => self.refused += 1,
                Response::Event {
                    event: Event::Faulted(record),
                    ..
                } => self.faults.push(record.at),
                Response::Status { .. } | Response::Event { .. } | Response::Telemetry(_) => {}
            }
            self.answers.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::panic::{AssertUnwindSafe, catch_unwind};

    /// Returns whether the checker objects to these states of channel 3 at these times.
    fn objects(armed: bool, lines: &[(u32, Line)]) -> bool {
        let mut watch = Watch::default();
        if armed {
            watch.note_state(Micros::new(0), State::Armed);
        }
        let play = || {
            for (at, line) in lines {
                watch.write_levels(Micros::new(*at), Levels::ISOLATED.with_channel(3, *line));
            }
        };
        catch_unwind(AssertUnwindSafe(play)).is_err()
    }

    #[test]
    fn the_watch_sees_what_it_is_there_to_see() {
        use Line::{Anodic, Cathodic, Grounded, Isolated};
        let pulse = [(10, Cathodic), (210, Isolated), (215, Anodic)];
        assert!(!objects(true, &pulse));
        assert!(objects(false, &pulse));
        assert!(!objects(false, &[(10, Grounded), (900, Isolated)]));
        assert!(objects(true, &[(499, Isolated), (500, Cathodic)]));
        assert!(objects(true, &[(10, Cathodic), (210, Anodic)]));
        let short = [(10, Cathodic), (210, Grounded), (214, Anodic)];
        assert!(objects(true, &short));
        assert!(objects(true, &[(0, Cathodic), (501, Isolated)]));
    }
}
