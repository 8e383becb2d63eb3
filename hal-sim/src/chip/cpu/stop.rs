//! Defines the reasons why an instruction, or the whole run, did not continue.

use super::bus::{AccessError, Size, Unmodelled};
use super::system::WatchpointHit;
use crate::chip::names;
use std::fmt;

/// A synchronous fault of an instruction, taken as an exception (Arm ARM B1.5.14, B3.2.15). The
/// return address is that of the faulting instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An instruction that the architecture defines as UNDEFINED (UDF).
    Undefined,
    /// Branch to ARM state (EPSR.T would be 0).
    InvalidState,
    /// Illegal EXC_RETURN value, or a return whose frame does not match it.
    InvalidPc,
    /// Floating-point instruction while CPACR denies it, or an instruction for a coprocessor that
    /// the core lacks.
    NoCoprocessor,
    /// Unaligned access that the instruction or CCR does not allow.
    Unaligned,
    /// Division by zero with CCR.DIV_0_TRP.
    DivideByZero,
    /// Precise data bus error, at this address.
    DataBus(u32),
    /// Bus error of an instruction fetch.
    InstructionBus,
    /// The MPU denies a data access at this address.
    DataAccess(u32),
    /// The MPU, or execute-never memory, denies the fetch.
    InstructionAccess,
    /// Bus error while stacking for an exception.
    StackingBus,
    /// MPU violation while stacking for an exception.
    StackingAccess,
    /// Bus error while unstacking at the return from an exception.
    UnstackingBus,
    /// MPU violation while unstacking at the return from an exception.
    UnstackingAccess,
    /// MPU violation during lazy stacking (MLSPERR).
    LazyStackingAccess,
    /// Bus error during lazy stacking (LSPERR).
    LazyStackingBus,
    /// BKPT without a debugger and without semihosting: escalates to a hard fault.
    Breakpoint,
}

/// A data access, as the core requested it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Address of the first byte.
    pub address: u32,
    /// Width of the access.
    pub size: Size,
    /// Value to write; `None` for a read.
    pub written: Option<u32>,
}

impl fmt::Display for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(register) = names::register(self.address) {
            write!(f, "{register}, ")?;
        }
        write!(f, "{:#010x}, ", self.address)?;
        let (width, digits, mask) = match self.size {
            Size::Byte => ("a byte ", 4, 0xFF),
            Size::Half => ("a half-word ", 6, 0xFFFF),
            Size::Word => ("", 10, u32::MAX),
        };
        match self.written {
            Some(value) => write!(f, "{width}written with {:#0digits$x}", value & mask),
            None => write!(f, "{width}read"),
        }
    }
}

/// Reason why the run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Stop {
    /// The program used a feature of memory or a peripheral that the simulator does not model.
    #[error("{what} is not modelled: {access} by the instruction at {pc:#010x}")]
    Access {
        /// The data access that is not modelled.
        access: Access,
        /// Address of the instruction that ended the run.
        pc: u32,
        /// Name of the feature that is not modelled.
        what: &'static str,
    },
    /// An instruction that the core does not model, or whose behaviour the architecture leaves
    /// open.
    #[error("instruction {instruction:#010x} at {pc:#010x}: {what}")]
    Instruction {
        /// Code of the instruction: a 32-bit instruction has its first half-word in the upper half,
        /// a 16-bit instruction is in the lower half.
        instruction: u32,
        /// Address of the instruction that ended the run.
        pc: u32,
        /// Description of the problem.
        what: &'static str,
    },
    /// Behaviour outside the core that is not modelled.
    #[error("{what} (at {pc:#010x})")]
    Outside {
        /// Program counter at that time.
        pc: u32,
        /// Description of the behaviour.
        what: &'static str,
    },
    /// A fault in a fault handler: the core locked up.
    #[error("the core locked up at {pc:#010x}")]
    LockUp {
        /// Program counter at the lock-up.
        pc: u32,
    },
    /// A breakpoint set by the debugger was reached.
    #[error("breakpoint at {pc:#010x}")]
    Breakpoint {
        /// Address of the instruction that was about to execute.
        pc: u32,
    },
    /// An instruction accessed data that the debugger watches.
    #[error("watchpoint at {:#010x}, before {pc:#010x}", hit.address)]
    Watchpoint {
        /// Address of the next instruction.
        pc: u32,
        /// The access that matched.
        hit: WatchpointHit,
    },
    /// The program executed BKPT with a debugger attached.
    #[error("BKPT at {pc:#010x}")]
    BreakpointInstruction {
        /// Address of the BKPT instruction.
        pc: u32,
    },
    /// The chip requests a reset of the system, which the caller has to carry out.
    #[error("reset at {pc:#010x}")]
    Reset {
        /// Program counter at that time.
        pc: u32,
    },
    /// The program ended itself through semihosting, with this status.
    #[error("the program ended with status {0}")]
    Exit(u32),
}

/// Reason why an instruction did not complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trap {
    /// The core takes a fault exception.
    Fault(Fault),
    /// The run ends.
    Stop(Stop),
}

/// Result of an operation of the core that may end in a fault or the end of the run.
pub type TrapResult<T = ()> = Result<T, Trap>;

impl From<Fault> for Trap {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

impl From<Stop> for Trap {
    fn from(stop: Stop) -> Self {
        Self::Stop(stop)
    }
}

impl Trap {
    /// Returns the fault or stop that follows from a failed `access` of the instruction at `pc`.
    pub const fn from_data_access(denied: AccessError, access: Access, pc: u32) -> Self {
        match denied {
            AccessError::Error => Self::Fault(Fault::DataBus(access.address)),
            AccessError::Unmodelled(Unmodelled(what)) => {
                Self::Stop(Stop::Access { access, pc, what })
            }
        }
    }
}
