//! Describes a fault that the program took: the registers that show its cause and place.

use crate::chip::cpu::{Cpu, Size};
use crate::chip::image::Symbols;
use crate::chip::names;
use crate::chip::soc::Soc;

/// Returns whether exception `number` is a fault, HardFault to UsageFault (Arm ARM B1.5.2).
pub(super) const fn is_fault(number: u16) -> bool {
    matches!(number, 3..=6)
}

const CFSR: u32 = 0xE000_ED28;
const HFSR: u32 = 0xE000_ED2C;
const MMFAR: u32 = 0xE000_ED34;
const BFAR: u32 = 0xE000_ED38;

/// Bit of CFSR that says that MMFAR holds an address.
const MMARVALID: u32 = 1 << 7;
/// Bit of CFSR that says that BFAR holds an address.
const BFARVALID: u32 = 1 << 15;

/// Meanings of the bits of CFSR (Arm ARM B3.2.15).
const CAUSES: [(u32, &str); 17] = [
    (1, "the MPU denied an instruction fetch"),
    (1 << 1, "the MPU denied a data access"),
    (1 << 3, "the MPU denied unstacking"),
    (1 << 4, "the MPU denied stacking"),
    (1 << 5, "the MPU denied lazy floating-point stacking"),
    (1 << 8, "a bus error at an instruction fetch"),
    (1 << 9, "a bus error at a data access"),
    (
        1 << 10,
        "a bus error at a store some instructions earlier (imprecise)",
    ),
    (1 << 11, "a bus error at unstacking"),
    (1 << 12, "a bus error at stacking"),
    (1 << 13, "a bus error at lazy floating-point stacking"),
    (1 << 16, "an undefined instruction"),
    (1 << 17, "a jump to an even address"),
    (1 << 18, "an invalid exception return"),
    (
        1 << 19,
        "a floating-point instruction while CPACR denies access",
    ),
    (1 << 24, "an unaligned address"),
    (1 << 25, "a division by zero"),
];

/// Meanings of the bits of HFSR (Arm ARM B3.2.16), without FORCED.
const HARD_CAUSES: [(u32, &str); 2] = [
    (1 << 1, "a bus error at a vector fetch"),
    (1 << 31, "a breakpoint without a debugger"),
];

/// Names of the words that the core pushes onto the stack at the entry of an exception, in their
/// order (Arm ARM B1.5.6).
pub const STACKED: [&str; 8] = ["r0", "r1", "r2", "r3", "r12", "lr", "pc", "xpsr"];

/// A fault that the program took, with the registers at its entry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Number of the exception, 3 (HardFault) to 6 (UsageFault).
    pub number: u16,
    /// Time of the fault, ns after power-on.
    pub ns: u64,
    /// Words that the core stacked, in the order of [`STACKED`]; `None` if stacking failed.
    pub stacked: Option<[u32; 8]>,
    /// Stack pointer before the fault.
    pub sp: u32,
    /// Register CFSR: its bits report the causes of the fault.
    pub cfsr: u32,
    /// Register HFSR: its bits report why a hard fault was taken.
    pub hfsr: u32,
    /// Address whose access caused the fault, from MMFAR or BFAR; `None` if neither is valid.
    pub address: Option<u32>,
}

impl Fault {
    /// Reads the fault at the entry of exception `number` at `ns`, before its handler has run.
    pub(super) fn at_entry(number: u16, ns: u64, cpu: &mut Cpu, soc: &Soc) -> Self {
        let at = cpu.cycle;
        let mut register = |address| cpu.system.read(address, Size::Word, at).unwrap_or(0);
        let [cfsr, hfsr, mmfar, bfar] = [CFSR, HFSR, MMFAR, BFAR].map(&mut register);
        let address = match cfsr & (MMARVALID | BFARVALID) {
            0 => None,
            MMARVALID => Some(mmfar),
            _ => Some(bfar),
        };
        let registers = &cpu.registers;
        // Bit 2 of EXC_RETURN selects the stack (Arm ARM B1.5.8).
        let sp = match registers.r[14] & 4 {
            0 => registers.msp(),
            _ => registers.psp(),
        };
        let mut stacked = [0; STACKED.len()];
        let mut is_there = true;
        for (word, offset) in stacked.iter_mut().zip((0..).step_by(4)) {
            let address = sp.wrapping_add(offset);
            let read = soc.ram.read(address, Size::Word);
            let read = read.or_else(|| soc.ccm.read(address, Size::Word));
            is_there &= read.is_some();
            *word = read.unwrap_or(0);
        }
        Self {
            number,
            ns,
            stacked: is_there.then_some(stacked),
            sp: sp.wrapping_add(4 * STACKED.len() as u32),
            cfsr,
            hfsr,
            address,
        }
    }

    /// Returns the name of the exception in the Arm ARM.
    pub const fn name(&self) -> &'static str {
        match self.number {
            3 => "HardFault",
            4 => "MemManage",
            5 => "BusFault",
            _ => "UsageFault",
        }
    }

    /// Returns the address of the faulting instruction; `None` if stacking failed.
    pub fn pc(&self) -> Option<u32> {
        self.stacked.map(|words| words[6])
    }

    /// Describes cause and place in one line, with names from `symbols`.
    pub fn describe(&self, symbols: &Symbols) -> String {
        let register_causes = |table: &[(u32, &'static str)], register: u32| -> Vec<&'static str> {
            let set = table.iter().filter(|(bit, _)| register & bit != 0);
            set.map(|(_, cause)| *cause).collect()
        };
        let causes = [
            register_causes(&CAUSES, self.cfsr),
            register_causes(&HARD_CAUSES, self.hfsr),
        ]
        .concat();
        let mut text = format!("{}: {}", self.name(), causes.join(", "));
        if let Some(address) = self.address {
            text.push_str(&format!(" at {address:#010x}"));
            if let Some(register) = names::register(address) {
                text.push_str(&format!(" ({register})"));
            }
        }
        match self.pc() {
            Some(pc) => {
                let function = symbols.describe(pc);
                text.push_str(&format!(", pc {pc:#010x} (in {function})"));
            }
            None => text.push_str("; the pc is unknown, because stacking failed"),
        }
        text
    }

    /// Returns the stacked and the status registers with their names.
    pub fn registers(&self) -> Vec<(&'static str, u32)> {
        let stacked = self.stacked.map(|words| STACKED.into_iter().zip(words));
        let status = [("sp", self.sp), ("cfsr", self.cfsr), ("hfsr", self.hfsr)];
        stacked.into_iter().flatten().chain(status).collect()
    }
}
