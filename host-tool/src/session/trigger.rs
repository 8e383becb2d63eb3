//! `[simulated_trigger]`: edges that a simulated trigger input sees. A board has a
//! real one and ignores them.

use super::channel::Channel;
use super::error::{Problem, SessionError};
use super::table::Table;

/// Edges are at least this far apart, µs: a train starts 1000 µs after its edge.
const LEAST_US: u64 = 1_000;

/// No edge comes sooner after the start, µs: until its acknowledgement is here,
/// nobody knows when that was.
const FIRST_US: i64 = 10_000;

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
    root: &Table<'_>,
    channels: &[Channel],
    duration_us: u64,
) -> Result<Option<SimulatedTrigger>, SessionError> {
    const NAME: &str = "simulated_trigger";
    let Some(t) = root.table(NAME)?.optional() else {
        return Ok(None);
    };
    t.only(&["at_s", "every_s", "from_s"])?;
    if !channels.iter().any(|c| c.spec.train.triggered) {
        return Err(root.error(NAME, Problem::NothingTriggered));
    }
    let end = duration_us as i64; // at most a day
    if !t.has("at_s") {
        let period = t.within("every_s", 6, LEAST_US as i64, end)?;
        let period_us = period.required()? as u64; // not negative
        let from = t.within("from_s", 6, FIRST_US, end)?;
        let from_us = from.or(FIRST_US.max(period_us as i64)) as u64;
        return Ok(Some(SimulatedTrigger::Every { from_us, period_us }));
    }
    if let Some(other) = ["every_s", "from_s"].into_iter().find(|name| t.has(name)) {
        let (field, other) = (t.path_of("at_s"), t.path_of(other));
        return Err(t.error("at_s", Problem::SaidTwice { field, other }));
    }
    let times = t.list_within("at_s", 6, FIRST_US, end)?.required()?;
    let times: Vec<u64> = times.into_iter().map(|at| at as u64).collect(); // not negative
    if let Some(pair) = times.windows(2).find(|p| p[1] < p[0] + LEAST_US) {
        let problem = Problem::NotInOrder {
            field: t.path_of("at_s"),
            given: format!("{} s", pair[1] as f64 * 1e-6),
            after: format!("{} s, by at least 0.001 s", pair[0] as f64 * 1e-6),
        };
        return Err(t.error("at_s", problem));
    }
    Ok(Some(SimulatedTrigger::At(times)))
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
