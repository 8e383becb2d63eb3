//! Executes 32-bit register arithmetic: all instructions whose first half-word is 0xFA00–0xFBFF.
//! These are shifts by register, extensions, parallel and saturating arithmetic, SEL, REV, CLZ, and
//! all multiplications and divisions.
//!
//! In: a decoded `Op` and the registers. Out: registers, Q, GE, flags, cycles. No instruction here
//! accesses memory, R13 or R15.

mod decode;
mod divide;
mod multiply;
mod parallel;
#[cfg(test)]
mod tests;

use super::registers::flag;
use super::system::ccr;
use super::{Cpu, Fault, Registers, TrapResult};
pub use decode::decode;
pub use multiply::{LongMultiply, Multiply};
pub use parallel::{Lanes, Prefix};

/// Numbers of destination and operand registers, 0–12 and 14.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThreeRegisters {
    /// Destination register.
    pub d: u8,
    /// Register with the first operand.
    pub n: u8,
    /// Register with the second operand.
    pub m: u8,
}

/// Kind of a shift by a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shift {
    Left,       // Logical shift left
    Right,      // Logical shift right
    Arithmetic, // Arithmetic shift right
    Rotate,     // Rotation right
}

/// Part of a register that is extended to 32 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extend {
    SignedByte,    // A byte, with its sign
    UnsignedByte,  // A byte, with zeros
    SignedHalf,    // A half-word, with its sign
    UnsignedHalf,  // A half-word, with zeros
    SignedBytes,   // Bytes 0 and 2, each to a half-word, with its sign
    UnsignedBytes, // Bytes 0 and 2, each to a half-word, with zeros
}

/// Reversal of bits or bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reverse {
    Word,       // REV: bytes of the word
    Halves,     // REV16: bytes of each half-word
    Bits,       // RBIT: all bits
    SignedHalf, // REVSH: bytes of the lower half-word, sign-extended
}

/// Word arithmetic that saturates and sets Q.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Saturating {
    Add,            // QADD
    DoubleAdd,      // QDADD: the second addend is doubled, with saturation
    Subtract,       // QSUB
    DoubleSubtract, // QDSUB: the subtrahend is doubled, with saturation
}

/// A decoded 32-bit instruction of register arithmetic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum Op {
    /// LSL, LSR, ASR, ROR by register, 32-bit encodings: `n` is shifted by the lowest byte of `m`;
    /// the S form sets N, Z, C.
    Shift { kind: Shift, flags: bool, registers: ThreeRegisters },
    /// SXTB … UXTAH: `m`, rotated right by 0, 8, 16 or 24 bits, is extended; `n` is added unless it
    /// is [`NONE`].
    Extend { kind: Extend, rotation: u8, registers: ThreeRegisters },
    Parallel(Prefix, Lanes, ThreeRegisters), // SADD16 … UHSUB8
    Saturating(Saturating, ThreeRegisters), // QADD, QDADD, QSUB, QDSUB
    Reverse(Reverse, ThreeRegisters), // REV, REV16, RBIT, REVSH of `m`
    Select(ThreeRegisters), // SEL: bytes of `n` or `m` by the GE flags
    CountLeadingZeros(ThreeRegisters), // CLZ of `m`
    /// Multiplications whose result is one register; `a` is the accumulator or [`NONE`].
    Multiply { kind: Multiply, registers: ThreeRegisters, a: u8 },
    /// Multiplications whose result is two registers: `low`, and `d` for the upper word.
    Long { kind: LongMultiply, registers: ThreeRegisters, low: u8 },
    SignedDivide(ThreeRegisters), // SDIV
    UnsignedDivide(ThreeRegisters), // UDIV
}

/// Register number that means that there is no accumulator.
pub const NONE: u8 = 15;

impl Cpu {
    /// Executes an instruction whose condition has passed. Returns its cycles without pipeline
    /// effects; divisions may end early (TRM table 3-1).
    ///
    /// # Errors
    /// Returns [`Fault::DivideByZero`] if CCR.DIV_0_TRP is set and the divisor is zero.
    #[inline]
    pub(super) fn execute_arithmetic(&mut self, op: Op) -> TrapResult<u32> {
        let by_zero = |m: u8| self.registers.r[usize::from(m & 15)] == 0;
        if let Op::SignedDivide(x) | Op::UnsignedDivide(x) = op
            && by_zero(x.m)
            && self.system.is_configured(ccr::DIVIDE_BY_ZERO_TRAP)
        {
            return Err(Fault::DivideByZero.into());
        }
        Ok(execute(op, &mut self.registers))
    }
}

/// Applies `op` to the registers, and returns its cycles; a division by zero gives 0.
#[rustfmt::skip]
fn execute(op: Op, registers: &mut Registers) -> u32 {
    match op {
        Op::Shift { kind, flags, registers: x } => shift(kind, flags, x, registers),
        Op::Extend { kind, rotation, registers: x } => {
            let part = extend(kind, get(registers, x.m).rotate_right(u32::from(rotation)));
            let sum = accumulate(kind, get_or_zero(registers, x.n), part);
            set(registers, x.d, sum);
        }
        Op::Parallel(prefix, lanes, x) => {
            let (a, b) = (get(registers, x.n), get(registers, x.m));
            let (result, ge) = parallel::compute(prefix, lanes, a, b);
            set(registers, x.d, result);
            if let Some(ge) = ge {
                registers.apsr = registers.apsr & !flag::GE | ge << 16;
            }
        }
        Op::Saturating(kind, x) => {
            let (result, saturated) = saturating(kind, get(registers, x.n), get(registers, x.m));
            set(registers, x.d, result);
            set_q_flag(registers, saturated);
        }
        Op::Reverse(kind, x) => set(registers, x.d, reverse(kind, get(registers, x.m))),
        Op::Select(x) => {
            let mask = parallel::byte_mask(registers.apsr >> 16 & 0xF);
            let selected = get(registers, x.n) & mask | get(registers, x.m) & !mask;
            set(registers, x.d, selected);
        }
        Op::CountLeadingZeros(x) => set(registers, x.d, get(registers, x.m).leading_zeros()),
        Op::Multiply { kind, registers: x, a } => return multiply::short(kind, x, a, registers),
        Op::Long { kind, registers: x, low } => multiply::long(kind, x, low, registers),
        Op::SignedDivide(x) => return divide::signed(x, registers),
        Op::UnsignedDivide(x) => return divide::unsigned(x, registers),
    }
    1
}

#[inline]
fn get(registers: &Registers, number: u8) -> u32 {
    registers.r[usize::from(number & 15)]
}

#[inline]
fn get_or_zero(registers: &Registers, number: u8) -> u32 {
    if number == NONE {
        0
    } else {
        get(registers, number)
    }
}

#[inline]
fn set(registers: &mut Registers, number: u8, value: u32) {
    registers.r[usize::from(number & 15)] = value;
}

/// Sets the sticky flag Q in APSR if a result was `saturated`.
#[inline]
fn set_q_flag(registers: &mut Registers, saturated: bool) {
    if saturated {
        registers.apsr |= flag::Q;
    }
}

/// Shifts by a register; amounts of 32 and more are valid (Arm ARM A2.2.1).
fn shift(kind: Shift, flags: bool, x: ThreeRegisters, registers: &mut Registers) {
    let (value, amount) = (get(registers, x.n), get(registers, x.m) & 0xFF);
    let carry_in = registers.apsr & flag::C != 0;
    let bit = |n: u32| value.checked_shr(n).unwrap_or(0) & 1 != 0;
    let (result, carry) = match (kind, amount) {
        (_, 0) => (value, carry_in),
        (Shift::Left, n) => (
            value.checked_shl(n).unwrap_or(0),
            n <= 32 && bit(32u32.wrapping_sub(n)),
        ),
        (Shift::Right, n) => (value.checked_shr(n).unwrap_or(0), bit(n - 1)),
        (Shift::Arithmetic, n) => {
            let signed = value as i32;
            (
                (signed >> n.min(31)) as u32,
                signed >> (n - 1).min(31) & 1 != 0,
            )
        }
        (Shift::Rotate, n) => {
            let rotated = value.rotate_right(n & 31);
            (rotated, rotated >> 31 != 0)
        }
    };
    set(registers, x.d, result);
    if flags {
        let mut apsr = registers.apsr & !(flag::N | flag::Z | flag::C) | result & flag::N;
        apsr |= if result == 0 { flag::Z } else { 0 };
        registers.apsr = apsr | if carry { flag::C } else { 0 };
    }
}

const fn extend(kind: Extend, x: u32) -> u32 {
    match kind {
        Extend::SignedByte => x as u8 as i8 as u32,
        Extend::UnsignedByte => x & 0xFF,
        Extend::SignedHalf => x as u16 as i16 as u32,
        Extend::UnsignedHalf => x & 0xFFFF,
        Extend::UnsignedBytes => x & 0x00FF_00FF,
        Extend::SignedBytes => {
            let (low, high) = (x as u8 as i8 as u32, (x >> 16) as u8 as i8 as u32);
            low & 0xFFFF | high << 16
        }
    }
}

/// Adds the extended value `b` to `a`. SXTAB16 and UXTAB16 add the half-words separately.
const fn accumulate(kind: Extend, a: u32, b: u32) -> u32 {
    match kind {
        Extend::SignedBytes | Extend::UnsignedBytes => {
            let low = a.wrapping_add(b) & 0xFFFF;
            low | (a >> 16).wrapping_add(b >> 16) << 16
        }
        _ => a.wrapping_add(b),
    }
}

/// Computes QADD and similar operations on Rm and Rn; the doubled operand is Rn. Returns the
/// result, and whether it saturated.
fn saturating(kind: Saturating, n: u32, m: u32) -> (u32, bool) {
    let (n, m) = (n as i32, m as i32);
    let doubled = n.saturating_mul(2);
    let overflowed = n.checked_mul(2).is_none();
    let (result, exact, before) = match kind {
        Saturating::Add => (m.saturating_add(n), m.checked_add(n), false),
        Saturating::DoubleAdd => (
            m.saturating_add(doubled),
            m.checked_add(doubled),
            overflowed,
        ),
        Saturating::Subtract => (m.saturating_sub(n), m.checked_sub(n), false),
        Saturating::DoubleSubtract => (
            m.saturating_sub(doubled),
            m.checked_sub(doubled),
            overflowed,
        ),
    };
    (result as u32, exact.is_none() || before)
}

const fn reverse(kind: Reverse, x: u32) -> u32 {
    match kind {
        Reverse::Word => x.swap_bytes(),
        Reverse::Halves => x.swap_bytes().rotate_right(16),
        Reverse::Bits => x.reverse_bits(),
        Reverse::SignedHalf => (x as u16).swap_bytes() as i16 as u32,
    }
}
