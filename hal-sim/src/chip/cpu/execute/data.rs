//! Executes data processing: moves, sums, logic, shifts (Arm ARM A7.7), one cycle each.

use super::shift_carry;
use crate::chip::cpu::Cpu;
use crate::chip::cpu::instruction::{Alu, CarryOut, Reg, Shift, ShiftKind, Test};
use crate::chip::cpu::registers::flag;

/// Returns the flags N and Z of `result`, at their places in APSR.
#[inline(always)]
const fn negative_zero(result: u32) -> u32 {
    result & flag::N | ((result == 0) as u32) << 30
}

/// Adds with carry (AddWithCarry). Returns the sum, and the flags N, Z, C, V at their places in
/// APSR.
#[inline(always)]
const fn add(a: u32, b: u32, carry: bool) -> (u32, u32) {
    let wide = a as u64 + b as u64 + carry as u64;
    let sum = (wide & 0xFFFF_FFFF) as u32;
    let overflow = ((a ^ sum) & (b ^ sum)) >> 31;
    let flags = negative_zero(sum) | ((wide >> 32) as u32) << 29 | overflow << 28;
    (sum, flags)
}

impl Cpu {
    #[inline(always)]
    pub(super) fn carry(&self) -> bool {
        self.registers.apsr & flag::C != 0
    }

    #[inline(always)]
    fn set_nzcv(&mut self, flags: u32) {
        self.registers.apsr = self.registers.apsr & 0x0FFF_FFFF | flags;
    }

    /// Sets the flags N and Z from `result`; the other flags stay.
    #[inline(always)]
    fn set_nz(&mut self, result: u32) {
        self.registers.apsr = self.registers.apsr & 0x3FFF_FFFF | negative_zero(result);
    }

    #[inline(always)]
    fn set_nzc(&mut self, result: u32, carry: bool) {
        let flags = negative_zero(result) | u32::from(carry) << 29;
        self.registers.apsr = self.registers.apsr & 0x1FFF_FFFF | flags;
    }

    #[inline(always)]
    fn carry_of(&self, carry: CarryOut) -> bool {
        match carry {
            CarryOut::Kept => self.carry(),
            CarryOut::Clear => false,
            CarryOut::Set => true,
        }
    }

    #[inline(always)]
    pub(super) fn movs(&mut self, d: Reg, imm: u32, carry: CarryOut) {
        self.set(d, imm);
        self.set_nzc(imm, self.carry_of(carry));
    }

    #[inline(always)]
    pub(super) fn adds(&mut self, d: Reg, a: u32, b: u32) {
        let (sum, flags) = add(a, b, false);
        self.set(d, sum);
        self.set_nzcv(flags);
    }

    #[inline(always)]
    pub(super) fn subs(&mut self, d: Reg, a: u32, b: u32) {
        let (sum, flags) = add(a, !b, true);
        self.set(d, sum);
        self.set_nzcv(flags);
    }

    #[inline(always)]
    pub(super) fn compare(&mut self, a: u32, b: u32) {
        let (_, flags) = add(a, !b, true);
        self.set_nzcv(flags);
    }

    /// Executes an operation of data processing. `a` is the first operand, `b` the second; `carry`
    /// is the carry out of computing `b`.
    #[inline(always)]
    fn data(&mut self, alu: Alu, flags: bool, d: Reg, a: u32, (b, carry): (u32, bool)) {
        let (result, nzcv) = match alu {
            Alu::Add => add(a, b, false),
            Alu::Adc => add(a, b, self.carry()),
            Alu::Sub => add(a, !b, true),
            Alu::Sbc => add(a, !b, self.carry()),
            Alu::Rsb => add(!a, b, true),
            _ => {
                let result = match alu {
                    Alu::And => a & b,
                    Alu::Bic => a & !b,
                    Alu::Orr => a | b,
                    Alu::Orn => a | !b,
                    Alu::Eor => a ^ b,
                    Alu::Mvn => !b,
                    _ => b,
                };
                let v = self.registers.apsr & flag::V;
                (result, negative_zero(result) | u32::from(carry) << 29 | v)
            }
        };
        self.set_any(d, result);
        if flags {
            self.set_nzcv(nzcv);
        }
    }

    #[inline(always)]
    pub(super) fn data_imm(
        &mut self,
        alu: Alu,
        flags: bool,
        carry: CarryOut,
        d: Reg,
        n: Reg,
        imm: u32,
    ) {
        let carry = self.carry_of(carry);
        self.data(alu, flags, d, self.reg(n), (imm, carry));
    }

    #[inline(always)]
    pub(super) fn data_reg(&mut self, alu: Alu, flags: bool, d: Reg, n: Reg, m: Reg, shift: Shift) {
        let b = self.shifted(m, shift);
        self.data(alu, flags, d, self.reg(n), b);
    }

    /// Returns Rm shifted by a constant, and the carry out.
    #[inline(always)]
    pub(super) fn shifted(&self, m: Reg, shift: Shift) -> (u32, bool) {
        let carry = self.carry();
        shift_carry(self.reg(m), shift.kind, u32::from(shift.amount), carry)
    }

    #[inline(always)]
    fn test(&mut self, test: Test, a: u32, (b, carry): (u32, bool)) {
        match test {
            Test::Tst => self.set_nzc(a & b, carry),
            Test::Teq => self.set_nzc(a ^ b, carry),
            Test::Cmn => self.set_nzcv(add(a, b, false).1),
            Test::Cmp => self.set_nzcv(add(a, !b, true).1),
        }
    }

    #[inline(always)]
    pub(super) fn test_imm(&mut self, test: Test, carry: CarryOut, n: Reg, imm: u32) {
        let carry = self.carry_of(carry);
        self.test(test, self.reg(n), (imm, carry));
    }

    #[inline(always)]
    pub(super) fn test_reg(&mut self, test: Test, n: Reg, m: Reg, shift: Shift) {
        let b = self.shifted(m, shift);
        self.test(test, self.reg(n), b);
    }

    #[inline(always)]
    pub(super) fn shift_imm(&mut self, flags: bool, d: Reg, m: Reg, shift: Shift) {
        let (result, carry) = self.shifted(m, shift);
        self.set(d, result);
        if flags {
            self.set_nzc(result, carry);
        }
    }

    /// Executes a shift of Rn by the number of bits in the lowest byte of Rm.
    #[inline(always)]
    pub(super) fn shift_reg(&mut self, kind: ShiftKind, flags: bool, d: Reg, n: Reg, m: Reg) {
        let amount = self.reg(m) & 0xFF;
        let (result, carry) = shift_carry(self.reg(n), kind, amount, self.carry());
        self.set(d, result);
        if flags {
            self.set_nzc(result, carry);
        }
    }

    #[inline(always)]
    pub(super) fn mul(&mut self, flags: bool, d: Reg, n: Reg, m: Reg) {
        let product = self.reg(n).wrapping_mul(self.reg(m));
        self.set(d, product);
        if flags {
            self.set_nz(product);
        }
    }
}
