//! Executes divisions and computes their cycles.

use super::{ThreeRegisters, get, set};
use crate::chip::cpu::Registers;

/// Executes SDIV, and returns its number of cycles. SDIV rounds towards zero; division by zero
/// gives 0, and -2^31 / -1 gives -2^31.
pub(super) fn signed(x: ThreeRegisters, registers: &mut Registers) -> u32 {
    let (n, m) = (get(registers, x.n) as i32, get(registers, x.m) as i32);
    let quotient = if m == 0 { 0 } else { n.wrapping_div(m) };
    set(registers, x.d, quotient as u32);
    cycles(n.unsigned_abs(), m.unsigned_abs())
}

/// Executes UDIV, and returns its number of cycles. Division by zero gives 0.
pub(super) fn unsigned(x: ThreeRegisters, registers: &mut Registers) -> u32 {
    let (n, m) = (get(registers, x.n), get(registers, x.m));
    set(registers, x.d, n.checked_div(m).unwrap_or(0));
    cycles(n, m)
}

/// Returns the number of cycles of a division of operands with these magnitudes.
///
/// Exact: the range, 2 to 12 (TRM table 3-1). Approximate: the dependence on the operands, because
/// Arm says only that it depends on their leading ones and zeroes. The assumption is 2 if an
/// operand is zero, and 3 if the dividend has fewer significant bits than the divisor, as a third
/// party measured on this core; otherwise 5 plus one for every four bits of difference, our guess
/// of four quotient bits per cycle, which ends at Arm's 12. A measurement on a board (docs/evidence/hil.md)
/// would decide.
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
