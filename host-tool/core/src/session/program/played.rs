//! The programs of a session: the order that each channel receives, burst by burst.

use firmware::pulse::WINDOW_US;
use firmware::safety::Stimulus;
use firmware::units::Amplitude;

use super::course::{BurstOrder, Course};
use super::passes::Passes;
use super::rise::Rise;

/// Characters for the eighths of a block, from an empty one to a whole one.
const BLOCKS: [char; 9] = ['·', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The programs of a session; each channel is in at most one of them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Programs {
    /// Programs of the single channels, sorted by channel.
    played: Vec<ChannelProgram>,
    /// Whether the width of any channel may change; the device then receives every width.
    has_widths: bool,
}

/// Amplitude course, train and rise of a channel, from which its bursts follow.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct ChannelProgram {
    /// Channel index on the link, 0–9.
    pub(super) channel: u8,
    pub(super) rise: Rise,
    pub(super) passes: Passes,
    pub(super) course: Course,
    /// Pulse width of the channel's train, µs.
    pub(super) own_us: u16,
    pub(super) has_live_width: bool,
}

impl Programs {
    pub(super) fn new(mut played: Vec<ChannelProgram>) -> Self {
        played.sort_unstable_by_key(|run| run.channel);
        Self {
            has_widths: played.iter().any(|run| run.has_live_width),
            played,
        }
    }

    /// Returns whether the session has no programs.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.played.is_empty()
    }

    /// Returns the channels that have a program, by index on the link (0–9), in rising order.
    pub fn channels(&self) -> impl Iterator<Item = u8> + '_ {
        self.played.iter().map(|run| run.channel)
    }

    /// Returns the order for the first burst of each channel at or after `t_us` microseconds after
    /// the start of the trains, sorted by channel on the link (0–9). Either all orders have a
    /// width, or all widths are 0.
    ///
    /// The burst then has the amplitude that its program wants, to a thousandth or a step of its
    /// DAC, if every burst is ordered in this way and the device begins its rises where the program
    /// does.
    #[must_use]
    pub fn at(&self, t_us: u64) -> Vec<(u8, Stimulus)> {
        let order = |run: &ChannelProgram| {
            let order = run.stimulus_at(t_us);
            let width_us = match (self.has_widths, order.width_us) {
                (false, _) => 0,
                (true, 0) => run.own_us,
                (true, width_us) => width_us,
            };
            let order = Stimulus { width_us, ..order };
            (run.channel, order)
        };
        self.played.iter().map(order).collect()
    }

    /// Returns the shortest period of the trains of these channels, µs, or `None` without channels.
    #[must_use]
    pub fn shortest_period_us(&self) -> Option<u64> {
        self.played.iter().map(|run| run.rise.period_us).min()
    }

    /// Returns the steps of a channel on the link (0–9), at times in µs after the beginning of a
    /// pass, or `None` if its program does not hold each step.
    pub(in crate::session) fn steps(&self, channel: u8) -> Option<&[(u64, Stimulus)]> {
        let own = self.played.iter().find(|run| run.channel == channel)?;
        match &own.course {
            Course::Points {
                points,
                is_held: true,
            } => Some(points),
            _ => None,
        }
    }

    /// Returns the time from one possible change of orders to the next, µs: whole windows of the
    /// device, and at most the shortest period, so that no channel has two bursts in between.
    /// Returns `None` without channels.
    #[must_use]
    pub fn tick_us(&self) -> Option<u64> {
        let window_us = u64::from(WINDOW_US);
        let windows = self.shortest_period_us()? / window_us;
        Some(windows.max(1) * window_us)
    }

    /// Returns the time within which every channel has begun and finished two passes, or its only
    /// one, µs.
    #[must_use]
    pub fn two_passes_us(&self) -> u64 {
        let ends = self.played.iter().map(|run| {
            let passes_us = run.passes.every_us.map(|every_us| 2.0 * every_us);
            run.passes.first_us + passes_us.unwrap_or(run.course.pass_duration_us())
        });
        ends.fold(0.0, f64::max).ceil() as u64
    }

    /// Draws amplitudes over time for people: for each channel on the link (0–9) a line of
    /// `columns` blocks, over `length_us` from the start on. A whole block is the largest amplitude
    /// of the channel.
    #[must_use]
    pub fn amplitude_charts(&self, length_us: u64, columns: u64) -> Vec<(u8, String)> {
        let line = |run: &ChannelProgram| {
            let most = run
                .course
                .stimuli()
                .map(|stimulus| stimulus.amplitude.get())
                .max();
            let block = |column: u64| {
                // The time in the middle of the column.
                let t_us = length_us * (2 * column + 1) / (2 * columns.max(1));
                let amplitude = run
                    .burst_order(t_us)
                    .map_or(0.0, |wanted_value| wanted_value.amplitude);
                let part = amplitude / f64::from(most.unwrap_or(0)).max(1.0);
                let blocks = BLOCKS.len() as f64 - 1.0;
                BLOCKS.get((part * blocks).ceil() as usize).copied()
            };
            (run.channel, (0..columns).filter_map(block).collect())
        };
        self.played.iter().map(line).collect()
    }

    /// Returns the smallest and the largest amplitude that a channel on the link (0–9) is ordered
    /// to output, thousandths of its unit.
    #[must_use]
    pub fn extremes(&self, channel: u8) -> Option<(u32, u32)> {
        let own = self.played.iter().find(|run| run.channel == channel)?;
        let values = own
            .course
            .stimuli()
            .map(|stimulus| stimulus.amplitude.get());
        Some((0, values.max()?))
    }
}

impl ChannelProgram {
    /// Returns the stimulus that the first burst at or after `t_us` should have, or `None` before
    /// the first pass.
    fn burst_order(&self, t_us: u64) -> Option<BurstOrder> {
        let at_us = self.rise.next_burst_us(t_us);
        let begun_us = self.passes.latest_start_us(at_us)?;
        Some(self.course.burst_order(&self.rise, begun_us, at_us))
    }

    /// Returns the order for the first burst at or after `t_us`; an amplitude of 0 before the first
    /// pass.
    fn stimulus_at(&self, t_us: u64) -> Stimulus {
        let off = Stimulus {
            amplitude: Amplitude::ZERO,
            width_us: self.own_us,
        };
        let wanted = self.burst_order(t_us);
        wanted.map_or(off, |wanted| wanted.to_stimulus(&self.rise))
    }
}
