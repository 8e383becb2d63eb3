//! Summarises the counts of the profile, the core and the board side by side.

use super::{Owner, Profile};
use crate::chip::Cycle;
use crate::chip::board::{Board, CYCLES_PER_US, Margins, Phases};
use crate::chip::cpu::system::Latency;

/// Counts of one exception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line {
    /// Exception number, 16 more than that of the interrupt.
    pub number: u16,
    /// Number of handler runs that ended.
    pub count: u64,
    /// Longest handler run, cycles; includes entry, excludes pre-emption.
    pub longest: Cycle,
    /// Latency, from the rise of the interrupt line to the first instruction.
    pub latency: Latency,
}

/// Use of the stack, which grows down from the top of RAM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stack {
    /// Address where the stack begins.
    pub top: u32,
    /// Lowest stack pointer since power-on.
    pub lowest: u32,
    /// First byte above the guard region that denies access; `None` if there is no guard.
    pub limit: Option<u32>,
}

impl Stack {
    /// Returns the largest number of bytes used.
    pub const fn used(&self) -> u32 {
        self.top.saturating_sub(self.lowest)
    }

    /// Returns the smallest number of bytes that were free above the guard.
    pub fn free(&self) -> Option<u32> {
        self.limit.map(|limit| self.lowest.saturating_sub(limit))
    }
}

/// Number of edges at one distance from their analytic cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phase {
    /// Cycles after the analytic cycle: TIM1's update for port B, 8 cycles more for port C.
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
        let all = places.map(|late| {
            let at = late.rem_euclid(CYCLES_PER_US.cast_signed()) as usize;
            Self {
                late,
                b: found.b[at],
                c: found.c[(at + 8) % lap],
            }
        });
        all.filter(|phase| phase.b + phase.c > 0).collect()
    }

    /// Returns the cycles from the earliest to the latest phase, both included; 0 without edges.
    pub fn span(all: &[Self]) -> u64 {
        match (all.first(), all.last()) {
            (Some(first), Some(last)) => last.late.abs_diff(first.late) + 1,
            _ => 0,
        }
    }
}

/// All counts of a profiled board.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Number of cycles counted.
    pub total: Cycle,
    /// Cycles asleep, out of `total`.
    pub idle: Cycle,
    /// Instructions completed in `total`.
    pub instructions: u64,
    /// Counts by exception, in the order of their numbers.
    pub lines: Vec<Line>,
    /// Depth of the stack since power-on.
    pub stack: Stack,
    /// Refill margins of the tape's windows.
    pub margins: Margins,
    /// Pin edges by distance from their analytic cycle, earliest first.
    pub phases: Vec<Phase>,
}

impl Summary {
    /// Summarises the present counts of `board`.
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

    /// Returns the share of time that the core was awake, %.
    pub fn load_percent(&self) -> f64 {
        100.0 * (self.total - self.idle) as f64 / self.total.max(1) as f64
    }

    /// Returns the cycles from the earliest to the latest edge phase, both included; 0 without
    /// edges.
    pub fn edge_span(&self) -> u64 {
        Phase::span(&self.phases)
    }

    /// Returns the longest latency of any exception, cycles.
    pub fn worst_latency(&self) -> Cycle {
        let waits = self.lines.iter().map(|line| line.latency.worst);
        waits.max().unwrap_or(0)
    }
}
