//! What the profile, the core and the board counted, side by side.

use super::{Owner, Profile};
use crate::chip::Cycle;
use crate::chip::board::{Board, CYCLES_PER_US, Margins, Phases};
use crate::chip::cpu::system::Latency;

/// One exception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line {
    /// Exception number.
    pub number: u16,
    /// Handlers that ended.
    pub count: u64,
    /// Most cycles of one handler, entry included, pre-emption left out.
    pub longest: Cycle,
    /// Latency, from the rise of its line to its first instruction.
    pub latency: Latency,
}

/// The stack that grows down from the top of RAM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stack {
    /// Where it begins.
    pub top: u32,
    /// Lowest stack pointer since power-on.
    pub lowest: u32,
    /// First byte above the guard that denies access; none if none is set.
    pub limit: Option<u32>,
}

impl Stack {
    /// Bytes used at the deepest.
    pub const fn used(&self) -> u32 {
        self.top.saturating_sub(self.lowest)
    }

    /// Bytes left above the guard at the deepest.
    pub fn free(&self) -> Option<u32> {
        self.limit.map(|limit| self.lowest.saturating_sub(limit))
    }
}

/// Edges at one distance from their analytic cycle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phase {
    /// Cycles after TIM1's update for port B, 8 more for port C.
    pub late: i64,
    /// Edges of port B.
    pub b: u64,
    /// Edges of port C.
    pub c: u64,
}

impl Phase {
    /// What was `found`, earliest first, places without edges left out.
    pub fn from_phases(found: &Phases) -> Vec<Self> {
        let lap = CYCLES_PER_US as usize;
        // Half a microsecond early at most, less than that late.
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

    /// Cycles from the earliest of `from_phases` to the latest, both counted; 0 without
    /// edges.
    pub fn span(all: &[Self]) -> u64 {
        match (all.first(), all.last()) {
            (Some(first), Some(last)) => last.late.abs_diff(first.late) + 1,
            _ => 0,
        }
    }
}

/// All numbers of a profiled board.
#[derive(Clone, Debug)]
pub struct Summary {
    /// Cycles counted.
    pub total: Cycle,
    /// Cycles of them asleep.
    pub idle: Cycle,
    /// Instructions in them.
    pub instructions: u64,
    /// Exceptions, by number.
    pub lines: Vec<Line>,
    /// The stack.
    pub stack: Stack,
    /// How early the tape's windows were ready.
    pub margins: Margins,
    /// Pin edges, earliest first.
    pub phases: Vec<Phase>,
}

impl Summary {
    /// Of `board`, as it is now.
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

    /// Part of the time that the core was awake, %.
    pub fn load_percent(&self) -> f64 {
        100.0 * (self.total - self.idle) as f64 / self.total.max(1) as f64
    }

    /// Cycles from the earliest edge's place to the latest's, both counted; 0
    /// without edges.
    pub fn edge_span(&self) -> u64 {
        Phase::span(&self.phases)
    }

    /// Longest wait of any of these exceptions, cycles.
    pub fn worst_latency(&self) -> Cycle {
        let waits = self.lines.iter().map(|line| line.latency.worst);
        waits.max().unwrap_or(0)
    }
}
