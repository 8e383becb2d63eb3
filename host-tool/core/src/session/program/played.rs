//! The programs of a session: what each channel is ordered, burst by burst.

use firmware::pulse::WINDOW_US;
use firmware::safety::Stimulus;
use firmware::units::Amplitude;

use super::course::{Course, Wanted};
use super::passes::Passes;
use super::rise::Rise;

/// Eighths of a block, from none to a whole one.
const BLOCKS: [char; 9] = ['·', '▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// The programs of a session, a channel in one of them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Programs {
    /// By rising channel.
    played: Vec<Played>,
    /// Whether any channel's width may change: then the device is told every width.
    has_widths: bool,
}

/// The program of one channel.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Played {
    /// On the link, 0–9.
    pub(super) channel: u8,
    pub(super) rise: Rise,
    pub(super) passes: Passes,
    pub(super) course: Course,
    /// Of its train, µs.
    pub(super) own_us: u16,
    pub(super) has_live_width: bool,
}

impl Programs {
    pub(super) fn new(mut played: Vec<Played>) -> Self {
        played.sort_unstable_by_key(|run| run.channel);
        Self {
            has_widths: played.iter().any(|run| run.has_live_width),
            played,
        }
    }

    /// Whether the session has none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.played.is_empty()
    }

    /// Its channels on the link (0–9), rising.
    pub fn channels(&self) -> impl Iterator<Item = u8> + '_ {
        self.played.iter().map(|run| run.channel)
    }

    /// What to order for the first burst of each channel at or after `t_us` microseconds
    /// after the start of the trains, by rising channel on the link (0–9). Widths of all of
    /// them, or of none: 0.
    ///
    /// A burst then has what its program wants, to a thousandth or a step of its DAC, if
    /// every burst is ordered so and the device begins its rises where the program does.
    #[must_use]
    pub fn at(&self, t_us: u64) -> Vec<(u8, Stimulus)> {
        let order = |run: &Played| {
            let order = run.order(t_us);
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

    /// The shortest period of its channels' trains, µs; nothing without channels.
    #[must_use]
    pub fn shortest_period_us(&self) -> Option<u64> {
        self.played.iter().map(|run| run.rise.period_us).min()
    }

    /// The steps of a channel on the link (0–9) whose program holds each, at µs after the
    /// begin of a pass.
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

    /// From one time at which orders may change to the next, µs: whole windows of the device,
    /// and at most the shortest period, so that no channel has two bursts in between. Nothing
    /// without channels.
    #[must_use]
    pub fn tick_us(&self) -> Option<u64> {
        let window_us = u64::from(WINDOW_US);
        let windows = self.shortest_period_us()? / window_us;
        Some(windows.max(1) * window_us)
    }

    /// The longest time, µs, in which a channel has begun and played two passes, or its only
    /// one.
    #[must_use]
    pub fn two_passes_us(&self) -> u64 {
        let ends = self.played.iter().map(|run| {
            let passes_us = run.passes.every_us.map(|every_us| 2.0 * every_us);
            run.passes.first_us + passes_us.unwrap_or(run.course.lasts_us())
        });
        ends.fold(0.0, f64::max).ceil() as u64
    }

    /// Amplitudes over time for people: a line of `columns` blocks for each channel on the
    /// link (0–9), over `length_us` from the start on; a whole block is the channel's
    /// largest amplitude.
    #[must_use]
    pub fn drawn(&self, length_us: u64, columns: u64) -> Vec<(u8, String)> {
        let line = |run: &Played| {
            let most = run
                .course
                .stimuli()
                .map(|stimulus| stimulus.amplitude.get())
                .max();
            let block = |column: u64| {
                // The middle of the column.
                let t_us = length_us * (2 * column + 1) / (2 * columns.max(1));
                let amplitude = run
                    .wanted(t_us)
                    .map_or(0.0, |wanted_value| wanted_value.amplitude);
                let part = amplitude / f64::from(most.unwrap_or(0)).max(1.0);
                let blocks = BLOCKS.len() as f64 - 1.0;
                BLOCKS.get((part * blocks).ceil() as usize).copied()
            };
            (run.channel, (0..columns).filter_map(block).collect())
        };
        self.played.iter().map(line).collect()
    }

    /// The least and the most that a channel on the link (0–9) is ordered, thousandths of its
    /// unit.
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

impl Played {
    /// What the first burst at or after `t_us` is to have; nothing before the first pass.
    fn wanted(&self, t_us: u64) -> Option<Wanted> {
        let at_us = self.rise.burst_from(t_us);
        let begun_us = self.passes.begun(at_us)?;
        Some(self.course.wanted(&self.rise, begun_us, at_us))
    }

    /// What to order for it.
    fn order(&self, t_us: u64) -> Stimulus {
        let off = Stimulus {
            amplitude: Amplitude::ZERO,
            width_us: self.own_us,
        };
        let wanted = self.wanted(t_us);
        wanted.map_or(off, |wanted| wanted.order(&self.rise))
    }
}
