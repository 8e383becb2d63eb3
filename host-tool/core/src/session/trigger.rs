//! `[simulated_trigger]`: edges that a simulated trigger input sees. A board has a
//! real one and ignores them.

use super::channels::Channels;
use super::fields::{TRIGGER_FIRST_US, TRIGGER_LEAST_US};
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// When edges come on a simulated trigger input, µs from the start.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum SimulatedTrigger {
    /// At these times, rising.
    At(Vec<u64>),
    /// Again and again.
    Every {
        /// The first edge.
        from_us: u64,
        /// From edge to edge, 1 ms at least.
        period_us: u64,
    },
}

impl SimulatedTrigger {
    /// The edges of `from_us..to_us`.
    #[must_use]
    pub fn between(&self, from_us: u64, to_us: u64) -> Vec<u64> {
        match self {
            Self::At(times) => {
                let due = times.iter().filter(|&&at| from_us <= at && at < to_us);
                due.copied().collect()
            }
            Self::Every {
                from_us: first,
                period_us,
            } => {
                let past = from_us.saturating_sub(*first).div_ceil(*period_us);
                let mut at = first + past * period_us;
                let mut due = Vec::new();
                while at < to_us {
                    due.push(at);
                    at += period_us;
                }
                due
            }
        }
    }
}

/// Reads `[simulated_trigger]`.
pub(super) fn read_trigger(
    t: &Table<'_>,
    channels: &Channels,
    duration_us: u64,
) -> Option<SimulatedTrigger> {
    if channels.are_whole() && !channels.list.iter().any(|c| c.spec.train.trigger.is_some()) {
        t.say("", Problem::NothingTriggered {});
        return None;
    }
    if !t.is_sound() {
        return None;
    }
    if !t.has("at_s") {
        let period_us = t.time("every_s", TRIGGER_LEAST_US, duration_us)?;
        let from_us = match t.has("from_s") {
            true => t.time("from_s", TRIGGER_FIRST_US, duration_us)?,
            false => period_us.max(TRIGGER_FIRST_US as u64), // 10 ms
        };
        return Some(SimulatedTrigger::Every { from_us, period_us });
    }
    let apart = TRIGGER_LEAST_US as u64; // 1 ms
    let times = t.times("at_s", TRIGGER_FIRST_US, apart, duration_us)?;
    Some(SimulatedTrigger::At(times))
}

#[cfg(test)]
mod tests {
    use super::SimulatedTrigger;

    #[test]
    fn edges_between_two_times_are_each_given_once() {
        let every = SimulatedTrigger::Every {
            from_us: 500,
            period_us: 2_000,
        };
        let listed = SimulatedTrigger::At(vec![500, 2_500, 4_500, 6_500]);
        for trigger in [every, listed] {
            assert_eq!(trigger.between(0, 500), [0u64; 0]);
            assert_eq!(trigger.between(0, 501), [500]);
            assert_eq!(trigger.between(500, 4_500), [500, 2_500]);
            let pieces = (0..8).flat_map(|n| trigger.between(n * 1_000, (n + 1) * 1_000));
            assert_eq!(pieces.collect::<Vec<_>>(), [500, 2_500, 4_500, 6_500]);
        }
    }
}
