//! Decodes 16-bit encodings (Arm ARM A5.2).

use crate::chip::cpu::Size;
use crate::chip::cpu::instruction::{
    Alu, CarryOut, Load, Op, Rearrange, Reg, Shift, ShiftKind, Test,
};

/// Extracts the bits `low..low + width` of `code`.
const fn bits(code: u16, low: u32, width: u32) -> u8 {
    ((code >> low) & ((1 << width) - 1)) as u8
}

/// Extracts the number of a low register (R0–R7) at bit `low`.
const fn reg(code: u16, low: u32) -> Reg {
    bits(code, low, 3)
}

/// Decodes the 16-bit instruction `code` at `pc`.
#[rustfmt::skip]
pub fn decode(code: u16, pc: u32) -> Op {
    match code >> 10 {
        0x00..=0x0F => shift_add_move(code),
        0x10 => data_processing(code),
        0x11 => special(code, pc),
        0x12 | 0x13 => Op::LoadLiteral {
            kind: Load::Word,
            t: reg(code, 8),
            address: (pc.wrapping_add(4) & !3).wrapping_add(u32::from(code & 0xFF) << 2),
        },
        0x14..=0x17 => load_store_register(code),
        0x18..=0x27 => load_store_immediate(code),
        0x28 | 0x29 => Op::MovImm {
            d: reg(code, 8),
            imm: (pc.wrapping_add(4) & !3).wrapping_add(u32::from(code & 0xFF) << 2),
        },
        0x2A | 0x2B => Op::AddImm { d: reg(code, 8), n: 13, imm: u32::from(code & 0xFF) << 2 },
        0x2C..=0x2F => miscellaneous(code, pc),
        0x30..=0x33 => multiple(code),
        0x34..=0x37 => conditional_branch(code, pc),
        0x38 | 0x39 => {
            let offset = (u32::from(code & 0x7FF) << 21).cast_signed() >> 20;
            branch(pc, offset)
        }
        _ => Op::Undefined,
    }
}

fn branch(pc: u32, offset: i32) -> Op {
    Op::Branch {
        refill: 0,
        target: pc.wrapping_add(4).wrapping_add_signed(offset),
    }
}

/// Decodes shifts, additions, moves and comparisons (A5.2.1).
#[rustfmt::skip]
fn shift_add_move(code: u16) -> Op {
    let (d, n, m) = (reg(code, 0), reg(code, 3), reg(code, 6));
    let wide = reg(code, 8);
    let byte = u32::from(code & 0xFF);
    match code >> 11 {
        0 if bits(code, 6, 5) == 0 => Op::DataReg {
            alu: Alu::Mov,
            flags: true,
            d,
            n: 0,
            m: n,
            shift: Shift::NONE,
        },
        kind @ 0..=2 => Op::ShiftImm {
            flags: true,
            d,
            m: n,
            shift: super::wide_data::shift(kind, bits(code, 6, 5)),
        },
        3 => match code >> 9 & 3 {
            0 => Op::AddsReg { d, n, m },
            1 => Op::SubsReg { d, n, m },
            2 => Op::AddsImm { d, n, imm: u32::from(m) },
            _ => Op::SubsImm { d, n, imm: u32::from(m) },
        },
        4 => Op::MovsImm { d: wide, carry: CarryOut::Kept, imm: byte },
        5 => Op::CmpImm { n: wide, imm: byte },
        6 => Op::AddsImm { d: wide, n: wide, imm: byte },
        _ => Op::SubsImm { d: wide, n: wide, imm: byte },
    }
}

/// Decodes data processing of low registers (A5.2.2).
#[rustfmt::skip]
fn data_processing(code: u16) -> Op {
    let (d, m) = (reg(code, 0), reg(code, 3));
    let alu = |alu| Op::DataReg { alu, flags: true, d, n: d, m, shift: Shift::NONE };
    let test = |test| Op::TestReg { test, n: d, m, shift: Shift::NONE };
    let shift = |kind| Op::ShiftReg { kind, flags: true, d, n: d, m };
    match bits(code, 6, 4) {
        0 => alu(Alu::And),
        1 => alu(Alu::Eor),
        2 => shift(ShiftKind::Lsl),
        3 => shift(ShiftKind::Lsr),
        4 => shift(ShiftKind::Asr),
        5 => alu(Alu::Adc),
        6 => alu(Alu::Sbc),
        7 => shift(ShiftKind::Ror),
        8 => test(Test::Tst),
        9 => Op::DataImm { alu: Alu::Rsb, flags: true, carry: CarryOut::Kept, d, n: m, imm: 0 },
        10 => Op::CmpReg { n: d, m },
        11 => test(Test::Cmn),
        12 => alu(Alu::Orr),
        13 => Op::Mul { flags: true, d, n: m, m: d },
        14 => alu(Alu::Bic),
        _ => alu(Alu::Mvn),
    }
}

/// Decodes operations on high registers, BX and BLX (A5.2.3).
#[rustfmt::skip]
fn special(code: u16, pc: u32) -> Op {
    let d = reg(code, 0) | bits(code, 7, 1) << 3;
    let m = bits(code, 3, 4);
    let unpredictable = Op::Unpredictable;
    match (code >> 8 & 3, d, m) {
        (0, 15, 15) => unpredictable,
        (0, 15, _) => Op::AddToPc { m },
        (0, _, 15) => super::wide_data::add_imm(d, d, pc.wrapping_add(4)),
        (0, _, _) => super::wide_data::add_reg(d, d, m),
        (1, 15, _) | (1, _, 15) => unpredictable,
        (1, _, _) if d < 8 && m < 8 => unpredictable,
        (1, _, _) => Op::CmpReg { n: d, m },
        (2, 15, 15) => Op::Branch { refill: 0, target: pc.wrapping_add(4) },
        (2, 15, _) => Op::MovToPc { m },
        (2, 13, 15) => Op::DataImm {
            alu: Alu::Mov,
            flags: false,
            carry: CarryOut::Kept,
            d,
            n: 0,
            imm: pc.wrapping_add(4),
        },
        (2, _, 15) => Op::MovImm { d, imm: pc.wrapping_add(4) },
        (2, 13, _) => Op::AddToSp { n: m, imm: 0 },
        (2, _, _) => Op::MovReg { d, m },
        _ if code & 7 != 0 => unpredictable,
        _ if m == 15 => unpredictable,
        _ if code & 0x80 == 0 => Op::BranchExchange { m },
        _ => Op::BranchLinkExchange { m },
    }
}

/// Decodes loads and stores with a register offset (A5.2.4).
#[rustfmt::skip]
fn load_store_register(code: u16) -> Op {
    let (t, n, m) = (reg(code, 0), reg(code, 3), reg(code, 6));
    let store = |size| Op::StoreReg { size, t, n, m, shift: 0 };
    let load = |kind| Op::LoadReg { kind, t, n, m, shift: 0 };
    match code >> 9 & 7 {
        0 => store(Size::Word),
        1 => store(Size::Half),
        2 => store(Size::Byte),
        3 => load(Load::SignedByte),
        4 => load(Load::Word),
        5 => load(Load::Half),
        6 => load(Load::Byte),
        _ => load(Load::SignedHalf),
    }
}

/// Decodes loads and stores with an immediate offset (A5.2.4).
#[rustfmt::skip]
fn load_store_immediate(code: u16) -> Op {
    let (t, n) = (reg(code, 0), reg(code, 3));
    let imm = u32::from(bits(code, 6, 5));
    let t_sp = reg(code, 8);
    let imm_sp = u32::from(code & 0xFF) << 2;
    match code >> 11 & 7 {
        4 => Op::Str { t, n, imm: imm << 2 },
        5 => Op::Ldr { t, n, imm: imm << 2 },
        6 => Op::Strb { t, n, imm },
        7 => Op::Ldrb { t, n, imm },
        0 => Op::Strh { t, n, imm: imm << 1 },
        1 => Op::Ldrh { t, n, imm: imm << 1 },
        2 => Op::Str { t: t_sp, n: 13, imm: imm_sp },
        _ => Op::Ldr { t: t_sp, n: 13, imm: imm_sp },
    }
}

/// Decodes the miscellaneous instructions (A5.2.5).
#[rustfmt::skip]
fn miscellaneous(code: u16, pc: u32) -> Op {
    let (d, m) = (reg(code, 0), reg(code, 3));
    let byte = (code & 0xFF) as u8;
    let choice = usize::from(bits(code, 6, 2));
    match bits(code, 8, 4) {
        0 => {
            let imm = u32::from(code & 0x7F) << 2;
            let down = code & 0x80 != 0;
            Op::AddToSp { n: 13, imm: if down { imm.wrapping_neg() } else { imm } }
        }
        1 | 3 | 9 | 11 => Op::CompareBranch {
            n: d,
            nonzero: code & 0x800 != 0,
            refill: 0,
            target: pc
                .wrapping_add(4)
                .wrapping_add(u32::from(bits(code, 3, 5)) << 1 | u32::from(bits(code, 9, 1)) << 6),
        },
        2 => {
            use Rearrange::{Sxtb, Sxth, Uxtb, Uxth};
            let kind = [Sxth, Sxtb, Uxth, Uxtb][choice];
            Op::Rearrange { kind, d, m }
        }
        4 | 5 => multiple_or_refuse(true, (code & 0xFF) | (code & 0x100) << 6),
        6 if bits(code, 5, 3) == 3 => change_state(code),
        10 => match choice {
            0 => rearrange(Rearrange::Rev, d, m),
            1 => rearrange(Rearrange::Rev16, d, m),
            3 => rearrange(Rearrange::Revsh, d, m),
            _ => Op::Undefined,
        },
        12 | 13 => multiple_or_refuse(false, (code & 0xFF) | (code & 0x100) << 7),
        14 => Op::Breakpoint { immediate: byte },
        15 => it_or_hint(byte),
        _ => Op::Undefined,
    }
}

const fn rearrange(kind: Rearrange, d: Reg, m: Reg) -> Op {
    Op::Rearrange { kind, d, m }
}

/// Decodes PUSH if `push`, else POP.
#[rustfmt::skip]
const fn multiple_or_refuse(push: bool, list: u16) -> Op {
    match (list, push) {
        (0, _) => Op::Unpredictable,
        (_, true) => Op::StoreMultiple { n: 13, writeback: true, down: true, list },
        (_, false) => Op::LoadMultiple { n: 13, writeback: true, down: false, list },
    }
}

/// Decodes CPS (B5.2.1).
#[rustfmt::skip]
const fn change_state(code: u16) -> Op {
    if code & 0xC != 0 || code & 3 == 0 {
        return Op::Unpredictable;
    }
    Op::ChangeState { disable: code & 0x10 != 0, primask: code & 2 != 0, faultmask: code & 1 != 0 }
}

/// Decodes IT and hints (A5.2.6).
const fn it_or_hint(byte: u8) -> Op {
    let (condition, mask) = (byte >> 4, byte & 0xF);
    match (condition, mask) {
        (0, 0) | (1, 0) | (5.., 0) => Op::Nop,
        (2, 0) => Op::WaitForEvent,
        (3, 0) => Op::WaitForInterrupt,
        (_, 0) => Op::SendEvent,
        (15, _) => Op::Unpredictable,
        (14, _) if mask.count_ones() != 1 => Op::Unpredictable,
        _ => Op::It { state: byte },
    }
}

/// Decodes STM and LDM.
#[rustfmt::skip]
const fn multiple(code: u16) -> Op {
    let n = reg(code, 8);
    let list = code & 0xFF;
    let held = list >> n & 1 != 0;
    if list == 0 {
        return Op::Unpredictable;
    }
    if code & 0x800 != 0 {
        return Op::LoadMultiple { n, writeback: !held, down: false, list };
    }
    if held && list.trailing_zeros() != n as u32 {
        return Op::Unpredictable;
    }
    Op::StoreMultiple { n, writeback: true, down: false, list }
}

/// Decodes B with a condition, UDF and SVC (A5.2.7).
fn conditional_branch(code: u16, pc: u32) -> Op {
    let offset = (u32::from(code & 0xFF) << 24).cast_signed() >> 23;
    match bits(code, 8, 4) {
        14 => Op::Undefined,
        15 => Op::SupervisorCall,
        condition => Op::BranchIf {
            condition,
            refill: 0,
            target: pc.wrapping_add(4).wrapping_add_signed(offset),
        },
    }
}
