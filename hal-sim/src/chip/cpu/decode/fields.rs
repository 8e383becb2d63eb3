//! Extracts the fields of a 32-bit instruction.

use crate::chip::cpu::instruction::Reg;

/// Two half-words of an instruction, and its address.
#[derive(Clone, Copy, PartialEq)]
pub struct WideCode {
    /// First half-word of the instruction, the one at the lower address.
    pub first: u16,
    /// Second half-word of the instruction, at the address `pc` + 2.
    pub second: u16,
    /// Address of the instruction.
    pub pc: u32,
}

impl WideCode {
    /// Returns Rn, bits 3:0 of the first half-word.
    pub const fn n(self) -> Reg {
        (self.first & 0xF) as u8
    }

    /// Returns Rd, bits 11:8 of the second half-word.
    pub const fn d(self) -> Reg {
        (self.second >> 8 & 0xF) as u8
    }

    /// Returns Rt (or Ra), bits 15:12 of the second half-word.
    pub const fn t(self) -> Reg {
        (self.second >> 12) as u8
    }

    /// Returns Rm, bits 3:0 of the second half-word.
    pub const fn m(self) -> Reg {
        (self.second & 0xF) as u8
    }

    /// Returns `width` bits from bit `low` on of the first half-word.
    pub const fn first(self, low: u32, width: u32) -> u8 {
        ((self.first >> low) & ((1 << width) - 1)) as u8
    }

    /// Returns `width` bits from bit `low` on of the second half-word.
    pub const fn second(self, low: u32, width: u32) -> u8 {
        ((self.second >> low) & ((1 << width) - 1)) as u8
    }

    /// Returns the value that the instruction reads from R15: its address plus 4.
    pub const fn pc4(self) -> u32 {
        self.pc.wrapping_add(4)
    }

    /// Returns the base of addresses relative to R15: the address of the instruction plus 4,
    /// rounded down to a word.
    pub const fn base(self) -> u32 {
        self.pc4() & !3
    }
}

/// Returns whether the register is R13 or R15, which most operands must not be.
pub const fn is_bad(register: Reg) -> bool {
    register == 13 || register == 15
}
