//! FPv4-SP: everything whose first half-word is 0xEC00–0xEFFF or 0xFC00–0xFFFF
//! with coprocessor 10 or 11.
//!
//! `number` unpacks and rounds in integers, `operations` and `convert` compute
//! with that, `transfer` is the way to memory. In: a decoded `Op`, registers,
//! the bus. Out: registers, FPSCR, cycles.

mod convert;
mod decode;
mod number;
mod operations;
#[cfg(test)]
mod tests;
mod transfer;

use super::registers::flag;
use super::{Bus, Cpu, Registers, Trapped};
pub use convert::Fixed;
pub use decode::decode;
pub use transfer::{Transfer, Writeback};

/// Bits of FPSCR (Arm ARM A2.5.3).
pub(crate) mod fpscr {
    pub const NZCV: u32 = 0xF << 28; // N, Z, C, V of the last comparison
    /// Half precision in the alternative format, without infinities and NaNs.
    pub const AHP: u32 = 1 << 26;
    pub const DN: u32 = 1 << 25; // Every NaN result is the default NaN
    pub const FZ: u32 = 1 << 24; // Denormal numbers are flushed to zero
    pub const RMODE: u32 = 3 << 22; // Rounding mode: 0 nearest, 1 up, 2 down, 3 towards zero
    pub const IDC: u32 = 1 << 7; // A denormal input was flushed
    pub const IXC: u32 = 1 << 4; // Inexact
    pub const UFC: u32 = 1 << 3; // Underflow
    pub const OFC: u32 = 1 << 2; // Overflow
    pub const DZC: u32 = 1 << 1; // Division by zero
    pub const IOC: u32 = 1; // Invalid operation
    /// The bits that exist.
    pub const ALL: u32 = NZCV | AHP | DN | FZ | RMODE | IDC | IXC | UFC | OFC | DZC | IOC;
}

/// Arithmetic on two or three registers. `minus_product`: the product's, or the
/// first factor's, sign is changed; `minus_addend`: the accumulator's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum Arithmetic {
    Add, // VADD
    Subtract, // VSUB
    Multiply, // VMUL
    NegatedMultiply, // VNMUL
    Divide, // VDIV
    Accumulate { minus_product: bool, minus_addend: bool }, // VMLA, VMLS, VNMLA, VNMLS: rounds twice
    Fused { minus_product: bool, minus_addend: bool }, // VFMA, VFMS, VFNMA, VFNMS: rounds once
}

/// What is done to one register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum Unary {
    Copy, // VMOV
    Absolute, // VABS
    Negate, // VNEG
    SquareRoot, // VSQRT
    FromHalf { top: bool }, // VCVTB, VCVTT of the lower or upper half-word to single precision
    ToHalf { top: bool }, // VCVTB, VCVTT to half precision; the other half-word stays
    FromInteger { signed: bool }, // VCVT, rounded as FPSCR says
    ToInteger { signed: bool, truncate: bool }, // VCVT, towards zero; VCVTR as FPSCR says
    FromFixed(Fixed), // VCVT, rounded to nearest
    ToFixed(Fixed), // VCVT, towards zero
}

/// A decoded floating-point instruction. `s`, `d`, `n`, `m` are S registers,
/// a D register being two of them; `t` and `t2` core registers. `half`: half a
/// D register is named, not an S register: one cycle instead of two (TRM table
/// 7-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum Op {
    Arithmetic(Arithmetic, u8, u8, u8), // d = n op m
    Unary(Unary, u8, u8), // d = op m
    Constant(u8, u32), // VMOV of a constant
    /// VCMP of d with m, or with +0; VCMPE, to which a quiet NaN is an invalid
    /// operation too, if `signal`.
    Compare { d: u8, m: Option<u8>, signal: bool },
    FromCore { s: u8, t: u8, half: bool }, // VMOV of `t` to `s`
    ToCore { s: u8, t: u8, half: bool }, // VMOV of `s` to `t`
    FromCorePair { s: u8, t: u8, t2: u8 }, // VMOV to `s` and its successor
    ToCorePair { s: u8, t: u8, t2: u8 }, // VMOV from `s` and its successor
    ReadStatus(u8), // VMRS of FPSCR
    ReadFlags, // VMRS of FPSCR's flags to APSR
    WriteStatus(u8), // VMSR
    Load(Transfer), // VLDR, VLDM, VPOP
    Store(Transfer), // VSTR, VSTM, VPUSH
}

impl Cpu {
    /// Executes (the condition has passed), after `prepare_fp`, which it calls;
    /// gives its cycles without pipeline effects (TRM table 7-1).
    #[inline]
    pub(super) fn execute_fpu(&mut self, bus: &mut impl Bus, op: Op) -> Trapped<u32> {
        self.prepare_fp(bus)?;
        match op {
            Op::Load(transfer) => self.load_singles(bus, transfer),
            Op::Store(transfer) => self.store_singles(bus, transfer),
            _ => Ok(execute(op, &mut self.registers)),
        }
    }
}

#[inline]
fn get(registers: &Registers, number: u8) -> u32 {
    registers.s[usize::from(number & 31)]
}

#[inline]
fn set(registers: &mut Registers, number: u8, value: u32) {
    registers.s[usize::from(number & 31)] = value;
}

#[inline]
fn core(registers: &mut Registers, number: u8) -> &mut u32 {
    &mut registers.r[usize::from(number & 15)]
}

/// What `op` does to the registers (memory is not touched here); its cycles.
fn execute(op: Op, registers: &mut Registers) -> u32 {
    match op {
        Op::Arithmetic(kind, d, n, m) => return arithmetic(kind, [d, n, m], registers),
        Op::Unary(kind, d, m) => {
            let operand = get(registers, m);
            let old = get(registers, d);
            let result = unary(kind, old, operand, &mut registers.fpscr);
            set(registers, d, result);
            if kind == Unary::SquareRoot {
                return 14;
            }
        }
        Op::Constant(d, value) => set(registers, d, value),
        Op::Compare { d, m, signal } => {
            let (a, b) = (get(registers, d), m.map_or(0, |m| get(registers, m)));
            let flags = operations::compare(a, b, signal, &mut registers.fpscr);
            registers.fpscr = registers.fpscr & !fpscr::NZCV | flags;
        }
        Op::FromCore { s, t, half } => {
            let value = *core(registers, t);
            set(registers, s, value);
            return 2 - u32::from(half);
        }
        Op::ToCore { s, t, half } => {
            *core(registers, t) = get(registers, s);
            return 2 - u32::from(half);
        }
        Op::FromCorePair { s, t, t2 } => {
            let values = [*core(registers, t), *core(registers, t2)];
            set(registers, s, values[0]);
            set(registers, s + 1, values[1]);
            return 2;
        }
        Op::ToCorePair { s, t, t2 } => {
            *core(registers, t) = get(registers, s);
            *core(registers, t2) = get(registers, s + 1);
            return 2;
        }
        Op::ReadStatus(t) => *core(registers, t) = registers.fpscr,
        Op::ReadFlags => {
            let flags = flag::N | flag::Z | flag::C | flag::V;
            registers.apsr = registers.apsr & !flags | registers.fpscr & flags;
        }
        Op::WriteStatus(t) => registers.fpscr = *core(registers, t) & fpscr::ALL,
        // `execute_fpu` keeps these.
        Op::Load(_) | Op::Store(_) => {}
    }
    1
}

#[rustfmt::skip]
fn arithmetic(kind: Arithmetic, [d, n, m]: [u8; 3], registers: &mut Registers) -> u32 {
    const SIGN: u32 = 1 << 31;
    let (a, b) = (get(registers, n), get(registers, m));
    let old = get(registers, d);
    let status = &mut registers.fpscr;
    let sign_if = |minus: bool| if minus { SIGN } else { 0 };
    let (result, cycles) = match kind {
        Arithmetic::Add => (operations::add(a, b, status), 1),
        Arithmetic::Subtract => (operations::subtract(a, b, status), 1),
        Arithmetic::Multiply => (operations::multiply(a, b, status), 1),
        Arithmetic::NegatedMultiply => (operations::multiply(a, b, status) ^ SIGN, 1),
        Arithmetic::Divide => (operations::divide(a, b, status), 14),
        Arithmetic::Accumulate { minus_product, minus_addend } => {
            let product = operations::multiply(a, b, status) ^ sign_if(minus_product);
            (operations::add(old ^ sign_if(minus_addend), product, status), 3)
        }
        Arithmetic::Fused { minus_product, minus_addend } => {
            let (addend, a) = (old ^ sign_if(minus_addend), a ^ sign_if(minus_product));
            (operations::multiply_add(addend, a, b, status), 3)
        }
    };
    set(registers, d, result);
    cycles
}

/// `old` is what the destination holds.
fn unary(kind: Unary, old: u32, x: u32, status: &mut u32) -> u32 {
    match kind {
        Unary::Copy => x,
        Unary::Absolute => x & !(1 << 31),
        Unary::Negate => x ^ 1 << 31,
        Unary::SquareRoot => operations::square_root(x, status),
        Unary::FromHalf { top } => {
            let half = if top { x >> 16 } else { x & 0xFFFF };
            convert::half_to_single(half, status)
        }
        Unary::ToHalf { top } => {
            let half = convert::single_to_half(x, status);
            if top {
                old & 0xFFFF | half << 16
            } else {
                old & 0xFFFF_0000 | half
            }
        }
        Unary::FromInteger { signed } => convert::from_integer(x, signed, status),
        Unary::ToInteger { signed, truncate } => convert::to_integer(x, signed, truncate, status),
        Unary::FromFixed(fixed) => convert::from_fixed(x, fixed, status),
        Unary::ToFixed(fixed) => convert::to_fixed(x, fixed, status),
    }
}
