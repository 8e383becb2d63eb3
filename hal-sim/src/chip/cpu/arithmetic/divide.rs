//! Divisions, and how long they take.

use super::{ThreeRegisters, get, set};
use crate::chip::cpu::Registers;

/// SDIV: rounds towards zero; by zero gives 0; -2^31 / -1 gives -2^31.
pub(super) fn signed(x: ThreeRegisters, registers: &mut Registers) -> u32 {
    let (n, m) = (get(registers, x.n) as i32, get(registers, x.m) as i32);
    let quotient = if m == 0 { 0 } else { n.wrapping_div(m) };
    set(registers, x.d, quotient as u32);
    cycles(n.unsigned_abs(), m.unsigned_abs())
}

/// UDIV: by zero gives 0.
pub(super) fn unsigned(x: ThreeRegisters, registers: &mut Registers) -> u32 {
    let (n, m) = (get(registers, x.n), get(registers, x.m));
    set(registers, x.d, n.checked_div(m).unwrap_or(0));
    cycles(n, m)
}

/// Cycles for these magnitudes.
///
/// Exact: between 2 and 12 (TRM table 3-1). Approximate: which. Arm says only
/// that it depends on the operands' leading ones and zeroes. Assumed here: 2 if
/// an operand is zero and 3 if the dividend has fewer significant bits than the
/// divisor, as a third party measured on this core; else 5 plus one for every
/// four bits of difference, our guess of four quotient bits a cycle, which ends
/// at Arm's 12. docs/hil.md is the way to know.
pub(super) const fn cycles(dividend: u32, divisor: u32) -> u32 {
    if dividend == 0 || divisor == 0 {
        return 2;
    }
    match divisor
        .leading_zeros()
        .checked_sub(dividend.leading_zeros())
    {
        None => 3,
        Some(difference) => 5 + difference / 4,
    }
}
