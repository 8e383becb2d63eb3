//! Counts where the core's cycles go, by function, by owner and by exception, and how deep the
//! stack gets.
//!
//! In: the events that an [`Observer`] of the core receives. Out: counts that add up exactly to the
//! elapsed cycles; [`Summary`] puts them beside the counts of the core and the board. The program's
//! `profile` command prints the tables.

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

/// Part of the firmware that a cycle is charged to: the three owners of docs/how/architecture.md, and
/// the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Owner {
    /// The interrupts of the refill (TIM2), of over-current (EXTI9_5) and of the supply voltage
    /// (PVD).
    Pulser,
    /// The control tick, in TIM7's interrupt.
    Controller,
    /// Thread mode, and the interrupts of USB and of the async tasks' timer, TIM5.
    Session,
    /// Every other exception.
    Other,
}

impl Owner {
    /// All owners, in the order of the tables.
    pub const ALL: [Self; 4] = [Self::Pulser, Self::Controller, Self::Session, Self::Other];

    /// Returns the owner to which the cycles of exception `number` are charged; 0 is thread mode.
    pub const fn from_exception(number: u16) -> Self {
        match number {
            exception::PVD | exception::EXTI9_5 | exception::TIM2 => Self::Pulser,
            exception::TIM7 => Self::Controller,
            0 | exception::TIM5 | exception::OTG_FS => Self::Session,
            _ => Self::Other,
        }
    }

    /// Returns the owner's name in docs/how/architecture.md; "other" for [`Self::Other`].
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pulser => "Pulser",
            Self::Controller => "Controller",
            Self::Session => "Session",
            Self::Other => "other",
        }
    }
}

/// Exception numbers of the interrupts that the images use: the position in RM0090 table 61, plus
/// 16.
pub mod exception {
    /// PVD: the supply voltage fell below the detector's threshold.
    pub const PVD: u16 = 16 + 1;
    /// EXTI lines 5–9, of which one is the over-current latch.
    pub const EXTI9_5: u16 = 16 + 23;
    /// TIM2, the microsecond clock, which starts each refill of the pulse tape.
    pub const TIM2: u16 = 16 + 28;
    /// TIM5, the timer of the async tasks.
    pub const TIM5: u16 = 16 + 50;
    /// TIM7, the control tick.
    pub const TIM7: u16 = 16 + 55;
    /// USB controller OTG_FS.
    pub const OTG_FS: u16 = 16 + 67;

    /// Returns the name of exception `number`, for messages; 0 is thread mode.
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

/// Cycles and instructions charged to one function, exception or owner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Number of core cycles, without sleep.
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

/// Statistics of the runs of one exception's handler.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Runs {
    /// Number of runs that ended.
    pub count: u64,
    /// Longest run, cycles: with the entry to the handler, without the time of exceptions that
    /// pre-empted it.
    pub longest: Cycle,
}

/// Observer that charges every cycle of the core to a function and to an exception.
#[derive(Clone, Debug)]
pub struct Profile {
    functions: Functions,
    /// Cost by index into `functions`; exception entries, and code without a name, each have one
    /// index.
    costs: Vec<Cost>,
    /// Cost by exception number.
    contexts: [Cost; EXCEPTIONS],
    runs: [Runs; EXCEPTIONS],
    /// Active exceptions, the outermost first, each with the cycles charged to its present run.
    active: Vec<(u16, Cycle)>,
    /// Number of cycles in which the core slept.
    pub(crate) idle: Cycle,
    began: Cycle,
    /// Cycle up to which all cycles have been charged.
    last: Cycle,
    /// Lowest stack pointer after any instruction since power-on.
    pub(crate) lowest_sp: u32,
}

impl Profile {
    /// Creates a profile that counts from power-on, and charges cycles to the functions of `image`.
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

    /// Restarts the counts from now on. The stack depth since power-on and the active exceptions
    /// stay.
    pub fn restart(&mut self) {
        self.costs.fill(Cost::default());
        self.contexts = [Cost::default(); EXCEPTIONS];
        self.runs = [Runs::default(); EXCEPTIONS];
        self.idle = 0;
        self.began = self.last;
    }

    /// Returns the number of cycles since power-on or the last [`Self::restart`], with sleep.
    pub const fn total(&self) -> Cycle {
        self.last - self.began
    }

    /// Returns the cost by function, the most expensive first, without functions that never ran.
    pub fn functions(&self) -> Vec<(&str, Cost)> {
        let named = self.costs.iter().enumerate();
        let ran = named.filter(|(_, cost)| cost.cycles > 0);
        let mut rows: Vec<_> = ran
            .map(|(n, &cost)| (self.functions.name(n), cost))
            .collect();
        rows.sort_by_key(|&(name, cost)| (std::cmp::Reverse(cost.cycles), name));
        rows
    }

    /// Returns the summed cost of all exceptions that `owner` is charged for.
    pub fn owner(&self, owner: Owner) -> Cost {
        let mut sum = Cost::default();
        for (number, cost) in (0u16..).zip(&self.contexts) {
            if Owner::from_exception(number) == owner {
                sum.add(cost.cycles, cost.instructions);
            }
        }
        sum
    }

    /// Returns the statistics of each exception whose handler has run and ended, with the
    /// exception's number.
    pub fn runs(&self) -> impl Iterator<Item = (u16, Runs)> + '_ {
        (0..).zip(self.runs).filter(|(_, runs)| runs.count > 0)
    }

    #[inline]
    fn number(&self) -> u16 {
        self.active.last().map_or(0, |&(number, _)| number)
    }

    /// Charges the cycles up to `at` to `function` and to the active exception.
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
        // Cycles before the instruction began belong to no instruction.
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
