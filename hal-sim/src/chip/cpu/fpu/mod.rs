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
use super::{Bus, Cpu, Registers, Trap};
pub use convert::Fixed;
pub use decode::decode;
pub use transfer::{Transfer, Writeback};

/// Bits of FPSCR (Arm ARM A2.5.3).
pub mod fpscr {
    /// N, Z, C, V of the last comparison.
    pub const NZCV: u32 = 0xF << 28;
    /// Half precision in the alternative format, without infinities and NaNs.
    pub const AHP: u32 = 1 << 26;
    /// Every NaN result is the default NaN.
    pub const DN: u32 = 1 << 25;
    /// Denormal numbers are flushed to zero.
    pub const FZ: u32 = 1 << 24;
    /// Rounding mode: 0 nearest, 1 up, 2 down, 3 towards zero.
    pub const RMODE: u32 = 3 << 22;
    /// A denormal input was flushed.
    pub const IDC: u32 = 1 << 7;
    /// Inexact.
    pub const IXC: u32 = 1 << 4;
    /// Underflow.
    pub const UFC: u32 = 1 << 3;
    /// Overflow.
    pub const OFC: u32 = 1 << 2;
    /// Division by zero.
    pub const DZC: u32 = 1 << 1;
    /// Invalid operation.
    pub const IOC: u32 = 1;
    /// The bits that exist.
    pub const ALL: u32 = NZCV | AHP | DN | FZ | RMODE | IDC | IXC | UFC | OFC | DZC | IOC;
}

/// Arithmetic on two or three registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arithmetic {
    /// VADD.
    Add,
    /// VSUB.
    Subtract,
    /// VMUL.
    Multiply,
    /// VNMUL.
    NegatedMultiply,
    /// VDIV.
    Divide,
    /// VMLA, VMLS, VNMLA, VNMLS: rounds twice.
    Accumulate {
        /// The product's sign is changed.
        minus_product: bool,
        /// The accumulator's sign is changed.
        minus_addend: bool,
    },
    /// VFMA, VFMS, VFNMA, VFNMS: rounds once.
    Fused {
        /// The first factor's sign is changed.
        minus_product: bool,
        /// The accumulator's sign is changed.
        minus_addend: bool,
    },
}

/// What is done to one register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unary {
    /// VMOV.
    Copy,
    /// VABS.
    Absolute,
    /// VNEG.
    Negate,
    /// VSQRT.
    SquareRoot,
    /// VCVTB, VCVTT to single precision.
    FromHalf {
        /// The upper half-word of the operand.
        top: bool,
    },
    /// VCVTB, VCVTT to half precision; the other half-word stays.
    ToHalf {
        /// Into the upper half-word.
        top: bool,
    },
    /// VCVT from an integer, rounded as FPSCR says.
    FromInteger {
        /// It has a sign.
        signed: bool,
    },
    /// VCVT, VCVTR to an integer.
    ToInteger {
        /// It has a sign.
        signed: bool,
        /// Towards zero, whatever FPSCR says.
        truncate: bool,
    },
    /// VCVT from fixed point, rounded to nearest.
    FromFixed(Fixed),
    /// VCVT to fixed point, towards zero.
    ToFixed(Fixed),
}

/// A decoded floating-point instruction. `s`, `d`, `n`, `m` are S registers,
/// a D register being two of them; `t` and `t2` core registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Op {
    /// d = n op m.
    Arithmetic(Arithmetic, u8, u8, u8),
    /// d = op m.
    Unary(Unary, u8, u8),
    /// VMOV of a constant to a register.
    Constant(u8, u32),
    /// VCMP, VCMPE of d with m, or with zero.
    Compare {
        /// First operand.
        d: u8,
        /// Second operand; `None`: +0.
        m: Option<u8>,
        /// A quiet NaN is an invalid operation, too (VCMPE).
        signal: bool,
    },
    /// VMOV of core register `t` to `s`.
    FromCore {
        /// Destination.
        s: u8,
        /// Core register.
        t: u8,
        /// Half a D register is named, not an S register: one cycle instead
        /// of two (TRM table 7-1).
        half: bool,
    },
    /// VMOV of `s` to core register `t`.
    ToCore {
        /// Source.
        s: u8,
        /// Core register.
        t: u8,
        /// As above.
        half: bool,
    },
    /// VMOV of two core registers to `s` and its successor.
    FromCorePair {
        /// First destination.
        s: u8,
        /// First core register.
        t: u8,
        /// Second core register.
        t2: u8,
    },
    /// VMOV of `s` and its successor to two core registers.
    ToCorePair {
        /// First source.
        s: u8,
        /// First core register.
        t: u8,
        /// Second core register.
        t2: u8,
    },
    /// VMRS of FPSCR to a core register.
    ReadStatus(u8),
    /// VMRS of FPSCR's flags to APSR.
    ReadFlags,
    /// VMSR.
    WriteStatus(u8),
    /// VLDR, VLDM, VPOP.
    Load(Transfer),
    /// VSTR, VSTM, VPUSH.
    Store(Transfer),
}

impl Cpu {
    /// Executes (the condition has passed), after `prepare_fp`, which it calls;
    /// gives its cycles without pipeline effects (TRM table 7-1).
    ///
    /// # Errors
    /// [`Trap`].
    #[inline]
    pub(super) fn execute_fpu<B: Bus>(&mut self, bus: &mut B, op: Op) -> Result<u32, Trap> {
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
        Arithmetic::Accumulate {
            minus_product,
            minus_addend,
        } => {
            let product = operations::multiply(a, b, status) ^ sign_if(minus_product);
            (
                operations::add(old ^ sign_if(minus_addend), product, status),
                3,
            )
        }
        Arithmetic::Fused {
            minus_product,
            minus_addend,
        } => {
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
