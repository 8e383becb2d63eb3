//! Measures interrupt latency: from the cycle at which the line rose to the first instruction of
//! the handler.

use super::nvic::EXCEPTIONS;
use crate::chip::Cycle;

/// Latency statistics of one exception: from becoming pending to its handler's first instruction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Latency {
    /// Number of entries to the handler.
    pub count: u64,
    /// Longest latency, cycles. It counts from the cycle at which the exception was enabled if that
    /// came later.
    pub worst: Cycle,
    /// Cycle at which the handler with the longest latency began.
    pub worst_at: Cycle,
    /// Exception that ran before the handler with the longest latency, 0 for thread mode. Thread
    /// mode had interrupts masked if the latency is longer than an instruction and an entry.
    pub behind: u16,
}

/// Latency statistics of all exceptions since power-on.
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
    /// Records that the handler of exception `number`, which became pending at cycle `raised`,
    /// begins at `at`. Exception `behind`, 0 for thread mode, ran before.
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

    /// Returns exception number and latency statistics of each exception that was entered, in
    /// ascending order of numbers; interrupt line n is number 16 + n.
    pub fn entered(&self) -> impl Iterator<Item = (u16, Latency)> + '_ {
        (0..)
            .zip(self.table)
            .filter(|(_, latency)| latency.count != 0)
    }
}
