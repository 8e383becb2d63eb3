//! Decodes 32-bit data processing: shifted register, modified and plain immediates (Arm ARM A5.3.1,
//! A5.3.3, A5.3.11).

use super::fields::{WideCode, is_bad};
use crate::chip::cpu::instruction::{Alu, CarryOut, Op, Reg, Shift, ShiftKind, Test};

/// Decodes the shift that `kind` and `imm5` encode (DecodeImmShift).
pub const fn shift(kind: u16, imm5: u8) -> Shift {
    let (kind, amount) = match (kind & 3, imm5) {
        (0, _) => (ShiftKind::Lsl, imm5),
        (1, 0) => (ShiftKind::Lsr, 32),
        (1, _) => (ShiftKind::Lsr, imm5),
        (2, 0) => (ShiftKind::Asr, 32),
        (2, _) => (ShiftKind::Asr, imm5),
        (_, 0) => (ShiftKind::Rrx, 1),
        (_, _) => (ShiftKind::Ror, imm5),
    };
    Shift { kind, amount }
}

/// Returns the operation Rd = Rn + imm without flags.
pub const fn add_imm(d: Reg, n: Reg, imm: u32) -> Op {
    if d == 13 {
        Op::AddToSp { n, imm }
    } else {
        Op::AddImm { d, n, imm }
    }
}

/// Returns the operation Rd = Rn + Rm without flags.
#[rustfmt::skip]
pub const fn add_reg(d: Reg, n: Reg, m: Reg) -> Op {
    if d != 13 {
        return Op::AddReg { d, n, m };
    }
    Op::DataReg { alu: Alu::Add, flags: false, d, n, m, shift: Shift::NONE }
}

/// Decodes the operation of data processing, which has the same place in the forms with register
/// and immediate. The second part is `Some` if the instruction only sets flags.
fn operation(code: WideCode) -> Option<(Alu, Option<Test>)> {
    let number = code.first(5, 4);
    let flags = code.first & 0x10 != 0;
    let test = |test| (code.d() == 15 && flags).then_some(test);
    Some(match number {
        0 => (Alu::And, test(Test::Tst)),
        1 => (Alu::Bic, None),
        2 if code.n() == 15 => (Alu::Mov, None),
        2 => (Alu::Orr, None),
        3 if code.n() == 15 => (Alu::Mvn, None),
        3 => (Alu::Orn, None),
        4 => (Alu::Eor, test(Test::Teq)),
        8 => (Alu::Add, test(Test::Cmn)),
        10 => (Alu::Adc, None),
        11 => (Alu::Sbc, None),
        13 => (Alu::Sub, test(Test::Cmp)),
        14 => (Alu::Rsb, None),
        _ => return None,
    })
}

/// Returns whether the architecture defines the result for these registers.
fn is_predictable(alu: Alu, test: Option<Test>, code: WideCode) -> bool {
    let (d, n) = (code.d(), code.n());
    match (alu, test) {
        (_, Some(Test::Cmn | Test::Cmp)) => n != 15,
        (_, Some(_)) => !is_bad(n),
        (Alu::Mov | Alu::Mvn, None) => !is_bad(d),
        // ADD and SUB may have the stack pointer as first operand; their result may be the stack
        // pointer only with that operand.
        (Alu::Add | Alu::Sub, None) => n != 15 && d != 15 && (d != 13 || n == 13),
        (_, None) => !is_bad(d) && !is_bad(n),
    }
}

/// Decodes data processing with a shifted register (A5.3.11).
#[rustfmt::skip]
pub fn shifted_register(code: WideCode) -> Op {
    if code.first(5, 4) == 6 {
        return pack(code);
    }
    let Some((alu, test)) = operation(code) else {
        return Op::Undefined;
    };
    let (d, n, m) = (code.d(), code.n(), code.m());
    let flags = code.first & 0x10 != 0;
    let amount = code.second(12, 3) << 2 | code.second(6, 2);
    let shift = shift(code.second >> 4, amount);
    let plain = shift == Shift::NONE;
    if alu == Alu::Mov && plain && !flags {
        return move_register(d, m);
    }
    if !is_predictable(alu, test, code) || is_bad(m) || code.second & 0x8000 != 0 {
        return Op::Unpredictable;
    }
    match (alu, test) {
        (_, Some(Test::Cmp)) if plain => Op::CmpReg { n, m },
        (_, Some(test)) => Op::TestReg { test, n, m, shift },
        (Alu::Mov, _) if !plain => Op::ShiftImm { flags, d, m, shift },
        (Alu::Add, _) if plain && !flags => add_reg(d, n, m),
        (Alu::Add, _) if plain && d != 13 => Op::AddsReg { d, n, m },
        (Alu::Sub, _) if plain && flags && d != 13 => Op::SubsReg { d, n, m },
        _ => Op::DataReg { alu, flags, d, n, m, shift },
    }
}

/// Decodes MOV (register) T3: at most one of the two registers may be the stack pointer.
const fn move_register(d: Reg, m: Reg) -> Op {
    match (d, m) {
        (15, _) | (_, 15) | (13, 13) => Op::Unpredictable,
        (13, _) => Op::AddToSp { n: m, imm: 0 },
        _ => Op::MovReg { d, m },
    }
}

/// Decodes PKHBT and PKHTB.
#[rustfmt::skip]
fn pack(code: WideCode) -> Op {
    let (d, n, m) = (code.d(), code.n(), code.m());
    if code.first & 0x10 != 0 || code.second & 0x10 != 0 {
        return Op::Undefined;
    }
    if is_bad(d) || is_bad(n) || is_bad(m) {
        return Op::Unpredictable;
    }
    Op::Pkh {
        top: code.second & 0x20 != 0,
        d,
        n,
        m,
        shift: shift(code.second >> 4 & 2, code.second(12, 3) << 2 | code.second(6, 2)),
    }
}

/// Returns the 12 bits of an immediate, which are spread over the fields i, imm3 and imm8.
const fn imm12(code: WideCode) -> u32 {
    (code.first(10, 1) as u32) << 11
        | (code.second(12, 3) as u32) << 8
        | (code.second & 0xFF) as u32
}

/// Expands a modified immediate (ThumbExpandImm_C, A5.3.2); returns `None` if it is UNPREDICTABLE.
pub const fn expand(imm12: u32) -> Option<(u32, CarryOut)> {
    let byte = imm12 & 0xFF;
    if imm12 >> 10 != 0 {
        let value = (0x80 | imm12 & 0x7F).rotate_right(imm12 >> 7);
        let carry = if value >> 31 != 0 {
            CarryOut::Set
        } else {
            CarryOut::Clear
        };
        return Some((value, carry));
    }
    let value = match imm12 >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        _ => byte << 24 | byte << 16 | byte << 8 | byte,
    };
    if imm12 >> 8 != 0 && byte == 0 {
        return None;
    }
    Some((value, CarryOut::Kept))
}

/// Decodes data processing with a modified immediate (A5.3.1).
#[rustfmt::skip]
pub fn modified_immediate(code: WideCode) -> Op {
    let Some((alu, test)) = operation(code) else {
        return Op::Undefined;
    };
    let Some((imm, carry)) = expand(imm12(code)) else {
        return Op::Unpredictable;
    };
    if !is_predictable(alu, test, code) {
        return Op::Unpredictable;
    }
    let flags = code.first & 0x10 != 0;
    let (d, n) = (code.d(), code.n());
    match (alu, test) {
        (_, Some(Test::Cmp)) => Op::CmpImm { n, imm },
        (_, Some(test)) => Op::TestImm { test, carry, n, imm },
        (Alu::Mov, _) if !flags => Op::MovImm { d, imm },
        (Alu::Mov, _) => Op::MovsImm { d, carry, imm },
        (Alu::Mvn, _) if !flags => Op::MovImm { d, imm: !imm },
        (Alu::Mvn, _) => Op::MovsImm { d, carry, imm: !imm },
        (Alu::Add, _) if !flags => add_imm(d, n, imm),
        (Alu::Sub, _) if !flags => add_imm(d, n, imm.wrapping_neg()),
        (Alu::Add, _) if d != 13 => Op::AddsImm { d, n, imm },
        (Alu::Sub, _) if d != 13 => Op::SubsImm { d, n, imm },
        _ => Op::DataImm { alu, flags, carry, d, n, imm },
    }
}

/// Decodes data processing with a plain immediate (A5.3.3).
#[rustfmt::skip]
pub fn plain_immediate(code: WideCode) -> Op {
    let (d, n) = (code.d(), code.n());
    let imm = imm12(code);
    let imm16 = u32::from(code.first & 0xF) << 12 | imm;
    if d == 15 {
        return Op::Unpredictable;
    }
    match code.first(4, 5) {
        0 | 10 if n == 15 && d == 13 => Op::Unpredictable,
        0 if n == 15 => Op::MovImm { d, imm: code.base().wrapping_add(imm) },
        10 if n == 15 => Op::MovImm { d, imm: code.base().wrapping_sub(imm) },
        0 | 10 if d == 13 && n != 13 => Op::Unpredictable,
        0 => add_imm(d, n, imm),
        10 => add_imm(d, n, imm.wrapping_neg()),
        _ if d == 13 => Op::Unpredictable,
        4 => Op::MovImm { d, imm: imm16 },
        12 => Op::Movt { d, imm: imm16 },
        16 | 18 | 24 | 26 => saturate(code),
        20 | 22 | 28 => bit_field(code),
        _ => Op::Undefined,
    }
}

/// Decodes SSAT, USAT, SSAT16 and USAT16.
#[rustfmt::skip]
fn saturate(code: WideCode) -> Op {
    let (d, n) = (code.d(), code.n());
    if is_bad(n) {
        return Op::Unpredictable;
    }
    let amount = code.second(12, 3) << 2 | code.second(6, 2);
    let arithmetic = code.first & 0x20 != 0;
    let unsigned = code.first & 0x80 != 0;
    let bits = code.second(0, 5);
    if arithmetic && amount == 0 {
        return match unsigned {
            _ if code.second & 0x30 != 0 => Op::Undefined,
            false => Op::Ssat16 { d, n, bits: (bits & 0xF) + 1 },
            true => Op::Usat16 { d, n, bits: bits & 0xF },
        };
    }
    let shift = shift(if arithmetic { 2 } else { 0 }, amount);
    if unsigned {
        Op::Usat { d, n, bits, shift }
    } else {
        Op::Ssat { d, n, bits: bits + 1, shift }
    }
}

/// Decodes SBFX, UBFX, BFI and BFC.
fn bit_field(code: WideCode) -> Op {
    let (d, n) = (code.d(), code.n());
    let lsb = code.second(12, 3) << 2 | code.second(6, 2);
    let last = code.second(0, 5);
    if n == 13 {
        return Op::Unpredictable;
    }
    if code.first(4, 5) == 22 {
        let Some(width) = (last + 1).checked_sub(lsb).filter(|width| *width > 0) else {
            return Op::Unpredictable;
        };
        return if n == 15 {
            Op::Bfc { d, lsb, width }
        } else {
            Op::Bfi { d, n, lsb, width }
        };
    }
    let width = last + 1;
    if n == 15 || lsb + width > 32 {
        return Op::Unpredictable;
    }
    if code.first(4, 5) == 20 {
        Op::Sbfx { d, n, lsb, width }
    } else {
        Op::Ubfx { d, n, lsb, width }
    }
}
