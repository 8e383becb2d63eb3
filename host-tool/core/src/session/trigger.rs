//! `[simulated_trigger]`: edges on a simulated trigger input. A board has a real input and ignores
//! them.

use super::channel::Channel;
use super::channels::Channels;
use super::fields::{TRIGGER_FIRST_US, TRIGGER_LEAST_US};
use crate::fields::error::Problem;
use crate::fields::table::Table;
use firmware::pulse::Trigger;

/// Signal on the trigger input of a simulated device.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SimulatedTrigger {
    /// Times at which the input becomes active.
    pub edges: Edges,
    /// Time for which the input stays active after each edge, µs; 0 is a short pulse. The input is
    /// released at least 1 ms before the next edge.
    pub held_us: u64,
}

/// Times of the edges at which a simulated trigger input becomes active, µs from the start.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Edges {
    /// Edges at these times, µs from the start, in rising order.
    At(Vec<u64>),
    /// Edges at a fixed period until the session ends.
    Every {
        /// Time of the first edge, µs from the start.
        from_us: u64,
        /// Time from one edge to the next, µs; at least 1 ms.
        period_us: u64,
    },
}

impl Edges {
    /// Returns the times of the edges from `from_us` up to, but not including, `to_us`.
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

    /// Returns the shortest time from one edge to the next, µs; `None` if there are fewer than two
    /// edges.
    fn shortest_interval_us(&self) -> Option<u64> {
        match self {
            Self::At(times) => times.windows(2).map(|pair| pair[1] - pair[0]).min(),
            Self::Every { period_us, .. } => Some(*period_us),
        }
    }
}

/// Reads `[simulated_trigger]`. Reports a trigger although no train waits for it, and a `held_s`
/// that is too long, or missing although a train is gated.
pub(super) fn read_trigger(
    t: &Table<'_>,
    channels: &Channels,
    duration_us: u64,
) -> Option<SimulatedTrigger> {
    if channels.all_valid() && !channels.list.iter().any(|c| c.spec.train.trigger.is_some()) {
        t.report("", Problem::NothingTriggered {});
        return None;
    }
    if !t.is_valid() {
        return None;
    }
    let edges = read_edges(t, duration_us)?;
    let held_us = match t.has("held_s") {
        true => t.time("held_s", TRIGGER_LEAST_US, duration_us)?,
        false => 0,
    };
    let is_gated = |c: &Channel| c.spec.train.trigger == Some(Trigger::Gated);
    if let (0, Some(gated)) = (held_us, channels.list.iter().find(|c| is_gated(c))) {
        let channel = gated.number;
        t.report("", Problem::NeverHeld { channel });
        return None;
    }
    let most_us = edges
        .shortest_interval_us()
        .map(|us| us - TRIGGER_LEAST_US as u64); // 1 ms at least
    if let Some(most_us) = most_us.filter(|most_us| held_us > *most_us) {
        let most_s = (most_us as f64 / 1e6).to_string();
        t.report("held_s", Problem::HeldTooLong { most_s });
        return None;
    }
    Some(SimulatedTrigger { edges, held_us })
}

fn read_edges(t: &Table<'_>, duration_us: u64) -> Option<Edges> {
    if !t.has("at_s") {
        let period_us = t.time("every_s", TRIGGER_LEAST_US, duration_us)?;
        let from_us = match t.has("from_s") {
            true => t.time("from_s", TRIGGER_FIRST_US, duration_us)?,
            false => period_us.max(TRIGGER_FIRST_US as u64), // 10 ms
        };
        return Some(Edges::Every { from_us, period_us });
    }
    let apart = TRIGGER_LEAST_US as u64; // 1 ms
    let times = t.times("at_s", TRIGGER_FIRST_US, apart, duration_us)?;
    Some(Edges::At(times))
}

#[cfg(test)]
mod tests {
    use super::Edges;

    #[test]
    fn edges_between_two_times_are_each_given_once() {
        let every = Edges::Every {
            from_us: 500,
            period_us: 2_000,
        };
        let listed = Edges::At(vec![500, 2_500, 4_500, 6_500]);
        for trigger in [every, listed] {
            assert_eq!(trigger.between(0, 500), [0u64; 0]);
            assert_eq!(trigger.between(0, 501), [500]);
            assert_eq!(trigger.between(500, 4_500), [500, 2_500]);
            let pieces = (0..8).flat_map(|n| trigger.between(n * 1_000, (n + 1) * 1_000));
            assert_eq!(pieces.collect::<Vec<_>>(), [500, 2_500, 4_500, 6_500]);
        }
    }
}
