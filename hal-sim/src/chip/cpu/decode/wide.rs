//! Decodes 32-bit encodings: selects the family, and decodes branches and miscellaneous control
//! (Arm ARM A5.3, A5.3.4).

use super::fields::{WideCode, is_bad};
use super::{wide_data, wide_memory};
use crate::chip::cpu::instruction::Op;
use crate::chip::cpu::{arithmetic, fpu};

/// Decodes the 32-bit instruction `first`, `second` at `pc`.
pub fn decode(first: u16, second: u16, pc: u32) -> Op {
    let code = WideCode { first, second, pc };
    match first >> 8 {
        0xE8 | 0xE9 if first & 0x40 == 0 => wide_memory::multiple(code),
        0xE8 | 0xE9 => wide_memory::dual_exclusive_table(code),
        0xEA | 0xEB => wide_data::shifted_register(code),
        0xEC..=0xEF | 0xFC..=0xFF => coprocessor(code),
        0xF0..=0xF7 if second & 0x8000 != 0 => branch_or_control(code),
        0xF0..=0xF7 if first & 0x200 == 0 => wide_data::modified_immediate(code),
        0xF0..=0xF7 => wide_data::plain_immediate(code),
        0xF8 | 0xF9 => wide_memory::single(code),
        0xFA | 0xFB => match arithmetic::decode(first, second) {
            Some(op) => Op::Arithmetic(op),
            None => Op::Unpredictable,
        },
        _ => Op::Undefined,
    }
}

fn coprocessor(code: WideCode) -> Op {
    if code.first & 0x300 == 0x300 {
        return Op::Undefined; // Advanced SIMD, which no M-profile core has
    }
    if !matches!(code.second(8, 4), 10 | 11) {
        return Op::NoCoprocessor;
    }
    match fpu::decode(code.first, code.second) {
        Some(op) => Op::Float(op),
        None => Op::Undefined,
    }
}

/// Decodes branches and miscellaneous control (A5.3.4).
#[rustfmt::skip]
fn branch_or_control(code: WideCode) -> Op {
    match code.second >> 12 & 5 {
        5 => Op::BranchLink { refill: 0, target: long_target(code) },
        1 => Op::Branch { refill: 0, target: long_target(code) },
        4 => Op::Undefined, // BLX to Arm state
        _ if code.first(6, 4) >> 1 != 7 => conditional(code),
        _ => control(code),
    }
}

/// Returns the target of B (T4) or BL.
fn long_target(code: WideCode) -> u32 {
    let sign = code.first(10, 1);
    let i1 = !(code.second(13, 1) ^ sign) & 1;
    let i2 = !(code.second(11, 1) ^ sign) & 1;
    let raw = u32::from(sign) << 31
        | u32::from(i1) << 30
        | u32::from(i2) << 29
        | u32::from(code.first & 0x3FF) << 19
        | u32::from(code.second & 0x7FF) << 8;
    code.pc4().wrapping_add_signed(raw.cast_signed() >> 7)
}

/// Decodes B with a condition (T3).
fn conditional(code: WideCode) -> Op {
    let raw = u32::from(code.first(10, 1)) << 31
        | u32::from(code.second(11, 1)) << 30
        | u32::from(code.second(13, 1)) << 29
        | u32::from(code.first & 0x3F) << 23
        | u32::from(code.second & 0x7FF) << 12;
    Op::BranchIf {
        condition: code.first(6, 4),
        refill: 0,
        target: code.pc4().wrapping_add_signed(raw.cast_signed() >> 11),
    }
}

/// Decodes MSR, hints, barriers, MRS and UDF.
#[rustfmt::skip]
fn control(code: WideCode) -> Op {
    let sysm = (code.second & 0xFF) as u8;
    match code.first(4, 7) {
        0x38 | 0x39 if is_bad(code.n()) || code.second(10, 2) == 0 => Op::Unpredictable,
        0x38 | 0x39 => Op::WriteSpecial { n: code.n(), sysm, mask: code.second(10, 2) },
        0x3A if code.second(8, 3) != 0 => Op::Undefined,
        0x3A => match sysm {
            2 => Op::WaitForEvent,
            3 => Op::WaitForInterrupt,
            4 => Op::SendEvent,
            _ => Op::Nop,
        },
        0x3B => match code.second(4, 4) {
            2 => Op::ClearExclusive,
            4 | 5 => Op::DataBarrier,
            6 => Op::InstructionBarrier,
            _ => Op::Undefined,
        },
        0x3E | 0x3F if is_bad(code.d()) => Op::Unpredictable,
        0x3E | 0x3F => Op::ReadSpecial { d: code.d(), sysm },
        _ => Op::Undefined,
    }
}
