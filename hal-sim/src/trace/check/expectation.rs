//! Expected pulses, groups and limits with which a trace is compared.

use std::ops::Range;

use super::super::levels::CHANNELS;
use super::super::pulses::{MAX_GAP_US, Polarity};
use super::violation::{Rule, Violation};

/// Form of the pulses of a train.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Two phases of equal width and opposite polarity; names the first.
    Biphasic(Polarity),
    /// One phase, then grounding.
    Monophasic(Polarity),
}

/// Pulses that one channel may output. All times in µs.
///
/// Pulse j of burst b starts at `epoch + offset + b·period + j·burst_interval`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TrainSpec {
    /// Channel number, 0…9.
    pub channel: u8,
    /// Form of each pulse.
    pub shape: Shape,
    /// Width of each phase.
    pub width_us: u64,
    /// Maximum width, if the width may change from burst to burst. Each burst then has its own
    /// width between the minimum in [`Limits`] and this maximum, and `width_us` is ignored.
    pub widest_us: Option<u64>,
    /// Requested interphase gap; the actual one is at least the dead time.
    pub gap_us: u64,
    /// Time from burst to burst.
    pub period_us: u64,
    /// Delay of the first burst after the epoch, 0…period.
    pub offset_us: u64,
    /// Number of pulses in a burst.
    pub burst_count: u64,
    /// Time from pulse to pulse in a burst; ignored for a burst of one.
    pub burst_interval_us: u64,
    /// Grounding after each pulse; 0 for none, allowed after biphasic pulses only.
    pub ground_us: u64,
    /// Time from which all offsets count, unwrapped.
    pub epoch_us: u64,
    /// Interval of unwrapped time in which bursts of this train may start.
    pub active_us: Range<u64>,
}

/// State of a group member while another member pulses (from the start of its first phase to the
/// end of its last) and it does not pulse itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GroupKind {
    /// The member is grounded. Pulses may overlap.
    Conducted,
    /// The member is isolated. Pulses may not overlap; grounding after a monophasic pulse is
    /// interrupted and then starts again in full.
    Isolated,
}

/// Channels that belong to one muscle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Rule for members that do not pulse.
    pub kind: GroupKind,
    /// Channels of the group, 0…9.
    pub members: Vec<u8>,
}

/// Bounds that hold for all trains. All times in µs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Allowed phase widths.
    pub width_us: std::ops::RangeInclusive<u64>,
    /// Allowed times from burst to burst.
    pub period_us: std::ops::RangeInclusive<u64>,
    /// Maximum number of pulses in a burst.
    pub burst_count: u64,
    /// Minimum contiguous grounding after a pulse, if there is any.
    pub ground_us: u64,
    /// Minimum time from a DAC write to the burst that it applies to.
    pub dac_lead_us: u64,
}

impl Default for Limits {
    /// Limits of the device: width 10–500 µs, 0.5–200 Hz, bursts of 1–8, 1 ms of grounding, 20 µs
    /// from DAC write to burst.
    fn default() -> Limits {
        Limits {
            width_us: 10..=500,
            period_us: 5_000..=2_000_000,
            burst_count: 8,
            ground_us: 1_000,
            dac_lead_us: 20,
        }
    }
}

/// Expected contents of a trace.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Expectation {
    /// Pulses that may appear. Trains of one channel follow each other: their `active_us` do not
    /// overlap. A channel without a train is silent.
    pub trains: Vec<TrainSpec>,
    /// Groups; a channel is in at most one.
    pub groups: Vec<Group>,
    /// Minimum undriven time between opposite polarities.
    pub dead_time_us: u64,
    /// Maximum DAC code of each channel.
    pub max_code: [u16; CHANNELS],
    /// Maximum product of DAC code and phase width of each channel, code·µs.
    pub max_code_us: [u64; CHANNELS],
    /// Bounds that hold for all trains.
    pub limits: Limits,
    /// Whether every pulse of every train must be present.
    pub complete: bool,
    /// End of the recording, unwrapped; later pulses are not required.
    pub end_us: u64,
}

impl TrainSpec {
    /// Returns the length of one pulse at its maximum width, from first to last edge.
    pub fn pulse_us(&self, dead_time_us: u64) -> u64 {
        let width_us = self.widest_us.unwrap_or(self.width_us);
        match self.shape {
            Shape::Biphasic(_) => 2 * width_us + self.gap_us.max(dead_time_us),
            Shape::Monophasic(_) => width_us,
        }
    }

    /// Returns the start of a pulse of the train, from the numbers of burst and pulse.
    pub fn start_us(&self, burst: u64, pulse: u64) -> u64 {
        self.first_us() + burst * self.period_us + pulse * self.burst_interval_us
    }

    /// Returns the start of the first burst if the train is active from its epoch.
    pub(super) fn first_us(&self) -> u64 {
        self.epoch_us + self.offset_us
    }

    /// Returns the numbers of the bursts in the active interval.
    pub(super) fn bursts(&self) -> Range<u64> {
        let count_before = |t_us: u64| {
            let since_us = t_us.saturating_sub(self.first_us());
            since_us.div_ceil(self.period_us)
        };
        count_before(self.active_us.start)..count_before(self.active_us.end)
    }

    /// Returns the name of the first field that contradicts the others or the limits.
    fn contradiction(&self, expected: &Expectation) -> Option<&'static str> {
        let limits = &expected.limits;
        let monophasic = matches!(self.shape, Shape::Monophasic(_));
        let rest_us = match self.ground_us {
            0 => expected.dead_time_us,
            ground_us => ground_us,
        };
        let is_grounded = monophasic || self.ground_us != 0;
        let room_us = self.pulse_us(expected.dead_time_us) + rest_us;
        let train_us = self.burst_count.saturating_sub(1) * self.burst_interval_us + room_us;
        let is_burst = self.burst_count > 1;
        let counts = 1..=limits.burst_count;
        [
            (usize::from(self.channel) >= CHANNELS, "channel"),
            (!limits.width_us.contains(&self.width_us), "width"),
            (
                self.widest_us
                    .is_some_and(|widest_us| !limits.width_us.contains(&widest_us)),
                "largest width",
            ),
            (self.gap_us > MAX_GAP_US, "gap"),
            (!limits.period_us.contains(&self.period_us), "period"),
            (self.offset_us > self.period_us, "offset"),
            (!counts.contains(&self.burst_count), "burst count"),
            (
                is_burst && self.burst_interval_us < room_us,
                "burst interval",
            ),
            (train_us > self.period_us, "burst longer than the period"),
            (
                is_grounded && self.ground_us < limits.ground_us,
                "grounding",
            ),
        ]
        .into_iter()
        .find_map(|(wrong, field)| wrong.then_some(field))
    }
}

impl Expectation {
    /// Returns the trains of one channel in order of time.
    pub(super) fn trains_of(&self, channel: u8) -> Vec<&TrainSpec> {
        let mut trains: Vec<_> = self.trains.iter().collect();
        trains.retain(|train| train.channel == channel);
        trains.sort_by_key(|train| train.active_us.start);
        trains
    }

    /// Returns the contradictions within the expectation.
    pub(super) fn contradictions(&self) -> Vec<Violation> {
        let wrong =
            |channel, t_us, field| Violation::new(t_us, channel, Rule::Specification(field));
        let contradiction = |train: &TrainSpec| {
            let field = train.contradiction(self)?;
            Some(wrong(train.channel, train.active_us.start, field))
        };
        let mut found: Vec<_> = self.trains.iter().filter_map(contradiction).collect();
        for channel in 0..CHANNELS as u8 {
            for pair in self.trains_of(channel).windows(2) {
                let start_us = pair[1].active_us.start;
                if pair[0].active_us.end > start_us {
                    found.push(wrong(channel, start_us, "trains overlap"));
                }
            }
        }
        let mut members: Vec<u8> = self.groups.iter().flat_map(|g| g.members.clone()).collect();
        members.sort_unstable();
        for pair in members.windows(2).filter(|pair| pair[0] == pair[1]) {
            found.push(wrong(pair[0], 0, "channel in two groups"));
        }
        for &channel in members.iter().filter(|&&c| usize::from(c) >= CHANNELS) {
            found.push(wrong(channel, 0, "channel"));
        }
        found
    }
}
