//! Floating-point unit (FPv4-SP).
//!
//! It executes the instructions for coprocessors 10 and 11, whose first half-word is 0xEC00–0xEFFF
//! or 0xFC00–0xFFFF.
//!
//! `decode` decodes them, `number` unpacks and rounds numbers in integer arithmetic, `operations`
//! and `convert` compute with these, and `transfer` loads and stores. The input is a decoded `Op`
//! with the registers and the bus; the output is the registers, FPSCR and the number of cycles.

mod convert;
mod decode;
mod number;
mod operations;
#[cfg(test)]
mod tests;
mod transfer;

use super::registers::flag;
use super::{Bus, Cpu, Registers, TrapResult};
pub use convert::Fixed;
pub use decode::decode;
pub use transfer::{Transfer, Writeback};

/// Bits of FPSCR (Arm ARM A2.5.3).
pub(crate) mod fpscr {
    pub const NZCV: u32 = 0xF << 28; // Flags N, Z, C, V of the last comparison
    /// Half-precision numbers use the alternative format, which has no infinities and NaNs.
    pub const AHP: u32 = 1 << 26;
    pub const DN: u32 = 1 << 25; // A result that is NaN is always the default NaN
    pub const FZ: u32 = 1 << 24; // Denormal numbers are flushed to zero
    pub const RMODE: u32 = 3 << 22; // Rounding mode: 0 nearest, 1 up, 2 down, 3 towards zero
    pub const IDC: u32 = 1 << 7; // A denormal input was flushed
    pub const IXC: u32 = 1 << 4; // A result was inexact
    pub const UFC: u32 = 1 << 3; // A result underflowed
    pub const OFC: u32 = 1 << 2; // A result overflowed
    pub const DZC: u32 = 1 << 1; // A finite number was divided by zero
    pub const IOC: u32 = 1; // An operation was invalid
    /// All implemented bits; the others read 0.
    pub const ALL: u32 = NZCV | AHP | DN | FZ | RMODE | IDC | IXC | UFC | OFC | DZC | IOC;
}

/// An arithmetic operation on two or three registers.
///
/// `minus_product` negates the product (of a fused operation: the first factor), and
/// `minus_addend` negates the accumulator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum Arithmetic {
    Add, // VADD
    Subtract, // VSUB
    Multiply, // VMUL
    NegatedMultiply, // VNMUL
    Divide, // VDIV
    /// VMLA, VMLS, VNMLA, VNMLS: the product and the sum are both rounded.
    Accumulate { minus_product: bool, minus_addend: bool },
    /// VFMA, VFMS, VFNMA, VFNMS: only the sum is rounded.
    Fused { minus_product: bool, minus_addend: bool },
}

/// An operation on one register: a copy, a change of sign, a square root or a conversion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum Unary {
    Copy, // VMOV
    Absolute, // VABS
    Negate, // VNEG
    SquareRoot, // VSQRT
    FromHalf { top: bool }, // VCVTB, VCVTT: lower or upper half-word to single precision
    ToHalf { top: bool }, // VCVTB, VCVTT to half precision; keeps the other half-word
    FromInteger { signed: bool }, // VCVT, rounded in the mode of FPSCR
    ToInteger { signed: bool, truncate: bool }, // VCVT: towards zero; VCVTR: mode of FPSCR
    FromFixed(Fixed), // VCVT, rounded to nearest
    ToFixed(Fixed), // VCVT, rounded towards zero
}

/// A decoded floating-point instruction.
///
/// `s`, `d`, `n` and `m` are numbers of S registers (a D register consists of two of them), and
/// `t` and `t2` are numbers of core registers. `half` means that the instruction names half a
/// D register instead of an S register, which takes one cycle instead of two (TRM table 7-1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum Op {
    Arithmetic(Arithmetic, u8, u8, u8), // d = n op m
    Unary(Unary, u8, u8), // d = op m
    Constant(u8, u32), // VMOV of a constant (register, value)
    /// VCMP, or VCMPE if `signal`: compares `d` with `m`, or with +0 if `m` is `None`. For
    /// VCMPE, a quiet NaN is an invalid operation too.
    Compare { d: u8, m: Option<u8>, signal: bool },
    FromCore { s: u8, t: u8, half: bool }, // VMOV from `t` to `s`
    ToCore { s: u8, t: u8, half: bool }, // VMOV from `s` to `t`
    FromCorePair { s: u8, t: u8, t2: u8 }, // VMOV from `t` and `t2` to `s` and `s` + 1
    ToCorePair { s: u8, t: u8, t2: u8 }, // VMOV from `s` and `s` + 1 to `t` and `t2`
    ReadStatus(u8), // VMRS from FPSCR
    ReadFlags, // VMRS from the flags of FPSCR to APSR
    WriteStatus(u8), // VMSR to FPSCR
    Load(Transfer), // VLDR, VLDM, VPOP
    Store(Transfer), // VSTR, VSTM, VPUSH
}

impl Cpu {
    /// Executes a floating-point instruction whose condition has passed; calls [`Self::prepare_fp`]
    /// first.
    ///
    /// Returns the number of cycles without pipeline effects (TRM table 7-1).
    #[inline]
    pub(super) fn execute_fpu(&mut self, bus: &mut impl Bus, op: Op) -> TrapResult<u32> {
        self.prepare_fp(bus)?;
        match op {
            Op::Load(transfer) => self.load_singles(bus, transfer),
            Op::Store(transfer) => self.store_singles(bus, transfer),
            _ => Ok(execute(op, &mut self.registers)),
        }
    }
}

/// Returns the bits in S register `number`, of which the lowest five bits count.
#[inline]
fn get(registers: &Registers, number: u8) -> u32 {
    registers.s[usize::from(number & 31)]
}

/// Sets S register `number`, of which the lowest five bits count, to the bits `value`.
#[inline]
fn set(registers: &mut Registers, number: u8, value: u32) {
    registers.s[usize::from(number & 31)] = value;
}

/// Returns the place of core register `number`, of which the lowest four bits count.
#[inline]
fn core(registers: &mut Registers, number: u8) -> &mut u32 {
    &mut registers.r[usize::from(number & 15)]
}

/// Executes `op` unless it accesses memory, and returns its number of cycles.
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
        // `execute_fpu` executes these itself.
        Op::Load(_) | Op::Store(_) => {}
    }
    1
}

/// Executes an arithmetic operation, and returns its number of cycles.
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

/// Returns the result of an operation on `x`. `old` is the previous value of the destination.
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
