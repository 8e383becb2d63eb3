//! Decodes floating-point instructions (Arm ARM A6.4–A6.7).

use super::{Arithmetic, Fixed, Op, Transfer, Unary, Writeback};

/// Decodes an instruction; returns `None` if FPv4-SP leaves it UNDEFINED or UNPREDICTABLE.
pub fn decode(first: u16, second: u16) -> Option<Op> {
    if second >> 9 & 7 != 0b101 {
        return None;
    }
    match first >> 8 {
        0xEE if second & 0x10 != 0 => one_core_register(first, second),
        0xEE => data(first, second),
        0xEC if first & 0xE0 == 0x40 => two_core_registers(first, second),
        0xEC | 0xED => transfer(first, second),
        _ => None,
    }
}

/// Returns whether the register is neither the stack pointer nor the program counter.
const fn is_general(register: u8) -> bool {
    register != 13 && register != 15
}

const fn is_double(second: u16) -> bool {
    second & 0x100 != 0
}

/// Returns the number of an S register: four bits of `bits` from bit `at` on and, as the lowest bit
/// of the number, bit `low` of `low_bits`.
const fn single(bits: u16, at: u32, low_bits: u16, low: u32) -> u8 {
    ((bits >> at & 15) << 1 | low_bits >> low & 1) as u8
}

/// Returns the number of the first of the two S registers of a D register: four bits of `bits` from
/// bit `at` on give D. The fifth bit, `high` of `high_bits`, must be zero, because there are 16 D
/// registers; otherwise returns `None`.
const fn double(bits: u16, at: u32, high_bits: u16, high: u32) -> Option<u8> {
    if high_bits >> high & 1 == 0 {
        Some((bits >> at & 15) as u8 * 2)
    } else {
        None
    }
}

#[rustfmt::skip]
fn data(first: u16, second: u16) -> Option<Op> {
    if is_double(second) {
        return None;
    }
    let d = single(second, 12, first, 6);
    let n = single(first, 0, second, 7);
    let m = single(second, 0, second, 5);
    let minus = second & 0x40 != 0;
    let choose = |no, yes| if minus { yes } else { no };
    let kind = match (first >> 7 & 1, first >> 4 & 3) {
        (0, 0) => Arithmetic::Accumulate { minus_product: minus, minus_addend: false },
        (0, 1) => Arithmetic::Accumulate { minus_product: minus, minus_addend: true },
        (0, 2) => choose(Arithmetic::Multiply, Arithmetic::NegatedMultiply),
        (0, _) => choose(Arithmetic::Add, Arithmetic::Subtract),
        (_, 0) if minus => return None,
        (_, 0) => Arithmetic::Divide,
        (_, 1) => Arithmetic::Fused { minus_product: minus, minus_addend: true },
        (_, 2) => Arithmetic::Fused { minus_product: minus, minus_addend: false },
        _ => return one_operand(first, second, d, m),
    };
    Some(Op::Arithmetic(kind, d, n, m))
}

/// Decodes operations on one register: bit 7 of `second` and four bits of `first` select the
/// operation.
#[rustfmt::skip]
fn one_operand(first: u16, second: u16, d: u8, m: u8) -> Option<Op> {
    let (high, sub) = (second & 0x80 != 0, first & 15);
    if second & 0x40 == 0 {
        let imm8 = (sub << 4 | second & 15) as u8;
        return (second & 0xA0 == 0).then_some(Op::Constant(d, constant(imm8)));
    }
    let kind = match (sub, high) {
        (0, false) => Unary::Copy,
        (0, true) => Unary::Absolute,
        (1, false) => Unary::Negate,
        (1, true) => Unary::SquareRoot,
        (2, top) => Unary::FromHalf { top },
        (3, top) => Unary::ToHalf { top },
        (4, signal) => {
            return Some(Op::Compare { d, m: Some(m), signal });
        }
        (5, signal) => {
            let m = None;
            return (second & 0x2F == 0).then_some(Op::Compare { d, m, signal });
        }
        (8, signed) => Unary::FromInteger { signed },
        (12 | 13, truncate) => Unary::ToInteger { signed: sub & 1 != 0, truncate },
        (10 | 11, _) => return Some(Op::Unary(Unary::FromFixed(fixed(first, second)?), d, d)),
        (14 | 15, _) => return Some(Op::Unary(Unary::ToFixed(fixed(first, second)?), d, d)),
        _ => return None,
    };
    Some(Op::Unary(kind, d, m))
}

/// Expands an immediate constant (VFPExpandImm): sign, three bits of exponent, four of fraction.
fn constant(imm8: u8) -> u32 {
    let imm = u32::from(imm8);
    let exponent = if imm & 0x40 == 0 { 0x80 } else { 0x7C };
    (imm & 0x80) << 24 | (exponent | imm >> 4 & 3) << 23 | (imm & 15) << 19
}

fn fixed(first: u16, second: u16) -> Option<Fixed> {
    let half_word = second & 0x80 == 0;
    let width = if half_word { 16 } else { 32 };
    let immediate = (second & 15) << 1 | second >> 5 & 1;
    Some(Fixed {
        signed: first & 1 == 0,
        half_word,
        fraction: u8::try_from(width - i32::from(immediate)).ok()?,
    })
}

/// Decodes VMOV between a core register and an S register or half a D register, VMRS and VMSR.
fn one_core_register(first: u16, second: u16) -> Option<Op> {
    let t = (second >> 12) as u8;
    let (to_core, selector) = (first & 0x10 != 0, first >> 5 & 7);
    if is_double(second) {
        // One word of D; `what` selects the half.
        let d = double(first, 0, second, 7)?;
        let s = d + (selector & 1) as u8;
        let is_word = selector <= 1 && second & 0x6F == 0;
        return (is_word && is_general(t)).then_some(core_move(to_core, s, t, true));
    }
    if second & 0x6F != 0 {
        return None;
    }
    match (selector, to_core) {
        (0, _) => {
            let s = single(first, 0, second, 7);
            is_general(t).then_some(core_move(to_core, s, t, false))
        }
        (7, _) if first & 15 != 1 || second & 0x80 != 0 => None,
        (7, true) if t == 15 => Some(Op::ReadFlags),
        (7, true) => is_general(t).then_some(Op::ReadStatus(t)),
        (7, false) => is_general(t).then_some(Op::WriteStatus(t)),
        _ => None,
    }
}

const fn core_move(to_core: bool, s: u8, t: u8, half: bool) -> Op {
    if to_core {
        Op::ToCore { s, t, half }
    } else {
        Op::FromCore { s, t, half }
    }
}

fn two_core_registers(first: u16, second: u16) -> Option<Op> {
    let (t, t2) = ((second >> 12) as u8, (first & 15) as u8);
    let to_core = first & 0x10 != 0;
    let s = if is_double(second) {
        double(second, 0, second, 5)?
    } else {
        single(second, 0, second, 5)
    };
    let allowed = is_general(t) && is_general(t2) && s < 31 && !(to_core && t == t2);
    (second & 0xD0 == 0x10 && allowed).then_some(if to_core {
        Op::ToCorePair { s, t, t2 }
    } else {
        Op::FromCorePair { s, t, t2 }
    })
}

#[rustfmt::skip]
fn transfer(first: u16, second: u16) -> Option<Op> {
    let (n, imm8) = ((first & 15) as u8, (second & 0xFF) as u8);
    let [before, up, writes, load] = [8, 7, 5, 4].map(|bit| first >> bit & 1 != 0);
    let s = if is_double(second) {
        double(second, 12, first, 6)?
    } else {
        single(second, 12, first, 6)
    };
    let bytes = i16::from(imm8) * 4;
    let (count, offset, writeback) = match (before, up, writes) {
        (true, _, false) => {
            let offset = if up { bytes } else { -bytes };
            let count = if is_double(second) { 2 } else { 1 };
            (count, offset, Writeback::None)
        }
        (false, true, false) => (imm8, 0, Writeback::None),
        (false, true, true) => (imm8, 0, Writeback::Up),
        (true, false, true) => (imm8, -bytes, Writeback::Down),
        _ => return None,
    };
    // Only VLDR may use the program counter; an odd number of words of D registers belongs to
    // another architecture.
    let from_code = before && !writes && load;
    let odd = is_double(second) && count % 2 != 0;
    let fits = count > 0 && u16::from(s) + u16::from(count) <= 32;
    if n == 15 && !from_code || odd || !fits {
        return None;
    }
    let transfer = Transfer { s, count, n, writeback, offset };
    Some(if load {
        Op::Load(transfer)
    } else {
        Op::Store(transfer)
    })
}
