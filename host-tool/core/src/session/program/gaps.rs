//! Checks of a program's points: whether a channel can go from each point to the next.

use firmware::safety::Stimulus;
use firmware::units::Amplitude;

use super::super::channel::Channel;
use super::rise::Rise;
use super::steps::Steps;
use super::told::{report_too_short, seconds};
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// The points of a program for one of its channels.
pub(super) struct Points<'a, 't> {
    /// Table of the program, for errors that concern no single point.
    pub(super) t: &'a Table<'t>,
    /// Tables of the points, in the order of `points`.
    pub(super) items: &'a [&'a Table<'t>],
    pub(super) found: &'a Channel,
    pub(super) rise: &'a Rise,
    /// Largest steps that the wearer allows; `None` if the wearer does not limit steps.
    pub(super) steps: Option<Steps>,
    /// Stimuli at times in µs after the beginning of a pass. There is at least one, and the first
    /// time is 0.
    pub(super) points: &'a [(u64, Stimulus)],
    /// Time from the beginning of one pass to the next, µs; `None` if the points are output once.
    pub(super) every_us: Option<u64>,
}

impl Points<'_, '_> {
    /// Reports points of a stepped program that follow each other within less than a period of the
    /// train, or whose step of amplitude is larger than the wearer allows.
    pub(super) fn check_steps(&self) {
        let (channel, period_us) = (self.found.number, self.rise.period_us);
        let tell = |t: &Table<'_>, field: &str, before_us: u64| {
            let least = seconds(before_us + period_us);
            t.report(field, Problem::StepTooShort { channel, least });
        };
        for (pair, item) in self.points.windows(2).zip(self.items.iter().skip(1)) {
            let [(before_us, from), (at_us, to)] = *pair else {
                continue;
            };
            if at_us - before_us < period_us {
                tell(item, "at_s", before_us);
            }
            if let Some(steps) = &self.steps {
                steps.check((item, "value"), self.found, from, to);
            }
        }
        let last = self.points.last().map(|&(at_us, _)| at_us);
        if let Some((last_us, every_us)) = last.zip(self.every_us)
            && every_us < last_us + period_us
        {
            tell(self.t, "every_s", last_us);
        }
    }

    /// Reports ramps that are shorter than the channel needs for their change. Reports also pauses
    /// at 0 before a rise that may be too short to contain a burst.
    pub(super) fn check_ramp(&self) {
        let Some(&(last_us, last)) = self.points.last() else {
            return; // there is one: checked
        };
        if self.every_us.is_some_and(|every_us| every_us < last_us) {
            let after = format!("the {} s of the last point", seconds(last_us));
            self.t.report_not_after("every_s", after);
            return;
        }
        self.check_begin(last);
        let mut silent_us = match self.every_us {
            Some(every_us) if last.amplitude == Amplitude::ZERO => {
                self.final_silence_us() + every_us - last_us
            }
            Some(_) => 0,
            None => u64::MAX,
        };
        for (nth, pair) in self.points.windows(2).enumerate() {
            let ([from, to], Some(item)) = (pair, self.items.get(nth + 1)) else {
                continue;
            };
            let over_us = to.0 - from.0;
            let needed = self.shortest_change_us(from.1, to.1);
            if needed.is_none_or(|needed| over_us < needed) {
                report_too_short(item, "at_s", self.found, (from.1, to.1), needed, from.0);
            }
            let is_silent = [from, to].map(|pair| pair.1.amplitude == Amplitude::ZERO);
            if is_silent == [true, false] {
                self.check_silence(nth, silent_us);
            }
            silent_us = match is_silent {
                [true, true] => silent_us.saturating_add(over_us),
                _ => 0,
            };
        }
    }

    /// Reports the first point if the channel cannot reach its amplitude at once, from 0 or, in a
    /// repeated program, from the last point.
    fn check_begin(&self, last: Stimulus) {
        let (Some(&(_, first)), Some(item)) = (self.points.first(), self.items.first()) else {
            return;
        };
        let off = Stimulus {
            amplitude: Amplitude::ZERO,
            ..first
        };
        let needed = self.shortest_change_us(off, first);
        if needed != Some(0) {
            report_too_short(item, "value", self.found, (off, first), needed, 0);
        } else if self.every_us.is_some() && self.shortest_change_us(last, first) != Some(0) {
            let needed = self.shortest_change_us(last, first);
            report_too_short(item, "value", self.found, (last, first), needed, 0);
        }
    }

    /// Returns the shortest time that the channel needs from one stimulus to another, µs, or `None`
    /// if no time is long enough. A rise from 0 takes one period more, because its first burst may
    /// come up to a period after the point.
    fn shortest_change_us(&self, from: Stimulus, to: Stimulus) -> Option<u64> {
        let rise = self.rise;
        let is_rise = from.amplitude == Amplitude::ZERO;
        let shortest_us = match is_rise {
            true if self.points.iter().all(|point| rise.is_immediate(point.1)) => 0,
            true => match rise.shortest_us(from, to)? {
                0 => 0,
                shortest_us => shortest_us + rise.period_us,
            },
            false => rise.shortest_us(from, to)?,
        };
        let steps = self.steps.as_ref();
        let by_steps = steps.map_or(0, |steps| steps.shortest_us(from, to));
        Some(shortest_us.max(by_steps))
    }

    /// Reports a pause at 0 of `silent_us`, before the rise that begins at point `nth`, if it is
    /// shorter than a period and so may contain no burst.
    fn check_silence(&self, nth: usize, silent_us: u64) {
        let period_us = self.rise.period_us;
        if silent_us >= period_us {
            return;
        }
        let (place, field) = match (nth, self.items.get(nth)) {
            (0, _) | (_, None) => (self.t, "every_s"),
            (_, Some(before)) => (*before, "at_s"),
        };
        let (channel, least) = (self.found.number, seconds(period_us));
        place.report(field, Problem::SilenceTooShort { channel, least });
    }

    /// Returns how long the points at the end of a pass are at 0, up to the time of the last point,
    /// µs.
    fn final_silence_us(&self) -> u64 {
        let is_silent = |pair: &&(u64, Stimulus)| pair.1.amplitude == Amplitude::ZERO;
        let first = self.points.iter().rev().take_while(is_silent).last();
        first
            .zip(self.points.last())
            .map_or(0, |(from, to)| to.0 - from.0)
    }
}
