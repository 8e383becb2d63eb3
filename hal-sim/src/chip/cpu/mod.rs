//! Simulates a Cortex-M4F: ARMv7E-M Thumb-2, DSP and FPv4-SP, with its cycles.
//!
//! `decode` and `execute` handle instructions, `arithmetic` and `fpu` two families of them,
//! `access` and `bit_band` their access to memory, `timing` their cycles; `exception` and `system`
//! (NVIC, SCB, SysTick, MPU, DWT, FPU control) are the rest of the core. In: a `Bus`. Out: accesses
//! in the order of their cycles.

mod access;
pub(crate) mod arithmetic;
pub mod bit_band;
pub mod bus;
mod decode;
mod exception;
mod execute;
pub mod flat;
pub(crate) mod fpu;
mod instruction;
pub mod registers;
pub mod run;
pub mod semihosting;
pub mod stop;
pub mod system;
pub mod timing;

#[cfg(feature = "gdb")]
pub(in crate::chip) use access::is_private;
pub use bus::{Bus, Size};
pub use registers::Registers;
pub use run::Observer;
pub use stop::{Access, Fault, Stop, Trap, TrapResult};

use super::Cycle;

/// The Cortex-M4 core: registers, private peripherals, and the present cycle. The default is a core
/// that has power but was not reset yet.
#[derive(Clone, Debug, Default)]
pub struct Cpu {
    /// Core registers R0–R15, flags, masks, S0–S31.
    pub registers: Registers,
    /// Cycles since power-on, including sleep.
    pub cycle: Cycle,
    /// Instructions completed since power-on, including those whose condition failed.
    pub instructions: u64,
    /// Private peripherals and the state of exceptions.
    pub system: system::System,
    decoded: decode::Cache,
    pipeline: timing::Pipeline,
    /// Cycle at which the loop that executes instructions must check for events or changes.
    deadline: Cycle,
    /// Whether the core waits in WFI or WFE.
    asleep: bool,
    /// Exception number in the context last reported to observers; 0 is thread mode.
    context: u16,
    /// Whether an exception was entered since that report.
    entered: bool,
    /// Whether the exclusive monitor is set (LDREX).
    exclusive: bool,
    /// Behaviour for encodings that the architecture leaves UNPREDICTABLE.
    pub open: Open,
    /// Whether the core stands still because it locked up or a debugger halts it; time passes
    /// meanwhile.
    stands: bool,
}

/// Behaviour for an UNPREDICTABLE encoding. No correct program contains one; a test that corrupts a
/// program chooses the behaviour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Open {
    /// The run ends.
    #[default]
    Stops,
    /// The encoding causes a fault as if it were UNDEFINED. A lock-up does not end the run either:
    /// the core stands still until a reset.
    Undefined,
    /// The encoding does nothing. A lock-up does not end the run: the core stands still until a
    /// reset.
    Nothing,
}

impl Cpu {
    /// Returns whether both cores behave the same from now on: registers, private peripherals and
    /// pipeline are equal. Decoded code, statistics and `open` do not count.
    #[must_use]
    pub fn is_equivalent_to(&self, other: &Self) -> bool {
        (self.cycle, self.asleep, self.exclusive, self.stands)
            == (other.cycle, other.asleep, other.exclusive, other.stands)
            && self.registers == other.registers
            && self.pipeline == other.pipeline
            && self.system.is_equivalent_to(&other.system)
    }
}
