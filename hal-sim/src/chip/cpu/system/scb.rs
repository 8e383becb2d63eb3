//! Models the system's control and fault status registers that only hold a value (Arm ARM B3.2).
//! Those that concern exceptions are in `nvic`.

use crate::chip::Cycle;
use crate::chip::cpu::Fault;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};

/// CPUID of the STM32F405: Cortex-M4 r0p1 (TRM table 4-1).
pub const CPUID: u32 = 0x410F_C241;

/// Bits of SCR, the system control register.
pub mod scr {
    pub const SLEEP_ON_EXIT: u32 = 1 << 1; // The core sleeps when it returns to thread mode
    pub const SLEEP_DEEP: u32 = 1 << 2; // Sleep would stop the clocks
    pub const SEV_ON_PEND: u32 = 1 << 4; // An exception that becomes pending is an event
}

/// Bits of CCR, the configuration and control register.
pub mod ccr {
    pub const NON_BASE_THREAD: u32 = 1; // Thread mode may be entered with exceptions active
    pub const USER_SET_PENDING: u32 = 1 << 1; // Unprivileged code may write STIR
    pub const UNALIGNED_TRAP: u32 = 1 << 3; // Every unaligned access is a fault
    pub const DIVIDE_BY_ZERO_TRAP: u32 = 1 << 4; // A division by zero is a fault
    pub const IGNORE_BUS_FAULT: u32 = 1 << 8; // Bus faults are ignored in hard fault and NMI
    pub const STACK_ALIGN: u32 = 1 << 9; // Exception frames are aligned to 8 bytes
    /// All modelled bits; the others read 0.
    pub const ALL: u32 =
        NON_BASE_THREAD | USER_SET_PENDING | UNALIGNED_TRAP | DIVIDE_BY_ZERO_TRAP | STACK_ALIGN;
}

/// Bits of ACTLR of the Cortex-M4 (TRM table 4-2).
pub mod actlr {
    /// Disables the interruption of LDM, STM, multiplications and divisions.
    pub const MULTI_CYCLE_INTERRUPTION: u32 = 1;
    pub const WRITE_BUFFER: u32 = 1 << 1; // Disables the write buffer: stores wait for their end
    pub const FOLDING: u32 = 1 << 2; // Disables the folding of IT
    pub const FPCA: u32 = 1 << 8; // Floating-point instructions leave CONTROL.FPCA alone
    pub const OUT_OF_ORDER_FP: u32 = 1 << 9; // Floating-point instructions complete in order
    /// All implemented bits; the others read 0.
    pub const ALL: u32 = MULTI_CYCLE_INTERRUPTION | WRITE_BUFFER | FOLDING | FPCA | OUT_OF_ORDER_FP;
}

/// Bits of HFSR, the hard fault status register.
pub mod hfsr {
    pub const VECTTBL: u32 = 1 << 1; // Bus error of a vector read
    pub const FORCED: u32 = 1 << 30; // Escalated from another fault
    pub const DEBUGEVT: u32 = 1 << 31; // A debug event without a debugger
}

/// Bit of DFSR for a breakpoint instruction.
const DFSR_BKPT: u32 = 1 << 1;

const MMARVALID: u32 = 1 << 7;
const BFARVALID: u32 = 1 << 15;

/// Returns the bit of CFSR that reports `fault` (Arm ARM B3.2.15); 0 for a breakpoint.
pub const fn cfsr_bit(fault: Fault) -> u32 {
    match fault {
        Fault::InstructionAccess => 1,
        Fault::DataAccess(_) => 1 << 1,
        Fault::UnstackingAccess => 1 << 3,
        Fault::StackingAccess => 1 << 4,
        Fault::LazyStackingAccess => 1 << 5,
        Fault::InstructionBus => 1 << 8,
        Fault::DataBus(_) => 1 << 9,
        Fault::UnstackingBus => 1 << 11,
        Fault::StackingBus => 1 << 12,
        Fault::LazyStackingBus => 1 << 13,
        Fault::Undefined => 1 << 16,
        Fault::InvalidState => 1 << 17,
        Fault::InvalidPc => 1 << 18,
        Fault::NoCoprocessor => 1 << 19,
        Fault::Unaligned => 1 << 24,
        Fault::DivideByZero => 1 << 25,
        Fault::Breakpoint => 0,
    }
}

/// Values of the SCB's control and fault status registers.
#[derive(Clone, PartialEq, Debug)]
pub struct Scb {
    /// Register VTOR: address of the vector table.
    pub vtor: u32,
    /// AIRCR.PRIGROUP, at its bit position.
    pub prigroup: u32,
    /// Register SCR: sleep on exit, deep sleep, events.
    pub scr: u32,
    /// Register CCR: traps and the alignment of exception frames.
    pub ccr: u32,
    cfsr: u32,
    hfsr: u32,
    dfsr: u32,
    mmfar: u32,
    bfar: u32,
    /// Register ACTLR: features of the core that are switched off.
    pub actlr: u32,
    /// Cycle at which AIRCR.SYSRESETREQ was written; `None` once the request has been passed on.
    pub reset_request: Option<Cycle>,
}

impl Default for Scb {
    fn default() -> Self {
        Self {
            vtor: 0,
            prigroup: 0,
            scr: 0,
            ccr: ccr::STACK_ALIGN,
            cfsr: 0,
            hfsr: 0,
            dfsr: 0,
            mmfar: 0,
            bfar: 0,
            actlr: 0,
            reset_request: None,
        }
    }
}

impl Scb {
    /// Records `fault` in CFSR, DFSR and the address registers.
    pub fn note_fault(&mut self, fault: Fault) {
        self.cfsr |= cfsr_bit(fault);
        match fault {
            Fault::DataAccess(address) => {
                self.cfsr |= MMARVALID;
                self.mmfar = address;
            }
            Fault::DataBus(address) => {
                self.cfsr |= BFARVALID;
                self.bfar = address;
            }
            Fault::Breakpoint => {
                self.dfsr |= DFSR_BKPT;
                self.hfsr |= hfsr::DEBUGEVT;
            }
            _ => {}
        }
    }

    /// Records the bus error of a buffered store, whose address is not kept: IMPRECISERR.
    pub fn note_imprecise_fault(&mut self) {
        self.cfsr |= 1 << 10;
    }

    /// Records the cause of a hard fault in HFSR.
    pub fn note_hard_fault(&mut self, bits: u32) {
        self.hfsr |= bits;
    }

    /// Reads the register at `address`; returns `None` if it is not a register of the SCB.
    pub const fn read(&self, address: u32) -> Option<u32> {
        Some(match address {
            0xE000_E008 => self.actlr,
            0xE000_ED00 => CPUID,
            0xE000_ED08 => self.vtor,
            0xE000_ED0C => 0xFA05_0000 | self.prigroup,
            0xE000_ED10 => self.scr,
            0xE000_ED14 => self.ccr,
            0xE000_ED28 => self.cfsr,
            0xE000_ED2C => self.hfsr,
            0xE000_ED30 => self.dfsr,
            0xE000_ED34 => self.mmfar,
            0xE000_ED38 => self.bfar,
            0xE000_ED3C => 0,
            _ => return None,
        })
    }

    /// Writes the register at `address`; returns `None` if it is not a register of the SCB.
    pub fn write(&mut self, address: u32, value: u32, at: Cycle) -> Option<Modelled> {
        match address {
            0xE000_E008 => self.actlr = value & actlr::ALL,
            0xE000_ED00 | 0xE000_ED3C => {}
            // The step is 128 bytes (Arm ARM B3.2.5). The program must align the table of 98
            // vectors to 512 bytes; this is not checked.
            0xE000_ED08 => self.vtor = value & !0x7F,
            0xE000_ED0C => return Some(self.write_aircr(value, at)),
            0xE000_ED10 => {
                self.scr = value & (scr::SLEEP_ON_EXIT | scr::SLEEP_DEEP | scr::SEV_ON_PEND);
            }
            0xE000_ED14 => {
                if value & ccr::IGNORE_BUS_FAULT != 0 {
                    return Some(Err(Unmodelled("SCB_CCR.BFHFNMIGN")));
                }
                self.ccr = value & ccr::ALL;
            }
            0xE000_ED28 => self.cfsr &= !value,
            0xE000_ED2C => self.hfsr &= !value,
            0xE000_ED30 => self.dfsr &= !value,
            0xE000_ED34 => self.mmfar = value,
            0xE000_ED38 => self.bfar = value,
            _ => return None,
        }
        Some(Ok(()))
    }

    fn write_aircr(&mut self, value: u32, at: Cycle) -> Modelled {
        if value >> 16 != 0x05FA {
            return Ok(());
        }
        refuse_if(value & 0b11 != 0, "SCB_AIRCR.VECTRESET or VECTCLRACTIVE")?;
        self.prigroup = value & 7 << 8;
        if value & 1 << 2 != 0 {
            self.reset_request = Some(at);
        }
        Ok(())
    }
}
