//! Recorder of a device's output, and conversion of its wrapping 32-bit time.

use super::levels::{CHANNELS, Levels};
use serde::Serialize;

/// One write to a channel's amplitude DAC.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct DacWrite {
    /// Time at which the output changes, unwrapped microseconds.
    pub t_us: u64,
    /// Channel number, 0…9.
    pub channel: u8,
    /// Amplitude code, 0…65535.
    pub code: u16,
}

/// One write of the trip level of a bank's comparators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct TripWrite {
    /// Time at which the level changes, unwrapped microseconds.
    pub t_us: u64,
    /// Bank, 0…5 (docs/reference/hardware.md, The banks' comparators).
    pub bank: u8,
    /// Code of the level, 0…65535.
    pub code: u16,
}

/// Everything that a device emitted: every change of a line and every DAC write.
///
/// All lists are in order of time. Before the first entry all channels are isolated, all amplitudes
/// are zero, and no bank's comparators have a level, unless [`Trace::take`] took an earlier part. A
/// line change and a DAC write in the same microsecond count in that order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Trace {
    /// Changes of the lines: unwrapped microseconds, and the lines from then on.
    pub levels: Vec<(u64, Levels)>,
    /// All DAC writes, including those that repeat the code in force.
    pub dac: Vec<DacWrite>,
    /// All writes of a bank's trip level; empty if the recording does not contain them.
    pub trips: Vec<TripWrite>,
    /// Lines and DAC codes before the first entry: those at the end of the part that
    /// [`Trace::take`] removed.
    #[serde(skip)]
    pub start: (Levels, [u16; CHANNELS]),
}

impl Trace {
    /// Records the lines at `t_us`; costs one comparison if nothing changed.
    ///
    /// The later of two records of the same microsecond replaces the earlier one, because the two
    /// ports of a board may be reported one after the other. Times must not decrease;
    /// [`super::check()`] reports a trace whose times do.
    #[inline]
    pub fn record_levels(&mut self, t_us: u64, levels: Levels) {
        match self.levels.last_mut() {
            Some((_, last)) if *last == levels => {}
            Some((last_t, _)) if *last_t == t_us => self.replace_last(levels),
            None if levels == self.start.0 => {}
            _ => self.levels.push((t_us, levels)),
        }
    }

    /// Replaces the last entry, or removes it if it is no longer a change.
    fn replace_last(&mut self, levels: Levels) {
        let Some((t_us, _)) = self.levels.pop() else {
            return;
        };
        if levels != self.last_levels() {
            self.levels.push((t_us, levels));
        }
    }

    /// Records a write of `code` to the DAC of `channel` (0…9).
    ///
    /// # Panics
    /// Panics if there is no such channel.
    #[inline]
    pub fn record_dac(&mut self, t_us: u64, channel: u8, code: u16) {
        assert!(usize::from(channel) < CHANNELS, "no channel {channel}");
        self.dac.push(DacWrite {
            t_us,
            channel,
            code,
        });
    }

    /// Records a write of `code` as the trip level of `bank` (0…5).
    pub fn record_trip(&mut self, t_us: u64, bank: u8, code: u16) {
        self.trips.push(TripWrite { t_us, bank, code });
    }

    /// Returns the lines after the last change.
    pub fn last_levels(&self) -> Levels {
        self.levels.last().map_or(self.start.0, |entry| entry.1)
    }

    /// Removes and returns the part recorded before `end_us`; the rest continues from there. A
    /// recording without an end is taken in such pieces, so that it needs little memory.
    #[must_use]
    pub fn take(&mut self, end_us: u64) -> Trace {
        let levels = self.levels.partition_point(|entry| entry.0 < end_us);
        let dac = self.dac.partition_point(|write| write.t_us < end_us);
        let trips = self.trips.partition_point(|write| write.t_us < end_us);
        let (last, mut codes) = self.start;
        for write in &self.dac[..dac] {
            codes[usize::from(write.channel)] = write.code;
        }
        let last = self.levels[..levels].last().map_or(last, |entry| entry.1);
        let rest = Trace {
            levels: self.levels.split_off(levels),
            dac: self.dac.split_off(dac),
            trips: self.trips.split_off(trips),
            start: (last, codes),
        };
        std::mem::replace(self, rest)
    }

    /// Copies the part recorded up to and including `end_us`. If the expectation has the same
    /// `end_us`, a correct trace passes the check wherever it is cut.
    #[must_use]
    pub fn up_to(&self, end_us: u64) -> Trace {
        let levels = self.levels.partition_point(|entry| entry.0 <= end_us);
        let dac = self.dac.partition_point(|write| write.t_us <= end_us);
        let trips = self.trips.partition_point(|write| write.t_us <= end_us);
        Trace {
            levels: self.levels[..levels].to_vec(),
            dac: self.dac[..dac].to_vec(),
            trips: self.trips[..trips].to_vec(),
            start: self.start,
        }
    }

    /// Returns line changes and DAC writes in order of time; in the same microsecond the lines come
    /// first.
    pub(super) fn events(&self) -> impl Iterator<Item = Event> {
        let mut levels = self.levels.iter().peekable();
        let mut writes = self.dac.iter().peekable();
        std::iter::from_fn(move || {
            let change_at = levels.peek().map_or(u64::MAX, |entry| entry.0);
            if let Some(write) = writes.next_if(|write| write.t_us < change_at) {
                return Some(Event::Dac(*write));
            }
            levels.next().map(|&(t_us, now)| Event::Levels(t_us, now))
        })
    }
}

/// Line change or DAC write, for [`Trace::events`].
pub(super) enum Event {
    Levels(u64, Levels),
    Dac(DacWrite),
}

/// Converter from the device's wrapping 32-bit microseconds to 64-bit ones.
///
/// The first time is kept as it is. Two successive times may be at most 2³¹ µs (35.8 min) apart; a
/// small step back gives a smaller time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unwrap {
    last: Option<u64>,
}

impl Unwrap {
    /// Returns `t_us` as an unwrapped 64-bit time, µs.
    pub fn unwrap_time(&mut self, t_us: u32) -> u64 {
        let unwrapped = match self.last {
            None => u64::from(t_us),
            Some(last) => {
                let step = t_us.wrapping_sub(last as u32) as i32;
                last.saturating_add_signed(i64::from(step))
            }
        };
        self.last = Some(unwrapped);
        unwrapped
    }
}

#[cfg(test)]
mod tests {
    use super::super::levels::State;
    use super::*;

    #[test]
    fn only_changes_are_kept() {
        let mut trace = Trace::default();
        let anodic = Levels::ISOLATED.with_channel(1, State::Anodic);
        trace.record_levels(0, Levels::ISOLATED);
        trace.record_levels(5, anodic);
        trace.record_levels(6, anodic);
        trace.record_levels(9, Levels::ISOLATED);
        assert_eq!(trace.levels, [(5, anodic), (9, Levels::ISOLATED)]);
    }

    #[test]
    fn two_ports_in_one_microsecond_are_one_change() {
        let mut trace = Trace::default();
        let anodic = Levels::ISOLATED.with_channel(0, State::Anodic);
        let pair = anodic.with_channel(7, State::Cathodic);
        trace.record_levels(5, anodic);
        trace.record_levels(5, pair);
        assert_eq!(trace.levels, [(5, pair)]);
        trace.record_levels(5, Levels::ISOLATED);
        assert_eq!(trace.levels, []);
    }

    #[test]
    fn pieces_taken_one_after_the_other_are_the_whole() {
        let anodic = Levels::ISOLATED.with_channel(1, State::Anodic);
        let pair = anodic.with_channel(7, State::Cathodic);
        let record = |trace: &mut Trace, from: u64, to: u64| {
            let steps = [
                (4, anodic, 3),
                (5, pair, 9),
                (8, Levels::ISOLATED, 9),
                (12, anodic, 2),
            ];
            for (t_us, levels, code) in steps.into_iter().filter(|s| (from..to).contains(&s.0)) {
                trace.record_dac(t_us - 1, 1, code);
                trace.record_levels(t_us, levels);
            }
        };
        let mut full_trace = Trace::default();
        record(&mut full_trace, 0, 20);
        for cut in 0..20 {
            let (mut trace, mut edges) = (Trace::default(), Vec::new());
            record(&mut trace, 0, cut);
            let mut first = trace.take(cut);
            record(&mut trace, cut, 20);
            edges.extend(first.edges().chain(trace.edges()));
            assert!(full_trace.edges().eq(edges), "{cut}");
            assert_eq!(trace.last_levels(), full_trace.last_levels());
            first.levels.extend(&trace.levels);
            first.dac.extend(&trace.dac);
            assert_eq!(first, full_trace, "{cut}");
        }
    }

    #[test]
    fn time_goes_on_through_the_wrap() {
        let mut time = Unwrap::default();
        assert_eq!(time.unwrap_time(u32::MAX - 1), u64::from(u32::MAX) - 1);
        assert_eq!(time.unwrap_time(3), (1 << 32) + 3);
        assert_eq!(time.unwrap_time(1), (1 << 32) + 1);
        assert_eq!(time.unwrap_time(1 << 31), (1 << 32) + (1 << 31));
        assert_eq!(time.unwrap_time(3 << 30), (1 << 32) + (3 << 30));
        assert_eq!(time.unwrap_time(7), (2 << 32) + 7);
    }
}
