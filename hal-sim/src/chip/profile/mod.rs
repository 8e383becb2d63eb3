//! Where the core's cycles go: per function, per owner, per exception; how
//! deep its stack gets.
//!
//! In: what an [`Observer`] of the core sees. Out: counts that add up to the
//! cycles gone, to the last one; [`Summary`] puts them beside what the core
//! and the board counted themselves. Not here: tables for people (the
//! program's `profile` command).

mod functions;
mod summary;
#[cfg(test)]
mod tests;

pub use summary::{Line, Phase, Stack, Summary};

use super::Cycle;
use super::cpu::run::{Context, Observer};
use super::cpu::system::nvic::EXCEPTIONS;
use super::image::Image;
use functions::Functions;

/// Who a cycle was spent for: the three owners of docs/architecture.md.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The refill (TIM2), over-current (EXTI9_5) and supply (PVD).
    Pulser,
    /// The control tick, in TIM7's interrupt.
    Controller,
    /// Thread mode, USB and the async timer TIM5.
    Session,
    /// Any other exception.
    Other,
}

impl Owner {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Pulser, Self::Controller, Self::Session, Self::Other];

    /// Whose exception `number` is; 0 is thread mode.
    pub const fn from_exception(number: u16) -> Self {
        match number {
            exception::PVD | exception::EXTI9_5 | exception::TIM2 => Self::Pulser,
            exception::TIM7 => Self::Controller,
            0 | exception::TIM5 | exception::OTG_FS => Self::Session,
            _ => Self::Other,
        }
    }

    /// As the documentation calls it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pulser => "Pulser",
            Self::Controller => "Controller",
            Self::Session => "Session",
            Self::Other => "other",
        }
    }
}

/// Exception numbers of the lines that the images use: 16 more than the
/// position in RM0090 table 61.
pub mod exception {
    /// Supply.
    pub const PVD: u16 = 16 + 1;
    /// EXTI lines 5–9.
    pub const EXTI9_5: u16 = 16 + 23;
    /// Microsecond clock.
    pub const TIM2: u16 = 16 + 28;
    /// Async timer.
    pub const TIM5: u16 = 16 + 50;
    /// Control tick.
    pub const TIM7: u16 = 16 + 55;
    /// USB.
    pub const OTG_FS: u16 = 16 + 67;

    /// What `number` is called, 0 for thread mode.
    pub fn name(number: u16) -> String {
        match number {
            0 => "thread".into(),
            2 => "NMI".into(),
            3 => "HardFault".into(),
            PVD => "PVD".into(),
            EXTI9_5 => "EXTI9_5".into(),
            TIM2 => "TIM2".into(),
            TIM5 => "TIM5".into(),
            TIM7 => "TIM7".into(),
            OTG_FS => "OTG_FS".into(),
            16.. => format!("line {}", number - 16),
            _ => format!("exception {number}"),
        }
    }
}

/// Cycles and instructions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Core cycles.
    pub cycles: Cycle,
    /// Instructions completed.
    pub instructions: u64,
}

impl Cost {
    fn add(&mut self, cycles: Cycle, instructions: u64) {
        self.cycles += cycles;
        self.instructions += instructions;
    }
}

/// Runs of one exception's handler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Runs {
    /// How many ended.
    pub count: u64,
    /// Most cycles of one, entry included, what pre-empted it left out.
    pub longest: Cycle,
}

/// Counts while the core runs.
#[derive(Clone, Debug)]
pub struct Profile {
    functions: Functions,
    /// By index into `functions`; entries of exceptions and code without a
    /// name have one each.
    costs: Vec<Cost>,
    /// By exception number.
    contexts: [Cost; EXCEPTIONS],
    runs: [Runs; EXCEPTIONS],
    /// What is active, outermost first, and its cycles so far.
    active: Vec<(u16, Cycle)>,
    /// Cycles asleep.
    pub(crate) idle: Cycle,
    began: Cycle,
    /// All before is counted.
    last: Cycle,
    /// Lowest stack pointer after any instruction since power-on.
    pub(crate) lowest_sp: u32,
}

impl Profile {
    /// Counts from power-on, by the functions of `image`.
    pub fn new(image: &Image) -> Self {
        let functions = Functions::from_image(image);
        Self {
            costs: vec![Cost::default(); functions.len()],
            functions,
            contexts: [Cost::default(); EXCEPTIONS],
            runs: [Runs::default(); EXCEPTIONS],
            active: Vec::new(),
            idle: 0,
            began: 0,
            last: 0,
            lowest_sp: image.initial_sp,
        }
    }

    /// Counts anew from now on; the stack's depth since power-on stays, and so
    /// does what is active.
    pub fn restart(&mut self) {
        self.costs.fill(Cost::default());
        self.contexts = [Cost::default(); EXCEPTIONS];
        self.runs = [Runs::default(); EXCEPTIONS];
        self.idle = 0;
        self.began = self.last;
    }

    /// Cycles counted.
    pub const fn total(&self) -> Cycle {
        self.last - self.began
    }

    /// Cost by function, dearest first; those that never ran are left out.
    pub fn functions(&self) -> Vec<(&str, Cost)> {
        let named = self.costs.iter().enumerate();
        let ran = named.filter(|(_, cost)| cost.cycles > 0);
        let mut all: Vec<_> = ran
            .map(|(n, &cost)| (self.functions.name(n), cost))
            .collect();
        all.sort_by_key(|&(name, cost)| (std::cmp::Reverse(cost.cycles), name));
        all
    }

    /// Cost of an owner.
    pub fn owner(&self, owner: Owner) -> Cost {
        let mut sum = Cost::default();
        for (number, cost) in (0u16..).zip(&self.contexts) {
            if Owner::from_exception(number) == owner {
                sum.add(cost.cycles, cost.instructions);
            }
        }
        sum
    }

    /// Runs by exception number, those that occurred.
    pub fn runs(&self) -> impl Iterator<Item = (u16, Runs)> + '_ {
        (0..).zip(self.runs).filter(|(_, runs)| runs.count > 0)
    }

    #[inline]
    fn number(&self) -> u16 {
        self.active.last().map_or(0, |&(number, _)| number)
    }

    /// Counts the cycles up to `at` for what runs, as `function`.
    #[inline]
    fn spend(&mut self, function: usize, at: Cycle, instructions: u64) {
        let cycles = at - self.last;
        self.last = at;
        self.costs[function].add(cycles, instructions);
        self.contexts[usize::from(self.number())].add(cycles, instructions);
        if let Some((_, own)) = self.active.last_mut() {
            *own += cycles;
        }
    }

    fn leave(&mut self) {
        if let Some((number, own)) = self.active.pop() {
            let runs = &mut self.runs[usize::from(number)];
            runs.count += 1;
            runs.longest = runs.longest.max(own);
        }
    }
}

impl Observer for Profile {
    #[inline]
    fn instruction(&mut self, pc: u32, cycles: Cycle, at: Cycle, sp: u32) {
        // What passed before it began is no instruction's.
        let start = at - cycles;
        if start > self.last {
            self.spend(Functions::ENTRY, start, 0);
        }
        let function = self.functions.index_at(pc);
        self.spend(function, at, 1);
        self.lowest_sp = self.lowest_sp.min(sp);
    }

    fn context(&mut self, context: Context, at: Cycle) {
        let kept = context.depth as usize - usize::from(context.entered);
        while self.active.len() > kept {
            self.leave();
        }
        if context.entered {
            self.active.push((context.number, 0));
        }
        self.spend(Functions::ENTRY, at, 0);
    }

    fn asleep(&mut self, _from: Cycle, to: Cycle) {
        self.idle += to - self.last;
        self.last = to;
    }
}
