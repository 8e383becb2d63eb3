//! Executes extensions, bit fields, saturation and packing (Arm ARM A7.7).

use crate::chip::cpu::Cpu;
use crate::chip::cpu::instruction::{Rearrange, Reg, Shift};
use crate::chip::cpu::registers::flag;

/// Returns a mask of `width` ones, 1–32.
const fn ones(width: u8) -> u32 {
    u32::MAX >> (32 - width as u32)
}

/// Clamps `value` to `bits` signed bits, 1–32; returns the result, and whether it differs.
fn clamp_signed(value: i32, bits: u8) -> (i32, bool) {
    let most = i32::MAX >> (32 - u32::from(bits));
    let result = value.clamp(-most - 1, most);
    (result, result != value)
}

/// Clamps `value` to `bits` unsigned bits, 0–31; returns the result, and whether it differs.
fn clamp_unsigned(value: i32, bits: u8) -> (i32, bool) {
    let most = ((1u32 << bits) - 1).cast_signed();
    let result = value.clamp(0, most);
    (result, result != value)
}

/// Returns the lower and the upper half-word of `value`, sign-extended.
const fn halves(value: u32) -> (i32, i32) {
    let value = value.cast_signed();
    (value << 16 >> 16, value >> 16)
}

const fn join(low: i32, high: i32) -> u32 {
    low.cast_unsigned() & 0xFFFF | high.cast_unsigned() << 16
}

impl Cpu {
    #[inline(always)]
    pub(super) fn rearrange(&mut self, kind: Rearrange, d: Reg, m: Reg) {
        let value = self.reg(m);
        let signed = value.cast_signed();
        let result = match kind {
            Rearrange::Sxth => (signed << 16 >> 16).cast_unsigned(),
            Rearrange::Sxtb => (signed << 24 >> 24).cast_unsigned(),
            Rearrange::Uxth => value & 0xFFFF,
            Rearrange::Uxtb => value & 0xFF,
            Rearrange::Rev => value.swap_bytes(),
            Rearrange::Rev16 => value.swap_bytes().rotate_left(16),
            Rearrange::Revsh => (value.swap_bytes().cast_signed() >> 16).cast_unsigned(),
        };
        self.set(d, result);
    }

    #[inline(always)]
    pub(super) fn insert(&mut self, d: Reg, value: u32, lsb: u8, width: u8) {
        let mask = ones(width) << lsb;
        self.set(d, self.reg(d) & !mask | value << lsb & mask);
    }

    #[inline(always)]
    pub(super) fn extract(&mut self, d: Reg, n: Reg, lsb: u8, width: u8) {
        self.set(d, self.reg(n) >> lsb & ones(width));
    }

    #[inline(always)]
    pub(super) fn extract_signed(&mut self, d: Reg, n: Reg, lsb: u8, width: u8) {
        let up = self.reg(n) << (32 - lsb - width);
        self.set(d, (up.cast_signed() >> (32 - width)).cast_unsigned());
    }

    fn note_saturation(&mut self, saturated: bool) {
        if saturated {
            self.registers.apsr |= flag::Q;
        }
    }

    pub(super) fn saturate_signed(&mut self, d: Reg, n: Reg, bits: u8, shift: Shift) {
        let operand = self.shifted(n, shift).0.cast_signed();
        let (result, saturated) = clamp_signed(operand, bits);
        self.set(d, result.cast_unsigned());
        self.note_saturation(saturated);
    }

    pub(super) fn saturate_unsigned(&mut self, d: Reg, n: Reg, bits: u8, shift: Shift) {
        let operand = self.shifted(n, shift).0.cast_signed();
        let (result, saturated) = clamp_unsigned(operand, bits);
        self.set(d, result.cast_unsigned());
        self.note_saturation(saturated);
    }

    pub(super) fn saturate_halves_signed(&mut self, d: Reg, n: Reg, bits: u8) {
        let (low, high) = halves(self.reg(n));
        let (low, low_saturated) = clamp_signed(low, bits);
        let (high, high_saturated) = clamp_signed(high, bits);
        self.set(d, join(low, high));
        self.note_saturation(low_saturated || high_saturated);
    }

    pub(super) fn saturate_halves_unsigned(&mut self, d: Reg, n: Reg, bits: u8) {
        let (low, high) = halves(self.reg(n));
        let (low, low_saturated) = clamp_unsigned(low, bits);
        let (high, high_saturated) = clamp_unsigned(high, bits);
        self.set(d, join(low, high));
        self.note_saturation(low_saturated || high_saturated);
    }

    pub(super) fn pack(&mut self, top: bool, d: Reg, n: Reg, m: Reg, shift: Shift) {
        let a = self.reg(n);
        let b = self.shifted(m, shift).0;
        let result = if top {
            a & 0xFFFF_0000 | b & 0xFFFF
        } else {
            b & 0xFFFF_0000 | a & 0xFFFF
        };
        self.set(d, result);
    }
}
