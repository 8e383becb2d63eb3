//! Why an instruction, or the whole run, did not go on.

use super::bus::{AccessError, Size, Unmodelled};
use super::system::WatchpointHit;
use crate::chip::names;
use std::fmt;

/// A synchronous fault of an instruction, taken as an exception (Arm ARM
/// B1.5.14, B3.2.15). The return address is the faulting instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// An instruction that the architecture defines as UNDEFINED (UDF).
    Undefined,
    /// Branch to ARM state (EPSR.T would be 0).
    InvalidState,
    /// Illegal EXC_RETURN or exception return.
    InvalidPc,
    /// Floating point while CPACR denies it.
    NoCoprocessor,
    /// Unaligned access that the instruction or CCR does not allow.
    Unaligned,
    /// Division by zero with CCR.DIV_0_TRP.
    DivideByZero,
    /// Precise data bus error.
    DataBus(u32),
    /// Bus error of a fetch.
    InstructionBus,
    /// The MPU denies data at this address.
    DataAccess(u32),
    /// The MPU, or execute-never memory, denies the fetch.
    InstructionAccess,
    /// Bus error while stacking for an exception.
    StackingBus,
    /// MPU violation while stacking for an exception.
    StackingAccess,
    /// Bus error while unstacking.
    UnstackingBus,
    /// MPU violation while unstacking.
    UnstackingAccess,
    /// MPU violation or bus error during lazy stacking (MLSPERR, LSPERR).
    LazyStackingAccess,
    /// Bus error during lazy stacking.
    LazyStackingBus,
    /// BKPT without a debugger and without semihosting: escalates.
    Breakpoint,
}

/// A data access, as the core asked for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// Its address.
    pub address: u32,
    /// Its width.
    pub size: Size,
    /// What was to be written; `None`: it reads.
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

/// Why the run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Stop {
    /// An access that nobody models.
    #[error("{what} is not modelled: {access} by the instruction at {pc:#010x}")]
    Access {
        /// Which data.
        access: Access,
        /// Address of the instruction.
        pc: u32,
        /// What is missing.
        what: &'static str,
    },
    /// An instruction that the core does not model, or whose behaviour the
    /// architecture leaves open.
    #[error("instruction {instruction:#010x} at {pc:#010x}: {what}")]
    Instruction {
        /// First half-word in the upper half for a 32-bit instruction; a
        /// 16-bit one in the lower half.
        instruction: u32,
        /// Its address.
        pc: u32,
        /// What is wrong with it.
        what: &'static str,
    },
    /// Behaviour outside the core that nobody models.
    #[error("{what} (at {pc:#010x})")]
    Outside {
        /// Where the core was.
        pc: u32,
        /// What happened.
        what: &'static str,
    },
    /// A fault in a fault handler: the core locked up.
    #[error("the core locked up at {pc:#010x}")]
    LockUp {
        /// Where.
        pc: u32,
    },
    /// A breakpoint set by the debugger was reached.
    #[error("breakpoint at {pc:#010x}")]
    Breakpoint {
        /// Where.
        pc: u32,
    },
    /// An instruction accessed data that the debugger watches.
    #[error("watchpoint at {:#010x}, before {pc:#010x}", hit.address)]
    Watchpoint {
        /// The next instruction.
        pc: u32,
        /// The access.
        hit: WatchpointHit,
    },
    /// BKPT, with a debugger attached.
    #[error("BKPT at {pc:#010x}")]
    BreakpointInstruction {
        /// Where.
        pc: u32,
    },
    /// The chip is to be reset.
    #[error("reset at {pc:#010x}")]
    Reset {
        /// Where the core was.
        pc: u32,
    },
    /// The program ended itself through semihosting.
    #[error("the program ended with status {0}")]
    Exit(u32),
}

/// Why an instruction did not complete.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trap {
    /// The core takes a fault exception.
    Fault(Fault),
    /// The run ends.
    Stop(Stop),
}

/// What an instruction gives that may not complete.
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
    /// What `access` by the instruction at `pc` that was `denied` comes to.
    pub const fn from_data_access(denied: AccessError, access: Access, pc: u32) -> Self {
        match denied {
            AccessError::Error => Self::Fault(Fault::DataBus(access.address)),
            AccessError::Unmodelled(Unmodelled(what)) => {
                Self::Stop(Stop::Access { access, pc, what })
            }
        }
    }
}
