//! Trace as rows, one per change of a channel's state.

use super::levels::{CHANNELS, ChangedChannels, Levels, State};
use super::record::{DacWrite, Trace};

/// Change of one channel to another state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Time of the change, unwrapped microseconds.
    pub t_us: u64,
    /// Channel number, 0…9 (edge files count from 1).
    pub channel: u8,
    /// State after the change.
    pub state: State,
    /// Amplitude code in force; a write in the same microsecond does not count yet.
    pub dac_code: u16,
}

/// Iterator over all edges of a trace, ordered by time, then channel.
pub struct Edges<'a> {
    levels: std::slice::Iter<'a, (u64, Levels)>,
    writes: std::iter::Peekable<std::slice::Iter<'a, DacWrite>>,
    codes: [u16; CHANNELS],
    t_us: u64,
    now: Levels,
    /// Channels whose change at `t_us` has not been returned yet.
    pending: ChangedChannels,
}

impl Trace {
    /// Returns all edges, ordered by time, then channel.
    pub fn edges(&self) -> Edges<'_> {
        Edges {
            levels: self.levels.iter(),
            writes: self.dac.iter().peekable(),
            codes: self.start.1,
            t_us: 0,
            now: self.start.0,
            pending: ChangedChannels::default(),
        }
    }

    /// Returns the edges from `from_us` on, without iterating over the earlier ones.
    pub fn edges_from(&self, from_us: u64) -> Edges<'_> {
        let (before, levels) = self
            .levels
            .split_at(self.levels.partition_point(|entry| entry.0 < from_us));
        Edges {
            levels: levels.iter(),
            now: before.last().map_or(self.start.0, |entry| entry.1),
            ..self.edges()
        }
    }

    /// Returns the edges of one channel (0…9), in order of time.
    pub fn channel_edges(&self, channel: u8) -> impl Iterator<Item = Edge> {
        self.edges().filter(move |edge| edge.channel == channel)
    }
}

impl Iterator for Edges<'_> {
    type Item = Edge;

    #[inline]
    fn next(&mut self) -> Option<Edge> {
        let channel = loop {
            if let Some(channel) = self.pending.next() {
                break channel;
            }
            let &(t_us, levels) = self.levels.next()?;
            while let Some(write) = self.writes.next_if(|write| write.t_us < t_us) {
                self.codes[usize::from(write.channel)] = write.code;
            }
            self.pending = levels.changed_channels(self.now);
            (self.t_us, self.now) = (t_us, levels);
        };
        Some(Edge {
            t_us: self.t_us,
            channel,
            state: self.now.state(channel),
            dac_code: self.codes[usize::from(channel)],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_carry_state_and_code_in_force() {
        let mut trace = Trace::default();
        trace.record_dac(10, 2, 700);
        let driven = Levels::ISOLATED
            .with_channel(2, State::Cathodic)
            .with_channel(5, State::Anodic);
        trace.record_levels(100, driven);
        trace.record_levels(150, driven.with_sync(true));
        trace.record_levels(300, Levels::ISOLATED.with_channel(5, State::Anodic));
        trace.record_dac(300, 2, 900);
        let summary = |e: Edge| (e.t_us, e.channel, e.state, e.dac_code);
        let summaries: Vec<_> = trace.edges().map(summary).collect();
        let [a, b] = [(100, 2, State::Cathodic, 700), (100, 5, State::Anodic, 0)];
        assert_eq!(summaries, [a, b, (300, 2, State::Isolated, 700)]);
        assert!(trace.channel_edges(5).map(summary).eq([b]));
        for from_us in [0, 99, 100, 101, 150, 151, 300, 301] {
            let edges = trace.edges().filter(|edge| edge.t_us >= from_us);
            assert!(trace.edges_from(from_us).eq(edges), "{from_us}");
        }
    }
}
