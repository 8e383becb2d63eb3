//! How long interrupts wait: from the cycle at which their line rose to the
//! first instruction of their handler.

use super::nvic::EXCEPTIONS;
use crate::chip::Cycle;

/// Latencies of one exception.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latency {
    /// How often its handler was entered.
    pub count: u64,
    /// Longest wait, cycles; from where it was enabled if that came later.
    pub worst: Cycle,
    /// Cycle at which the handler began that waited longest.
    pub worst_at: Cycle,
    /// Exception that ran when the longest wait began to end: what the handler
    /// waited for, 0 for thread mode (which had interrupts masked if the wait
    /// is longer than an instruction and an entry).
    pub behind: u16,
}

/// Latencies of all exceptions.
#[derive(Clone, Debug)]
pub struct Latencies {
    table: [Latency; EXCEPTIONS],
}

impl Default for Latencies {
    fn default() -> Self {
        Self {
            table: [Latency::default(); EXCEPTIONS],
        }
    }
}

impl Latencies {
    /// The handler of `number`, raised at `raised`, begins at `at`; `behind`
    /// ran before.
    pub fn record(&mut self, number: u16, raised: Cycle, at: Cycle, behind: u16) {
        let Some(latency) = self.table.get_mut(usize::from(number)) else {
            return;
        };
        latency.count += 1;
        let wait = at.saturating_sub(raised);
        if wait > latency.worst {
            latency.worst = wait;
            latency.worst_at = at;
            latency.behind = behind;
        }
    }

    /// Those entered at least once: (exception number, latency), ascending;
    /// line n is number 16 + n.
    pub fn entered(&self) -> impl Iterator<Item = (u16, Latency)> + '_ {
        (0..)
            .zip(self.table)
            .filter(|(_, latency)| latency.count != 0)
    }
}
