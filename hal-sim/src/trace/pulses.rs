//! Groups edges into pulses, from the states alone.

use super::intervals::{Interval, append};
use super::levels::{CHANNELS, State};
use super::record::{Event, Trace};

/// Maximum gap between the phases of one biphasic pulse, µs: the longest interphase gap of a train.
/// The channel must be isolated in between, and the polarities must be opposite.
pub const MAX_GAP_US: u64 = 200;

/// Direction of the current in a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polarity {
    /// Current in the cathodic direction.
    Cathodic,
    /// Current in the anodic direction.
    Anodic,
}

/// One pulse of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pulse {
    /// Start of the first phase, unwrapped microseconds.
    pub start_us: u64,
    /// Channel number, 0…9.
    pub channel: u8,
    /// Number of phases seen: 1 or 2.
    pub phases: u8,
    /// Polarity of the first phase; a second phase has the opposite one.
    pub first: Polarity,
    /// Length of each phase, µs; the second is 0 if there is only one phase.
    pub width_us: [u64; 2],
    /// Time between the phases, µs; 0 if there is only one phase.
    pub gap_us: u64,
    /// Uninterrupted grounding that starts exactly at the end of the pulse, µs; 0 if the channel is
    /// isolated after the pulse.
    pub grounded_us: u64,
    /// DAC code in force when the pulse started.
    pub code: u16,
    /// Net charge, code·µs, anodic positive, with the code in force at each microsecond.
    pub charge: i64,
    /// Whether the pulse is certainly over; false if the recording ended too early to decide.
    pub complete: bool,
}

impl Pulse {
    /// Returns the end of the last phase, unwrapped microseconds.
    pub fn end_us(&self) -> u64 {
        self.start_us + self.width_us[0] + self.gap_us + self.width_us[1]
    }
}

/// Activity of one channel, for the checker.
#[derive(Default)]
pub(super) struct ChannelRecord {
    pub pulses: Vec<Pulse>,
    pub grounded: Vec<Interval>,
    /// Start and length of undriven time between phases of opposite polarity that follow each other
    /// within [`MAX_GAP_US`].
    pub reversals: Vec<(u64, u64)>,
}

impl Trace {
    /// Returns all pulses by channel, each list in order of time, of a recording that ended at
    /// `end_us`.
    pub fn pulses(&self, end_us: u64) -> [Vec<Pulse>; CHANNELS] {
        self.channel_records(end_us).map(|record| record.pulses)
    }

    pub(super) fn channel_records(&self, end_us: u64) -> [ChannelRecord; CHANNELS] {
        let mut trackers: [Tracker; CHANNELS] = Default::default();
        let (mut now, codes) = self.start;
        for (tracker, code) in trackers.iter_mut().zip(codes) {
            tracker.code = code;
        }
        for event in self.events() {
            match event {
                Event::Levels(t_us, levels) => {
                    for channel in levels.changed_channels(now) {
                        trackers[usize::from(channel)].enter(t_us, channel, levels.state(channel));
                    }
                    now = levels;
                }
                Event::Dac(write) => {
                    let tracker = &mut trackers[usize::from(write.channel)];
                    tracker.deliver_until(write.t_us);
                    tracker.code = write.code;
                }
            }
        }
        trackers.map(|tracker| tracker.finish(end_us))
    }
}

/// Collects the pulses of one channel from its states.
#[derive(Default)]
struct Tracker {
    record: ChannelRecord,
    state: State,
    since_us: u64,
    code: u16,
    /// Time up to which the charge of the current phase has been counted, µs.
    delivered_us: u64,
}

impl Tracker {
    fn enter(&mut self, t_us: u64, channel: u8, state: State) {
        self.leave(t_us);
        if state.is_driven() {
            self.start_phase(t_us, channel, state);
        }
        (self.state, self.since_us, self.delivered_us) = (state, t_us, t_us);
    }

    /// Ends the interval in the present state.
    fn leave(&mut self, t_us: u64) {
        self.deliver_until(t_us);
        let length = t_us.saturating_sub(self.since_us);
        let last = self.record.pulses.last_mut();
        match (self.state, last) {
            (State::Anodic | State::Cathodic, Some(pulse)) => {
                pulse.width_us[usize::from(pulse.phases - 1)] = length;
                pulse.complete = pulse.phases == 2;
            }
            (State::Grounded, last) => {
                append(&mut self.record.grounded, (self.since_us, t_us));
                if let Some(pulse) = last {
                    pulse.complete = true;
                    if pulse.end_us() == self.since_us {
                        pulse.grounded_us = length;
                    }
                }
            }
            _ => {}
        }
    }

    fn start_phase(&mut self, t_us: u64, channel: u8, state: State) {
        let first = match state {
            State::Anodic => Polarity::Anodic,
            _ => Polarity::Cathodic,
        };
        if let Some(pulse) = self.record.pulses.last_mut() {
            let gap = t_us.saturating_sub(pulse.end_us());
            let same_polarity = (pulse.first == first) == (pulse.phases == 1);
            if gap <= MAX_GAP_US && !same_polarity {
                self.record.reversals.push((pulse.end_us(), gap));
            }
            if gap <= MAX_GAP_US && !same_polarity && !pulse.complete {
                pulse.phases = 2;
                pulse.gap_us = gap;
                return;
            }
            pulse.complete = true;
        }
        self.record.pulses.push(Pulse {
            start_us: t_us,
            channel,
            phases: 1,
            first,
            width_us: [0; 2],
            gap_us: 0,
            grounded_us: 0,
            code: self.code,
            charge: 0,
            complete: false,
        });
    }

    /// Adds the charge of the current phase up to `t_us`.
    fn deliver_until(&mut self, t_us: u64) {
        if self.state.is_driven()
            && let Some(pulse) = self.record.pulses.last_mut()
        {
            let time = t_us.saturating_sub(self.delivered_us) as i64;
            pulse.charge += self.state.sign() * i64::from(self.code) * time;
        }
        self.delivered_us = t_us;
    }

    fn finish(mut self, end_us: u64) -> ChannelRecord {
        self.leave(end_us);
        let driven = self.state.is_driven();
        if let Some(pulse) = self.record.pulses.last_mut() {
            let long_over = end_us.saturating_sub(pulse.end_us()) > MAX_GAP_US;
            pulse.complete = !driven && (pulse.complete || long_over);
        }
        self.record
    }
}

#[cfg(test)]
mod tests {
    use super::super::levels::Levels;
    use super::*;

    fn trace(edges: &[(u64, State)]) -> Trace {
        let mut trace = Trace::default();
        trace.record_dac(0, 4, 100);
        for &(t_us, state) in edges {
            trace.record_levels(t_us, Levels::ISOLATED.with_channel(4, state));
        }
        trace
    }

    const BIPHASIC: [(u64, State); 4] = [
        (1000, State::Cathodic),
        (1200, State::Isolated),
        (1230, State::Anodic),
        (1430, State::Isolated),
    ];

    #[test]
    fn two_phases_make_one_pulse() {
        let pulse = Pulse {
            start_us: 1000,
            channel: 4,
            phases: 2,
            first: Polarity::Cathodic,
            width_us: [200, 200],
            gap_us: 30,
            grounded_us: 0,
            code: 100,
            charge: 0,
            complete: true,
        };
        assert_eq!(trace(&BIPHASIC).pulses(1430)[4], [pulse]);
        assert_eq!(pulse.end_us(), 1430);
    }

    #[test]
    fn grounding_belongs_to_its_pulse() {
        let edges = [
            (1000, State::Anodic),
            (1200, State::Grounded),
            (2300, State::Isolated),
        ];
        let pulses = &trace(&edges).pulses(9000)[4];
        assert_eq!(pulses.len(), 1);
        assert_eq!((pulses[0].phases, pulses[0].grounded_us), (1, 1100));
        assert_eq!((pulses[0].charge, pulses[0].complete), (20_000, true));
    }

    #[test]
    fn a_pulse_cut_by_the_end_is_not_complete() {
        for (shown, end_us, complete) in [(1, 1100, false), (2, 1300, false), (2, 1401, true)] {
            let pulses = &trace(&BIPHASIC[..shown]).pulses(end_us)[4];
            assert_eq!((pulses.len(), pulses[0].complete), (1, complete));
        }
        assert!(!trace(&BIPHASIC[..3]).pulses(1400)[4][0].complete);
    }

    #[test]
    fn charge_follows_the_code_through_the_phase() {
        let mut trace = trace(&BIPHASIC);
        trace.record_dac(1330, 4, 103);
        assert_eq!(trace.pulses(2000)[4][0].charge, 300);
    }

    #[test]
    fn doublets_are_two_pulses() {
        let second = BIPHASIC.map(|(t_us, state)| (t_us + 440, state));
        let edges = [BIPHASIC, second].concat();
        let pulses = &trace(&edges).pulses(5000)[4];
        assert_eq!(pulses.len(), 2);
        assert_eq!((pulses[0].charge, pulses[1].charge), (0, 0));
    }
}
