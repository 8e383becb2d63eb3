//! Summarises the counts of the profile, the core and the board side by side.

use super::{Owner, Profile};
use crate::chip::Cycle;
use crate::chip::board::{Board, CYCLES_PER_US, Margins, Phases};
use crate::chip::cpu::system::Latency;

/// Statistics of one exception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line {
    /// Exception number, 16 more than that of the interrupt.
    pub number: u16,
    /// Number of handler runs that ended.
    pub count: u64,
    /// Longest handler run, cycles: with the entry to the handler, without the time of exceptions
    /// that pre-empted it.
    pub longest: Cycle,
    /// Statistics of the latency, from the rise of the interrupt line to the handler's first
    /// instruction.
    pub latency: Latency,
}

/// Use of the stack, which grows down from the top of RAM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stack {
    /// Address at which the stack begins: the initial stack pointer.
    pub top: u32,
    /// Lowest stack pointer since power-on.
    pub lowest: u32,
    /// First byte above the guard region that denies access; `None` if there is no guard.
    pub limit: Option<u32>,
}

impl Stack {
    /// Returns the largest number of bytes of stack that were in use since power-on.
    pub const fn used(&self) -> u32 {
        self.top.saturating_sub(self.lowest)
    }

    /// Returns the smallest number of bytes that were free above the guard region; `None` if there
    /// is no guard.
    pub fn free(&self) -> Option<u32> {
        self.limit.map(|limit| self.lowest.saturating_sub(limit))
    }
}

/// Number of pin edges at one distance from the cycle at which they should ideally come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phase {
    /// Distance from the ideal cycle, cycles; negative if early. The ideal cycle is TIM1's update
    /// for port B, and 8 cycles later for port C.
    pub late: i64,
    /// Number of edges of port B.
    pub b: u64,
    /// Number of edges of port C.
    pub c: u64,
}

impl Phase {
    /// Lists the phases of `found` that have edges, earliest first.
    pub fn from_phases(found: &Phases) -> Vec<Self> {
        let lap = CYCLES_PER_US as usize;
        // A distance is at most half a microsecond early, and less than that late.
        let places =
            (0..CYCLES_PER_US).map(|n| n.cast_signed() - (CYCLES_PER_US / 2).cast_signed());
        let phases = places.map(|late| {
            let at = late.rem_euclid(CYCLES_PER_US.cast_signed()) as usize;
            Self {
                late,
                b: found.b[at],
                c: found.c[(at + 8) % lap],
            }
        });
        phases.filter(|phase| phase.b + phase.c > 0).collect()
    }

    /// Returns the number of cycles from the earliest to the latest distance in `phases`, both
    /// included; 0 without edges.
    pub fn span(phases: &[Self]) -> u64 {
        match (phases.first(), phases.last()) {
            (Some(first), Some(last)) => last.late.abs_diff(first.late) + 1,
            _ => 0,
        }
    }
}

/// Statistics of a profiled board.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Number of cycles that the statistics cover, with sleep.
    pub total: Cycle,
    /// Number of cycles out of `total` in which the core slept.
    pub idle: Cycle,
    /// Instructions completed in `total`.
    pub instructions: u64,
    /// Statistics of each exception whose handler has run, by rising exception number.
    pub lines: Vec<Line>,
    /// Depth of the stack since power-on.
    pub stack: Stack,
    /// Refill margins: how long before its deadline each window of the pulse tape was complete.
    pub margins: Margins,
    /// Numbers of pin edges by the distance from their ideal cycle, earliest first.
    pub phases: Vec<Phase>,
}

impl Summary {
    /// Summarises the statistics of `board` up to now.
    pub fn from_board(board: &mut Board<Profile>) -> Self {
        let limit = board
            .cpu
            .system
            .denied_range()
            .map(|guard| guard.end as u32);
        let profile = &board.observer;
        let owners = Owner::ALL.map(|owner| profile.owner(owner));
        let latencies: Vec<_> = board.cpu.system.latencies.entered().collect();
        let latency = |number| {
            let found = latencies.iter().find(|(n, _)| *n == number);
            found.map_or_else(Latency::default, |&(_, latency)| latency)
        };
        Self {
            total: profile.total(),
            idle: profile.idle,
            instructions: owners.iter().map(|cost| cost.instructions).sum(),
            lines: profile
                .runs()
                .map(|(number, runs)| Line {
                    number,
                    count: runs.count,
                    longest: runs.longest,
                    latency: latency(number),
                })
                .collect(),
            stack: Stack {
                top: board.image().initial_sp,
                lowest: profile.lowest_sp,
                limit,
            },
            margins: board.around.margins,
            phases: Phase::from_phases(board.around.phases()),
        }
    }

    /// Returns the share of the cycles in which the core was awake, 0–100 %.
    pub fn load_percent(&self) -> f64 {
        100.0 * (self.total - self.idle) as f64 / self.total.max(1) as f64
    }

    /// Returns the number of cycles from the earliest to the latest edge, relative to their ideal
    /// cycles, both included; 0 without edges. An ideal tape gives 1.
    pub fn edge_span(&self) -> u64 {
        Phase::span(&self.phases)
    }

    /// Returns the longest latency of any exception, cycles.
    pub fn worst_latency(&self) -> Cycle {
        let waits = self.lines.iter().map(|line| line.latency.worst);
        waits.max().unwrap_or(0)
    }
}
