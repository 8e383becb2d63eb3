//! Decodes 32-bit register arithmetic (Arm ARM A5.3.12–A5.3.17).

use super::{
    Extend, Lanes, LongMultiply, Multiply, NONE, Op, Prefix, Reverse, Saturating, Shift,
    ThreeRegisters,
};

/// Decodes an instruction; returns `None` if the architecture leaves it UNDEFINED or UNPREDICTABLE.
pub fn decode(first: u16, second: u16) -> Option<Op> {
    let registers = ThreeRegisters {
        d: (second >> 8 & 15) as u8,
        n: (first & 15) as u8,
        m: (second & 15) as u8,
    };
    let top = (second >> 12) as u8;
    match first >> 7 {
        0x1F4 => shift_or_extend(first, second, top, registers),
        0x1F5 => parallel_or_other(first, second, top, registers),
        0x1F6 => short(first, second, top, registers),
        0x1F7 => long_or_divide(first, second, top, registers),
        _ => None,
    }
}

/// Returns whether the register is neither the stack pointer nor the program counter.
const fn is_general(register: u8) -> bool {
    register != 13 && register != 15
}

const fn are_general(x: ThreeRegisters) -> bool {
    is_general(x.d) && is_general(x.n) && is_general(x.m)
}

#[rustfmt::skip]
fn shift_or_extend(first: u16, second: u16, top: u8, x: ThreeRegisters) -> Option<Op> {
    if top != 15 {
        return None;
    }
    let op = first >> 4 & 7;
    if second & 0xF0 == 0 {
        let kind = match op >> 1 {
            0 => Shift::Left,
            1 => Shift::Right,
            2 => Shift::Arithmetic,
            _ => Shift::Rotate,
        };
        let flags = op & 1 != 0;
        return are_general(x).then_some(Op::Shift { kind, flags, registers: x });
    }
    let kind = match (second & 0xC0 == 0x80, op) {
        (true, 0) => Extend::SignedHalf,
        (true, 1) => Extend::UnsignedHalf,
        (true, 2) => Extend::SignedBytes,
        (true, 3) => Extend::UnsignedBytes,
        (true, 4) => Extend::SignedByte,
        (true, 5) => Extend::UnsignedByte,
        _ => return None,
    };
    (is_general(x.d) && is_general(x.m) && x.n != 13).then_some(Op::Extend {
        kind,
        rotation: (second >> 4 & 3) as u8 * 8,
        registers: x,
    })
}

fn parallel_or_other(first: u16, second: u16, top: u8, x: ThreeRegisters) -> Option<Op> {
    if top != 15 || !are_general(x) {
        return None;
    }
    let (op, sub) = (first >> 4 & 7, second >> 4 & 15);
    if sub >= 8 {
        return other(op, sub, x);
    }
    let prefix = match sub {
        0 => Prefix::Signed,
        1 => Prefix::SignedSaturating,
        2 => Prefix::SignedHalving,
        4 => Prefix::Unsigned,
        5 => Prefix::UnsignedSaturating,
        6 => Prefix::UnsignedHalving,
        _ => return None,
    };
    let lanes = match op {
        0 => Lanes::AddBytes,
        1 => Lanes::AddHalves,
        2 => Lanes::AddSubtractExchanged,
        4 => Lanes::SubtractBytes,
        5 => Lanes::SubtractHalves,
        6 => Lanes::SubtractAddExchanged,
        _ => return None,
    };
    Some(Op::Parallel(prefix, lanes, x))
}

/// Decodes miscellaneous operations. `op` is bits 6:4 of the first half-word, `sub` bits 7:4 of the
/// second.
fn other(op: u16, sub: u16, x: ThreeRegisters) -> Option<Op> {
    // The operand is encoded twice; different values are UNPREDICTABLE.
    let twice = x.n == x.m;
    let saturating = |kind| Some(Op::Saturating(kind, x));
    let reverse = |kind| twice.then_some(Op::Reverse(kind, x));
    match (op, sub & 7) {
        (0, 0) => saturating(Saturating::Add),
        (0, 1) => saturating(Saturating::DoubleAdd),
        (0, 2) => saturating(Saturating::Subtract),
        (0, 3) => saturating(Saturating::DoubleSubtract),
        (1, 0) => reverse(Reverse::Word),
        (1, 1) => reverse(Reverse::Halves),
        (1, 2) => reverse(Reverse::Bits),
        (1, 3) => reverse(Reverse::SignedHalf),
        (2, 0) => Some(Op::Select(x)),
        (3, 0) => twice.then_some(Op::CountLeadingZeros(x)),
        _ => None,
    }
}

#[rustfmt::skip]
fn short(first: u16, second: u16, a: u8, x: ThreeRegisters) -> Option<Op> {
    let (bit, sub) = (second >> 4 & 1 != 0, second >> 4 & 15);
    if sub > 3 || !are_general(x) || a == 13 {
        return None;
    }
    let kind = match (first >> 4 & 7, sub) {
        (0, 0) => Multiply::Low,
        (0, 1) if a != NONE => Multiply::Subtract,
        (1, _) => Multiply::Halves { n_top: sub & 2 != 0, m_top: bit },
        (2, 0 | 1) => Multiply::DualAdd { exchange: bit },
        (3, 0 | 1) => Multiply::WordByHalf { m_top: bit },
        (4, 0 | 1) => Multiply::DualSubtract { exchange: bit },
        (5, 0 | 1) => Multiply::High { round: bit },
        (6, 0 | 1) if a != NONE => Multiply::HighSubtract { round: bit },
        (7, 0) => Multiply::AbsoluteDifferences,
        _ => return None,
    };
    Some(Op::Multiply { kind, registers: x, a })
}

#[rustfmt::skip]
fn long_or_divide(first: u16, second: u16, low: u8, x: ThreeRegisters) -> Option<Op> {
    let (op, sub) = (first >> 4 & 7, second >> 4 & 15);
    if !are_general(x) {
        return None;
    }
    match (op, sub) {
        (1, 15) if low == 15 => return Some(Op::SignedDivide(x)),
        (3, 15) if low == 15 => return Some(Op::UnsignedDivide(x)),
        _ => {}
    }
    let bit = sub & 1 != 0;
    let kind = match (op, sub) {
        (0, 0) => LongMultiply::Signed,
        (2, 0) => LongMultiply::Unsigned,
        (4, 0) => LongMultiply::SignedAccumulate,
        (4, 8..=11) => LongMultiply::Halves { n_top: sub & 2 != 0, m_top: bit },
        (4, 12 | 13) => LongMultiply::DualAdd { exchange: bit },
        (5, 12 | 13) => LongMultiply::DualSubtract { exchange: bit },
        (6, 0) => LongMultiply::UnsignedAccumulate,
        (6, 6) => LongMultiply::UnsignedDoubleAccumulate,
        _ => return None,
    };
    (is_general(low) && low != x.d).then_some(Op::Long { kind, registers: x, low })
}
