//! The fields of a 32-bit instruction.

use crate::chip::cpu::instruction::Reg;

/// An instruction's two half-words and where it lies.
#[derive(Clone, Copy, PartialEq)]
pub struct WideCode {
    /// First half-word.
    pub first: u16,
    /// Second half-word.
    pub second: u16,
    /// Its address.
    pub pc: u32,
}

impl WideCode {
    /// Rn, bits 3:0 of the first half-word.
    pub const fn n(self) -> Reg {
        (self.first & 0xF) as u8
    }

    /// Rd, bits 11:8.
    pub const fn d(self) -> Reg {
        (self.second >> 8 & 0xF) as u8
    }

    /// Rt (or Ra), bits 15:12.
    pub const fn t(self) -> Reg {
        (self.second >> 12) as u8
    }

    /// Rm, bits 3:0.
    pub const fn m(self) -> Reg {
        (self.second & 0xF) as u8
    }

    /// `width` bits from `low` on of the first half-word.
    pub const fn first(self, low: u32, width: u32) -> u8 {
        ((self.first >> low) & ((1 << width) - 1)) as u8
    }

    /// `width` bits from `low` on of the second half-word.
    pub const fn second(self, low: u32, width: u32) -> u8 {
        ((self.second >> low) & ((1 << width) - 1)) as u8
    }

    /// Address of the instruction plus 4.
    pub const fn pc4(self) -> u32 {
        self.pc.wrapping_add(4)
    }

    /// Address of the instruction plus 4, word-aligned.
    pub const fn base(self) -> u32 {
        self.pc4() & !3
    }
}

/// R13 and R15, which most operands must not be.
pub const fn is_bad(register: Reg) -> bool {
    register == 13 || register == 15
}
