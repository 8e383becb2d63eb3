//! Executes operations (Arm ARM chapter A7), and counts their cycles.
//!
//! This module dispatches; `data`, `bits`, `memory`, `multiple`, `branch` and `control` execute.
//! `arithmetic` and `fpu` have their own modules beside this one. In: an `Op` whose condition has
//! passed. Out: the address of the next instruction.

mod bits;
mod branch;
mod control;
mod data;
mod memory;
mod multiple;
#[cfg(test)]
mod tests;

use super::decode::Entry;
use super::instruction::{Load, Op, Reg, ShiftKind};
use super::{Bus, Cpu, Size, TrapResult};
use crate::chip::Cycle;
use crate::chip::cpu::timing::{PipelineState, depends_on_last};

/// For each condition 0–14 of an instruction, the set of flag states in which it is met. Bit i of
/// an entry stands for the state in which N, Z, C, V are bits 3:0 of i (Arm ARM A7.3).
const CONDITIONS: [u16; 16] = {
    let mut table = [0; 16];
    let mut flags = 0;
    while flags < 16 {
        let (n, z, c, v) = (flags >> 3 & 1, flags >> 2 & 1, flags >> 1 & 1, flags & 1);
        let holds = [
            z == 1,
            c == 1,
            n == 1,
            v == 1,
            c == 1 && z == 0,
            n == v,
            n == v && z == 0,
        ];
        let mut pair = 0;
        while pair < 7 {
            if holds[pair] {
                table[2 * pair] |= 1 << flags;
            } else {
                table[2 * pair + 1] |= 1 << flags;
            }
            pair += 1;
        }
        table[14] |= 1 << flags;
        table[15] |= 1 << flags;
        flags += 1;
    }
    table
};

impl Cpu {
    /// Returns whether `condition` holds for the present flags.
    #[inline(always)]
    pub(super) fn is_condition_met(&self, condition: u8) -> bool {
        CONDITIONS[usize::from(condition & 15)] >> (self.registers.apsr >> 28) & 1 != 0
    }

    #[inline(always)]
    fn reg(&self, n: Reg) -> u32 {
        self.registers.r[usize::from(n & 15)]
    }

    /// Writes a register that is neither R13 nor R15.
    #[inline(always)]
    fn set(&mut self, d: Reg, value: u32) {
        self.registers.r[usize::from(d & 15)] = value;
    }

    /// Writes a register that may be R13, whose bits 1:0 stay 0 (B1.4.1).
    #[inline(always)]
    fn set_any(&mut self, d: Reg, value: u32) {
        let value = if d == 13 { value & !3 } else { value };
        self.registers.r[usize::from(d & 15)] = value;
    }

    /// Passes the `cycles` of an operation whose implementation does not do that itself.
    #[inline(always)]
    fn spend(&mut self, cycles: u32) {
        self.advance_by(Cycle::from(cycles));
    }

    /// Executes the instruction at R15, whose condition is met; returns the address of the next
    /// instruction.
    #[inline(always)]
    #[rustfmt::skip]
    pub(super) fn execute(&mut self, bus: &mut impl Bus, entry: &Entry) -> TrapResult<u32> {
        let last = self.pipeline.last;
        self.pipeline.last = entry.trail;
        let next = self.registers.r[15].wrapping_add(u32::from(entry.trail.length()));
        match entry.op {
            Op::MovImm { d, imm } => self.set(d, imm),
            Op::MovsImm { d, carry, imm } => self.movs(d, imm, carry),
            Op::AddImm { d, n, imm } => self.set(d, self.reg(n).wrapping_add(imm)),
            Op::AddsImm { d, n, imm } => self.adds(d, self.reg(n), imm),
            Op::SubsImm { d, n, imm } => self.subs(d, self.reg(n), imm),
            Op::CmpImm { n, imm } => self.compare(self.reg(n), imm),
            Op::AddToSp { n, imm } => self.set_any(13, self.reg(n).wrapping_add(imm)),
            Op::DataImm { alu, flags, carry, d, n, imm } => self.data_imm(alu, flags, carry, d, n, imm),
            Op::TestImm { test, carry, n, imm } => self.test_imm(test, carry, n, imm),
            Op::Movt { d, imm } => self.set(d, self.reg(d) & 0xFFFF | imm << 16),
            Op::MovReg { d, m } => self.set(d, self.reg(m)),
            Op::AddReg { d, n, m } => self.set(d, self.reg(n).wrapping_add(self.reg(m))),
            Op::AddsReg { d, n, m } => self.adds(d, self.reg(n), self.reg(m)),
            Op::SubsReg { d, n, m } => self.subs(d, self.reg(n), self.reg(m)),
            Op::CmpReg { n, m } => self.compare(self.reg(n), self.reg(m)),
            Op::DataReg { alu, flags, d, n, m, shift } => self.data_reg(alu, flags, d, n, m, shift),
            Op::TestReg { test, n, m, shift } => self.test_reg(test, n, m, shift),
            Op::ShiftImm { flags, d, m, shift } => self.shift_imm(flags, d, m, shift),
            Op::ShiftReg { kind, flags, d, n, m } => self.shift_reg(kind, flags, d, n, m),
            Op::Mul { flags, d, n, m } => self.mul(flags, d, n, m),
            Op::Rearrange { kind, d, m } => self.rearrange(kind, d, m),
            Op::Bfi { d, n, lsb, width } => self.insert(d, self.reg(n), lsb, width),
            Op::Bfc { d, lsb, width } => self.insert(d, 0, lsb, width),
            Op::Sbfx { d, n, lsb, width } => self.extract_signed(d, n, lsb, width),
            Op::Ubfx { d, n, lsb, width } => self.extract(d, n, lsb, width),
            Op::Ssat { d, n, bits, shift } => self.saturate_signed(d, n, bits, shift),
            Op::Usat { d, n, bits, shift } => self.saturate_unsigned(d, n, bits, shift),
            Op::Ssat16 { d, n, bits } => self.saturate_halves_signed(d, n, bits),
            Op::Usat16 { d, n, bits } => self.saturate_halves_unsigned(d, n, bits),
            Op::Pkh { top, d, n, m, shift } => self.pack(top, d, n, m, shift),

            Op::Ldr { t, n, imm } => return self.load_simple(bus, last, t, n, imm, Size::Word).map(|()| next),
            Op::Ldrh { t, n, imm } => return self.load_simple(bus, last, t, n, imm, Size::Half).map(|()| next),
            Op::Ldrb { t, n, imm } => return self.load_simple(bus, last, t, n, imm, Size::Byte).map(|()| next),
            Op::Str { t, n, imm } => return self.store_simple(bus, last, t, n, imm, Size::Word).map(|()| next),
            Op::Strh { t, n, imm } => return self.store_simple(bus, last, t, n, imm, Size::Half).map(|()| next),
            Op::Strb { t, n, imm } => return self.store_simple(bus, last, t, n, imm, Size::Byte).map(|()| next),
            Op::LoadReg { kind: Load::Word, t, n, m, shift } if t < 13 => {
                let address = self.reg(n).wrapping_add(self.reg(m) << (shift & 3));
                let cycles = self.begin_load(last, depends_on_last(last, n) | depends_on_last(last, m));
                let value = self.load(bus, address, Size::Word)?;
                self.set(t, value);
                self.advance_by(cycles);
                return Ok(next);
            }
            Op::Branch { refill, target } => return Ok(self.branch_to(bus, target, 1 + refill)),
            Op::BranchIf { condition, refill, target } => {
                if self.is_condition_met(condition) {
                    return Ok(self.branch_to(bus, target, 1 + refill));
                }
            }
            Op::CompareBranch { n, nonzero, refill, target } => {
                if (self.reg(n) != 0) == nonzero {
                    return Ok(self.branch_to(bus, target, 1 + refill));
                }
            }
            Op::BranchLink { refill, target } => {
                self.set(14, next | 1);
                return Ok(self.branch_to(bus, target, 1 + refill));
            }
            Op::Arithmetic(op) => {
                let cycles = self.execute_arithmetic(op)?;
                self.spend(cycles);
                return Ok(next);
            }
            Op::Float(op) => return self.execute_floating(bus, op, last).map(|()| next),
            _ => return self.execute_other(bus, entry, last, next),
        }
        self.advance_by(1);
        Ok(next)
    }

    /// Executes the less frequent operations of [`Self::execute`].
    #[inline(never)]
    #[rustfmt::skip]
    fn execute_other(&mut self, bus: &mut impl Bus, entry: &Entry, last: PipelineState, next: u32) -> TrapResult<u32> {
        match entry.op {
            Op::LoadImm { kind, t, n, imm } => {
                let address = self.reg(n).wrapping_add(imm);
                let hazard = depends_on_last(last, n);
                self.load_single(bus, last, hazard, kind, t, address, next)
            }
            Op::LoadReg { kind, t, n, m, shift } => {
                let address = self.reg(n).wrapping_add(self.reg(m) << (shift & 3));
                let hazard = depends_on_last(last, n) | depends_on_last(last, m);
                self.load_single(bus, last, hazard, kind, t, address, next)
            }
            Op::LoadLiteral { kind, t, address } => self.load_single(bus, last, 0, kind, t, address, next),
            Op::LoadIndexed { kind, t, n, index, imm } => self.load_indexed(bus, last, kind, t, (n, index, imm), next),
            Op::StoreReg { size, t, n, m, shift } => self.store_register(bus, last, size, t, (n, m, shift), next),
            Op::StoreIndexed { size, t, n, index, imm } => self.store_indexed(bus, last, size, t, (n, index, imm), next),
            Op::LoadUnprivileged { kind, t, n, imm } => self.load_unprivileged(bus, last, kind, t, n, imm).map(|()| next),
            Op::StoreUnprivileged { size, t, n, imm } => self.store_unprivileged(bus, last, size, t, n, imm).map(|()| next),
            Op::LoadDual { t, t2, n, index, imm } => self.load_dual(bus, last, (t, t2), (n, index, imm), next),
            Op::LoadDualLiteral { t, t2, address } => self.load_pair(bus, last, 0, (t, t2), address).map(|()| next),
            Op::StoreDual { t, t2, n, index, imm } => self.store_dual(bus, last, (t, t2), (n, index, imm), next),
            Op::LoadMultiple { n, writeback, down, list } => self.load_multiple(bus, last, n, writeback, down, list, next),
            Op::StoreMultiple { n, writeback, down, list } => self.store_multiple(bus, last, n, writeback, down, list, next),
            Op::LoadExclusive { size, t, n, imm } => self.load_exclusive(bus, last, size, t, n, imm).map(|()| next),
            Op::StoreExclusive { size, d, t, n, imm } => self.store_exclusive(bus, last, size, d, t, (n, imm)).map(|()| next),
            Op::BranchExchange { m } => self.branch_exchange(bus, self.reg(m)),
            Op::BranchLinkExchange { m } => self.branch_link_exchange(bus, self.reg(m), next),
            Op::MovToPc { m } => Ok(self.branch_register(bus, self.reg(m))),
            Op::AddToPc { m } => {
                let pc = self.registers.r[15].wrapping_add(4);
                Ok(self.branch_register(bus, pc.wrapping_add(self.reg(m))))
            }
            Op::TableBranch { n, m, half } => self.table_branch(bus, last, n, m, half),
            other => self.execute_control(bus, other, last, next),
        }
    }
}

/// Shifts `value` by `amount`, which may be 32 for right shifts; returns the result and the carry
/// out (Shift_C).
#[inline(always)]
const fn shift_carry(value: u32, kind: ShiftKind, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    match kind {
        ShiftKind::Lsl if amount < 32 => (value << amount, value >> (32 - amount) & 1 != 0),
        ShiftKind::Lsl => (0, amount == 32 && value & 1 != 0),
        ShiftKind::Lsr if amount < 32 => (value >> amount, value >> (amount - 1) & 1 != 0),
        ShiftKind::Lsr => (0, amount == 32 && value >> 31 != 0),
        ShiftKind::Asr if amount < 32 => (
            (value.cast_signed() >> amount).cast_unsigned(),
            value >> (amount - 1) & 1 != 0,
        ),
        ShiftKind::Asr => (
            (value.cast_signed() >> 31).cast_unsigned(),
            value >> 31 != 0,
        ),
        ShiftKind::Ror => {
            let result = value.rotate_right(amount & 31);
            (result, result >> 31 != 0)
        }
        ShiftKind::Rrx => (value >> 1 | (carry as u32) << 31, value & 1 != 0),
    }
}
