//! Controls the floating-point extension (Arm ARM B3.2.20 on): access rights, and the place where
//! its registers are saved on an exception.

/// FPCCR: a lazy save is pending.
const LSPACT: u32 = 1;
/// FPCCR: the pre-empted context was unprivileged.
const USER: u32 = 1 << 1;
/// FPCCR: the pre-empted context was thread mode.
const THREAD: u32 = 1 << 3;
/// FPCCR: a hard fault could have pre-empted that context.
const HFRDY: u32 = 1 << 4;
/// FPCCR: a memory management fault could have pre-empted that context.
const MMRDY: u32 = 1 << 5;
/// FPCCR: a bus fault could have pre-empted that context.
const BFRDY: u32 = 1 << 6;
/// FPCCR: saves are lazy.
const LSPEN: u32 = 1 << 30;
/// FPCCR: a floating-point instruction sets CONTROL.FPCA, so that exceptions save the registers.
const ASPEN: u32 = 1 << 31;

/// Bits of FPSCR that FPDSCR sets: AHP, DN, FZ, RMode.
pub const DEFAULT_BITS: u32 = 0x07C0_0000;

/// Privilege of the context that an exception pre-empted, and the faults that it could have taken.
/// They decide about a fault of the lazy save.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PreemptedContext {
    /// Whether the context was privileged.
    pub privileged: bool,
    /// Whether the context was thread mode.
    pub thread: bool,
    /// Whether a hard fault could have pre-empted the context.
    pub hard_fault: bool,
    /// Whether a memory management fault was enabled and could have pre-empted the context.
    pub mem_manage: bool,
    /// Whether a bus fault was enabled and could have pre-empted the context.
    pub bus_fault: bool,
}

/// Registers CPACR, FPCCR, FPCAR and FPDSCR.
#[derive(Clone, PartialEq, Debug)]
pub struct Floating {
    cpacr: u32,
    fpccr: u32,
    /// Register FPCAR: address to which the pending lazy save writes.
    pub(crate) fpcar: u32,
    fpdscr: u32,
}

impl Default for Floating {
    fn default() -> Self {
        Self {
            cpacr: 0,
            fpccr: ASPEN | LSPEN,
            fpcar: 0,
            fpdscr: 0,
        }
    }
}

impl Floating {
    /// Reads the register at `address`; returns `None` if it is not a floating-point register.
    pub const fn read(&self, address: u32) -> Option<u32> {
        Some(match address {
            0xE000_ED88 => self.cpacr,
            0xE000_EF34 => self.fpccr,
            0xE000_EF38 => self.fpcar,
            0xE000_EF3C => self.fpdscr,
            // MVFR0, MVFR1 (TRM table 7-3).
            0xE000_EF40 => 0x1011_0021,
            0xE000_EF44 => 0x1100_0011,
            _ => return None,
        })
    }

    /// Writes the register at `address`; returns `None` if it is not a floating-point register.
    pub fn write(&mut self, address: u32, value: u32) -> Option<()> {
        match address {
            // Only coprocessors 10 and 11 exist; their fields are the same (Arm ARM B3.2.20).
            0xE000_ED88 => self.cpacr = value & 0xF << 20,
            0xE000_EF34 => {
                let bits = ASPEN | LSPEN | LSPACT | USER | THREAD | HFRDY | MMRDY | BFRDY | 1 << 8;
                self.fpccr = value & bits;
            }
            0xE000_EF38 => self.fpcar = value & !7,
            0xE000_EF3C => self.fpdscr = value & DEFAULT_BITS,
            0xE000_EF40 | 0xE000_EF44 => {}
            _ => return None,
        }
        Some(())
    }

    /// Returns whether CPACR allows floating-point instructions in `privileged` or unprivileged
    /// code.
    pub const fn is_allowed(&self, privileged: bool) -> bool {
        match self.cpacr >> 20 & 0b11 {
            0b11 => true,
            0b01 => privileged,
            _ => false,
        }
    }

    /// Returns FPCCR.ASPEN: whether a floating-point instruction sets CONTROL.FPCA.
    pub const fn is_saved_automatically(&self) -> bool {
        self.fpccr & ASPEN != 0
    }

    /// Returns FPCCR.LSPEN: whether the save waits for the first instruction that needs it.
    pub const fn is_lazy(&self) -> bool {
        self.fpccr & LSPEN != 0
    }

    /// Returns FPCCR.LSPACT: whether a lazy save is pending.
    pub const fn is_save_pending(&self) -> bool {
        self.fpccr & LSPACT != 0
    }

    /// Makes a lazy save to `address` pending, on behalf of the pre-empted context.
    pub fn defer_save(&mut self, address: u32, preempted: PreemptedContext) {
        self.fpcar = address & !7;
        self.fpccr &= ASPEN | LSPEN;
        let bits = [
            (true, LSPACT),
            (!preempted.privileged, USER),
            (preempted.thread, THREAD),
            (preempted.hard_fault, HFRDY),
            (preempted.mem_manage, MMRDY),
            (preempted.bus_fault, BFRDY),
        ];
        for (set, bit) in bits {
            self.fpccr |= if set { bit } else { 0 };
        }
    }

    /// Marks the pending lazy save as done (clears LSPACT).
    pub fn complete_save(&mut self) {
        self.fpccr &= !LSPACT;
    }

    /// Returns the privilege and possible faults of the context whose save is pending.
    pub const fn preempted(&self) -> PreemptedContext {
        PreemptedContext {
            privileged: self.fpccr & USER == 0,
            thread: self.fpccr & THREAD != 0,
            hard_fault: self.fpccr & HFRDY != 0,
            mem_manage: self.fpccr & MMRDY != 0,
            bus_fault: self.fpccr & BFRDY != 0,
        }
    }

    /// Returns FPSCR for a new floating-point context: the defaults of FPDSCR, and the other bits
    /// of the old value `fpscr`.
    pub const fn fresh_status(&self, fpscr: u32) -> u32 {
        fpscr & !DEFAULT_BITS | self.fpdscr
    }
}
