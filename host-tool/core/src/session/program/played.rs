//! The programs of a session: the order that each channel receives, burst by burst.

use firmware::pulse::WINDOW_US;
use firmware::safety::Stimulus;
use firmware::units::Amplitude;

use super::course::{BurstOrder, Course};
use super::passes::Passes;
use super::rise::Rise;

/// Characters that draw an amplitude as a bar of zero to eight eighths of a line's height.
const BLOCKS: [char; 9] = ['·', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The programs of a session. Each channel has at most one of them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Programs {
    /// Program of each channel that has one, sorted by channel.
    played: Vec<ChannelProgram>,
    /// Whether the pulse width of any of the channels may change. The host then sends the widths of
    /// all of them.
    has_widths: bool,
}

/// Program of one channel, with the train and the rise that determine its bursts.
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

    /// Returns the channels that have a program, as indices on the link (0–9) in rising order.
    pub fn channels(&self) -> impl Iterator<Item = u8> + '_ {
        self.played.iter().map(|run| run.channel)
    }

    /// Returns the setpoint for the next burst of each channel, that is its first burst at or after
    /// `t_us` µs after the start of the trains. The setpoints are sorted by channel (0–9 on the
    /// link). Either all of them have a width, or all widths are 0.
    ///
    /// The burst then has the amplitude that its program wants, to within a thousandth or a step of
    /// its DAC. This requires that the host sends a setpoint for every burst in this way, and that
    /// the device begins its rises where the program does.
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

    /// Returns the shortest period of the trains of the channels that have a program, µs, or `None`
    /// if there are none.
    #[must_use]
    pub fn shortest_period_us(&self) -> Option<u64> {
        self.played.iter().map(|run| run.rise.period_us).min()
    }

    /// Returns the steps of the program on a channel (0–9 on the link), at times in µs after the
    /// beginning of a pass. Returns `None` if the channel has no program that consists of steps.
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

    /// Returns the time after which the host computes the setpoints again, µs: a whole number of
    /// windows of the pulse tape, and if possible at most the shortest period, so that no channel
    /// has two bursts in between. Returns `None` if no channel has a program.
    #[must_use]
    pub fn tick_us(&self) -> Option<u64> {
        let window_us = u64::from(WINDOW_US);
        let windows = self.shortest_period_us()? / window_us;
        Some(windows.max(1) * window_us)
    }

    /// Returns the time within which every channel has finished two passes, or its only one, µs
    /// after the start.
    #[must_use]
    pub fn two_passes_us(&self) -> u64 {
        let ends = self.played.iter().map(|run| {
            let passes_us = run.passes.every_us.map(|every_us| 2.0 * every_us);
            run.passes.first_us + passes_us.unwrap_or(run.course.pass_duration_us())
        });
        ends.fold(0.0, f64::max).ceil() as u64
    }

    /// Draws the amplitude of each channel (0–9 on the link) over the first `length_us` of the
    /// session, as a line of `columns` characters. A full block is the channel's largest amplitude.
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

    /// Returns the smallest and the largest amplitude that the program asks for on a channel (0–9
    /// on the link), in thousandths of the channel's unit. The smallest is always 0. `None` if the
    /// channel has no program.
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
    /// Returns the stimulus that the program wants for the first burst at or after `t_us`, or
    /// `None` before the first pass.
    fn burst_order(&self, t_us: u64) -> Option<BurstOrder> {
        let at_us = self.rise.next_burst_us(t_us);
        let begun_us = self.passes.latest_start_us(at_us)?;
        Some(self.course.burst_order(&self.rise, begun_us, at_us))
    }

    /// Returns the setpoint for the first burst at or after `t_us`. Its amplitude is 0 before the
    /// first pass.
    fn stimulus_at(&self, t_us: u64) -> Stimulus {
        let off = Stimulus {
            amplitude: Amplitude::ZERO,
            width_us: self.own_us,
        };
        let wanted = self.burst_order(t_us);
        wanted.map_or(off, |wanted| wanted.to_stimulus(&self.rise))
    }
}
