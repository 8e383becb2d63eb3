//! Points of a program: whether a channel can go from each to the next.

use firmware::safety::Stimulus;
use firmware::units::Amplitude;

use super::super::channel::Channel;
use super::rise::Rise;
use super::told::{seconds, tell_short};
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// A program's table and those of its points.
type Tables<'a, 't> = (&'a Table<'t>, &'a [&'a Table<'t>]);

/// Tells of steps that are shorter than a period.
pub(super) fn check_steps(
    (t, items): Tables<'_, '_>,
    found: &Channel,
    rise: &Rise,
    points: &[(u64, Stimulus)],
    every_us: Option<u64>,
) {
    let (channel, period_us) = (found.number, rise.period_us);
    let tell = |t: &Table<'_>, field: &str, before_us: u64| {
        let least = seconds(before_us + period_us);
        t.say(field, Problem::StepTooShort { channel, least });
    };
    for (pair, item) in points.windows(2).zip(items.iter().skip(1)) {
        if let [(before_us, _), (at_us, _)] = pair
            && at_us - before_us < period_us
        {
            tell(item, "at_s", *before_us);
        }
    }
    let last = points.last().map(|&(at_us, _)| at_us);
    if let Some((last_us, every_us)) = last.zip(every_us)
        && every_us < last_us + period_us
    {
        tell(t, "every_s", last_us);
    }
}

/// Tells of ways up that are shorter than the channel needs, and of silences before a rise
/// in which it may have no burst.
pub(super) fn check_ramp(
    (t, items): Tables<'_, '_>,
    found: &Channel,
    rise: &Rise,
    points: &[(u64, Stimulus)],
    every_us: Option<u64>,
) {
    let (Some(&first), Some(&last)) = (points.first(), points.last()) else {
        return; // there is one: checked
    };
    let all_at_once = points.iter().all(|&(_, it)| rise.is_at_once(it));
    let off = Stimulus {
        amplitude: Amplitude::ZERO,
        ..first.1
    };
    // A period more, for a rise begins with its first burst and ends with its point.
    let shortest = |from: Stimulus, to: Stimulus| match from.amplitude == Amplitude::ZERO {
        true if all_at_once => Some(0),
        true => {
            let whole = rise.shortest_us(from, to);
            whole.map(|us| if us > 0 { us + rise.period_us } else { us })
        }
        false => rise.shortest_us(from, to),
    };
    if let Some(item) = items.first() {
        let needed = shortest(off, first.1);
        if needed != Some(0) {
            tell_short(item, "value", found, (off, first.1), needed);
        } else if every_us.is_some() && shortest(last.1, first.1) != Some(0) {
            let needed = shortest(last.1, first.1);
            tell_short(t, "every_s", found, (last.1, first.1), needed);
        }
    }
    if every_us.is_some_and(|every_us| every_us < last.0) {
        t.not_after(
            "every_s",
            format!("the last point at {} s", seconds(last.0)),
        );
        return;
    }
    let mut silent_us = every_us.map_or(rise.period_us, |every_us| {
        silence(points) + every_us - last.0
    });
    for (nth, pair) in points.windows(2).enumerate() {
        let ([from, to], Some(item)) = (pair, items.get(nth + 1)) else {
            continue;
        };
        let (over_us, needed) = (to.0 - from.0, shortest(from.1, to.1));
        let is_silent = [from, to].map(|it| it.1.amplitude == Amplitude::ZERO);
        if needed.is_none_or(|needed| over_us < needed) {
            tell_short(item, "at_s", found, (from.1, to.1), needed);
        }
        if is_silent == [true, false] && silent_us < rise.period_us && !all_at_once {
            let (channel, least) = (found.number, seconds(rise.period_us));
            let (place, field) = match (nth, items.get(nth)) {
                (0, _) | (_, None) => (t, "every_s"),
                (_, Some(before)) => (*before, "at_s"),
            };
            place.say(field, Problem::SilenceTooShort { channel, least });
        }
        silent_us = match is_silent {
            [true, true] => silent_us + over_us,
            _ => 0,
        };
    }
}

/// How long the last points are 0, and stay so until the last, µs.
fn silence(points: &[(u64, Stimulus)]) -> u64 {
    let is_silent = |it: &&(u64, Stimulus)| it.1.amplitude == Amplitude::ZERO;
    let first = points.iter().rev().take_while(is_silent).last();
    first
        .zip(points.last())
        .map_or(0, |(from, to)| to.0 - from.0)
}
