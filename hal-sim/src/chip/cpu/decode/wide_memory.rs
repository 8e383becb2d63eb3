//! Decodes 32-bit loads and stores: multiple, dual, exclusive, table branch, single (Arm ARM
//! A5.3.5–A5.3.10).

use super::fields::{WideCode, is_bad};
use crate::chip::cpu::Size;
use crate::chip::cpu::instruction::{Index, Load, Op, Reg};

/// Decodes LDM and STM (A5.3.5).
#[rustfmt::skip]
pub fn multiple(code: WideCode) -> Op {
    let n = code.n();
    let list = code.second;
    let load = code.first & 0x10 != 0;
    let writeback = code.first & 0x20 != 0;
    let down = match code.first(7, 2) {
        1 => false,
        2 => true,
        _ => return Op::Undefined,
    };
    let forbidden = if load { 0x2000 } else { 0xA000 };
    let has_pc_and_lr = load && list & 0xC000 == 0xC000;
    let held = writeback && list >> n & 1 != 0;
    if n == 15 || list & forbidden != 0 || list.count_ones() < 2 || has_pc_and_lr || held {
        return Op::Unpredictable;
    }
    if load {
        Op::LoadMultiple { n, writeback, down, list }
    } else {
        Op::StoreMultiple { n, writeback, down, list }
    }
}

/// Decodes dual and exclusive accesses and table branches (A5.3.6).
#[rustfmt::skip]
pub fn dual_exclusive_table(code: WideCode) -> Op {
    let (n, t, t2) = (code.n(), code.t(), code.d());
    let before = code.first & 0x100 != 0;
    let writeback = code.first & 0x20 != 0;
    if before || writeback {
        return dual(code);
    }
    let imm = (code.second & 0xFF) << 2;
    let unit = match code.second(4, 2) {
        0 => Size::Byte,
        _ => Size::Half,
    };
    match (code.first(4, 5), code.second(4, 4)) {
        (4, _) if n == 15 || is_bad(t) || is_bad(t2) || t2 == n || t2 == t => Op::Unpredictable,
        (4, _) => Op::StoreExclusive { size: Size::Word, d: t2, t, n, imm },
        (5, _) if n == 15 || is_bad(t) || t2 != 15 => Op::Unpredictable,
        (5, _) => Op::LoadExclusive { size: Size::Word, t, n, imm },
        (12, 4 | 5) => store_exclusive(code, unit),
        (13, 4 | 5) if n == 15 || is_bad(t) => Op::Unpredictable,
        (13, 4 | 5) => Op::LoadExclusive { size: unit, t, n, imm: 0 },
        (13, 0 | 1) if n == 13 || is_bad(code.m()) => Op::Unpredictable,
        (13, 0 | 1) => Op::TableBranch { n, m: code.m(), half: unit == Size::Half },
        _ => Op::Undefined,
    }
}

/// Decodes STREXB and STREXH.
#[rustfmt::skip]
fn store_exclusive(code: WideCode, size: Size) -> Op {
    let (n, t, d) = (code.n(), code.t(), code.m());
    if n == 15 || is_bad(t) || is_bad(d) || d == n || d == t {
        return Op::Unpredictable;
    }
    Op::StoreExclusive { size, d, t, n, imm: 0 }
}

/// Decodes LDRD and STRD.
#[rustfmt::skip]
fn dual(code: WideCode) -> Op {
    let (n, t, t2) = (code.n(), code.t(), code.d());
    let offset = u32::from(code.second & 0xFF) << 2;
    let imm = if code.first & 0x80 != 0 {
        offset
    } else {
        offset.wrapping_neg()
    };
    let writeback = code.first & 0x20 != 0;
    let index = index(code.first & 0x100 != 0, writeback);
    if is_bad(t) || is_bad(t2) || writeback && (n == t || n == t2 || n == 15) {
        return Op::Unpredictable;
    }
    match (code.first & 0x10 != 0, n) {
        (false, 15) => Op::Unpredictable,
        (false, _) => Op::StoreDual { t, t2, n, index, imm },
        (true, _) if t == t2 => Op::Unpredictable,
        (true, 15) => Op::LoadDualLiteral { t, t2, address: code.base().wrapping_add(imm) },
        (true, _) => Op::LoadDual { t, t2, n, index, imm },
    }
}

const fn index(before: bool, writeback: bool) -> Index {
    match (before, writeback) {
        (true, false) => Index::Offset,
        (true, true) => Index::Pre,
        (false, _) => Index::Post,
    }
}

/// Decodes loads and stores of one register (A5.3.7–A5.3.10).
pub fn single(code: WideCode) -> Op {
    let signed = code.first & 0x100 != 0;
    let load = code.first & 0x10 != 0;
    let size = match code.first(5, 2) {
        0 => Size::Byte,
        1 => Size::Half,
        2 => Size::Word,
        _ => return Op::Undefined,
    };
    let kind = match (size, signed) {
        (Size::Byte, false) => Load::Byte,
        (Size::Byte, true) => Load::SignedByte,
        (Size::Half, false) => Load::Half,
        (Size::Half, true) => Load::SignedHalf,
        (Size::Word, false) => Load::Word,
        (Size::Word, true) => return Op::Undefined,
    };
    match (load, signed) {
        (true, _) => load_single(code, kind),
        (false, true) => Op::Undefined,
        (false, false) => store_single(code, size),
    }
}

/// Addressing mode of a single access.
enum Mode {
    /// Base plus constant.
    Offset(u32),
    /// Base plus shifted register.
    Register(Reg, u8),
    /// Base plus or minus constant, with writeback of the base.
    Indexed(Index, u32),
    /// Base plus constant, with the rights of unprivileged code.
    Unprivileged(u8),
    /// The encoding is UNDEFINED.
    Undefined,
}

fn mode(code: WideCode) -> Mode {
    let byte = u32::from(code.second & 0xFF);
    if code.first & 0x80 != 0 {
        return Mode::Offset(u32::from(code.second & 0xFFF));
    }
    if code.second & 0x800 == 0 {
        if code.second(6, 5) != 0 {
            return Mode::Undefined;
        }
        return Mode::Register(code.m(), code.second(4, 2));
    }
    let up = code.second & 0x200 != 0;
    let imm = if up { byte } else { byte.wrapping_neg() };
    match (code.second & 0x400 != 0, code.second & 0x100 != 0) {
        (true, false) if up => Mode::Unprivileged((code.second & 0xFF) as u8),
        (true, false) => Mode::Offset(imm),
        (false, false) => Mode::Undefined,
        (before, true) => Mode::Indexed(index(before, true), imm),
    }
}

#[rustfmt::skip]
fn load_single(code: WideCode, kind: Load) -> Op {
    let (n, t) = (code.n(), code.t());
    let hint = t == 15 && kind != Load::Word;
    if n == 15 {
        if hint {
            return Op::Nop; // PLD, PLI
        }
        if t == 13 && kind != Load::Word {
            return Op::Unpredictable;
        }
        let offset = u32::from(code.second & 0xFFF);
        let up = code.first & 0x80 != 0;
        let offset = if up { offset } else { offset.wrapping_neg() };
        let address = code.base().wrapping_add(offset);
        return Op::LoadLiteral { kind, t, address };
    }
    let mode = mode(code);
    if matches!(mode, Mode::Undefined) {
        return Op::Undefined;
    }
    if hint && matches!(mode, Mode::Offset(_) | Mode::Register(..)) {
        return Op::Nop; // PLD, PLI and unallocated hints
    }
    if is_bad(t) && kind != Load::Word {
        return Op::Unpredictable;
    }
    match mode {
        Mode::Offset(imm) if is_bad(t) => Op::LoadImm { kind, t, n, imm },
        Mode::Offset(imm) => match kind {
            Load::Word => Op::Ldr { t, n, imm },
            Load::Half => Op::Ldrh { t, n, imm },
            Load::Byte => Op::Ldrb { t, n, imm },
            _ => Op::LoadImm { kind, t, n, imm },
        },
        Mode::Register(m, _) if is_bad(m) => Op::Unpredictable,
        Mode::Register(m, shift) => Op::LoadReg { kind, t, n, m, shift },
        Mode::Indexed(..) if n == t => Op::Unpredictable,
        Mode::Indexed(index, imm) => Op::LoadIndexed { kind, t, n, index, imm },
        Mode::Unprivileged(_) if is_bad(t) => Op::Unpredictable,
        Mode::Unprivileged(imm) => Op::LoadUnprivileged { kind, t, n, imm },
        Mode::Undefined => Op::Undefined,
    }
}

#[rustfmt::skip]
fn store_single(code: WideCode, size: Size) -> Op {
    let (n, t) = (code.n(), code.t());
    if n == 15 {
        return Op::Undefined;
    }
    if t == 15 || t == 13 && size != Size::Word {
        return Op::Unpredictable;
    }
    match mode(code) {
        Mode::Offset(imm) => match size {
            Size::Word => Op::Str { t, n, imm },
            Size::Half => Op::Strh { t, n, imm },
            Size::Byte => Op::Strb { t, n, imm },
        },
        Mode::Register(m, _) if is_bad(m) => Op::Unpredictable,
        Mode::Register(m, shift) => Op::StoreReg { size, t, n, m, shift },
        Mode::Indexed(..) if n == t => Op::Unpredictable,
        Mode::Indexed(index, imm) => Op::StoreIndexed { size, t, n, index, imm },
        Mode::Unprivileged(_) if is_bad(t) => Op::Unpredictable,
        Mode::Unprivileged(imm) => Op::StoreUnprivileged { size, t, n, imm },
        Mode::Undefined => Op::Undefined,
    }
}
