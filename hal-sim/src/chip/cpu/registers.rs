//! Defines the core's registers (Arm ARM DDI 0403, B1.4).

/// Condition flags and Q, as bits of APSR.
pub mod flag {
    /// Flag N: the result is negative, its bit 31 is set.
    pub const N: u32 = 1 << 31;
    /// Flag Z: the result is zero.
    pub const Z: u32 = 1 << 30;
    /// Flag C: an addition carried, or a subtraction did not borrow.
    pub const C: u32 = 1 << 29;
    /// Flag V: the result exceeds the range of signed numbers.
    pub const V: u32 = 1 << 28;
    /// Flag Q: a result was saturated; stays set until software clears it.
    pub const Q: u32 = 1 << 27;
    /// The four greater-or-equal bits of parallel arithmetic.
    pub const GE: u32 = 0xF << 16;
}

/// Core and floating-point registers.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Registers {
    /// Registers R0–R15. R13 is the stack pointer in use; R15 is the address of the instruction
    /// being executed (not +4), always even.
    pub r: [u32; 16],
    /// Stack pointer not in use: PSP while R13 is MSP, and vice versa.
    pub other_sp: u32,
    /// N, Z, C, V, Q, GE at their places in APSR; all other bits zero.
    pub apsr: u32,
    /// IT state (ITSTATE\[7:0\]), 0 outside an IT block.
    pub it: u8,
    /// Exception number, as in IPSR; 0 in thread mode.
    pub exception: u16,
    /// Bit 0 of PRIMASK: masks all exceptions with a configurable priority.
    pub primask: bool,
    /// Bit 0 of FAULTMASK: masks all exceptions except NMI.
    pub faultmask: bool,
    /// Value of BASEPRI: 0 masks nothing; otherwise masks exceptions of the same or a lower
    /// priority. The upper four bits count.
    pub basepri: u8,
    /// Value of CONTROL: bit 0 nPRIV, bit 1 SPSEL, bit 2 FPCA.
    pub control: u8,
    /// Floating-point registers S0–S31, as bit patterns of single-precision numbers.
    pub s: [u32; 32],
    /// FPSCR: flags of the last floating-point comparison, rounding mode, and sticky exception
    /// flags.
    pub fpscr: u32,
}

/// Bits of CONTROL.
pub mod control {
    /// Thread mode is unprivileged.
    pub const NPRIV: u8 = 1;
    /// Thread mode uses PSP.
    pub const SPSEL: u8 = 1 << 1;
    /// The floating-point registers are in use, so that exceptions save them.
    pub const FPCA: u8 = 1 << 2;
}

impl Registers {
    /// Returns whether R13 is the process stack pointer, PSP, at present: in thread mode with
    /// SPSEL.
    pub const fn uses_psp(&self) -> bool {
        self.exception == 0 && self.control & control::SPSEL != 0
    }

    /// Returns the main stack pointer, MSP, whether or not it is in use as R13.
    pub const fn msp(&self) -> u32 {
        if self.uses_psp() {
            self.other_sp
        } else {
            self.r[13]
        }
    }

    /// Returns the process stack pointer, PSP, whether or not it is in use as R13.
    pub const fn psp(&self) -> u32 {
        if self.uses_psp() {
            self.r[13]
        } else {
            self.other_sp
        }
    }

    /// Returns whether the core is in handler mode, or in thread mode without nPRIV.
    pub const fn is_privileged(&self) -> bool {
        self.exception != 0 || self.control & control::NPRIV == 0
    }
}
