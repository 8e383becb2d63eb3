//! A Cortex-M4F: ARMv7E-M Thumb-2, DSP and FPv4-SP, with its cycles.
//!
//! `decode` and `execute` are the instructions, `arithmetic` and `fpu` two
//! families of them, `access` and `bit_band` their way to memory, `timing` their cycles;
//! `exception` and `system` (NVIC, SCB, SysTick, MPU, DWT, FPU control) the
//! rest of the core. In: a `Bus`. Out: accesses in the order of their cycles.

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

/// The core: registers, private peripherals, and where it is in time. By
/// default it has power but was not reset yet.
#[derive(Clone, Debug, Default)]
pub struct Cpu {
    /// R0–R15, flags, masks, S0–S31.
    pub registers: Registers,
    /// Cycles gone since power-on, sleep included.
    pub cycle: Cycle,
    /// Instructions completed since power-on; one that fails its condition
    /// counts.
    pub instructions: u64,
    /// Private peripherals and the state of exceptions.
    pub system: system::System,
    decoded: decode::Cache,
    pipeline: timing::Pipeline,
    /// Cycle at which the loop must look up: an event, or something changed.
    deadline: Cycle,
    /// WFI or WFE waits.
    asleep: bool,
    /// Exception number that observers know of, unless one was entered since.
    context: u16,
    entered: bool,
    /// The exclusive monitor is set (LDREX).
    exclusive: bool,
    /// What an encoding does that the architecture leaves open.
    pub open: Open,
    /// It locked up, or a debugger holds it: time goes by without it.
    stands: bool,
}

/// What becomes of an UNPREDICTABLE encoding. No program has any: who breaks one on
/// purpose says what follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Open {
    /// The run ends.
    #[default]
    Stops,
    /// It is UNDEFINED, and locking up is no end of the run either: the core stands
    /// until a reset.
    Undefined,
    /// It does nothing; the core stands, likewise.
    Nothing,
}

impl Cpu {
    /// Whether both do the same from now on: registers, private peripherals and pipeline.
    /// What is decoded or counted for people is no state, nor what follows an encoding that
    /// no program has.
    #[must_use]
    pub fn is_equivalent_to(&self, other: &Self) -> bool {
        (self.cycle, self.asleep, self.exclusive, self.stands)
            == (other.cycle, other.asleep, other.exclusive, other.stands)
            && self.registers == other.registers
            && self.pipeline == other.pipeline
            && self.system.is_equivalent_to(&other.system)
    }
}
