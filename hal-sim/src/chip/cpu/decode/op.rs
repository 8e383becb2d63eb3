//! Operations: what an instruction does, with all that is fixed worked out.

use crate::chip::cpu::{Size, arithmetic, fpu};

/// A register's number, 0–15.
pub type Reg = u8;

/// The carry that an immediate operand leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carry {
    /// As it was.
    Kept,
    /// 0.
    Clear,
    /// 1.
    Set,
}

/// Kinds of shifts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShiftKind {
    /// Logical left.
    Lsl,
    /// Logical right.
    Lsr,
    /// Arithmetic right.
    Asr,
    /// Rotate right.
    Ror,
    /// Rotate right by one through the carry.
    Rrx,
}

/// A shift by a constant: 0–31 for LSL, 1–32 for LSR and ASR, 1–31 for ROR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shift {
    /// Which way.
    pub kind: ShiftKind,
    /// How far, bits.
    pub amount: u8,
}

impl Shift {
    /// No shift.
    pub const NONE: Self = Self {
        kind: ShiftKind::Lsl,
        amount: 0,
    };
}

/// Data processing with a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alu {
    /// And.
    And,
    /// And not.
    Bic,
    /// Or.
    Orr,
    /// Or not.
    Orn,
    /// Exclusive or.
    Eor,
    /// The second operand.
    Mov,
    /// The second operand's complement.
    Mvn,
    /// Sum.
    Add,
    /// Sum with carry.
    Adc,
    /// Difference with borrow.
    Sbc,
    /// Difference.
    Sub,
    /// Second operand minus first.
    Rsb,
}

/// Data processing for the flags only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Test {
    /// And.
    Tst,
    /// Exclusive or.
    Teq,
    /// Sum.
    Cmn,
    /// Difference.
    Cmp,
}

/// What a load makes of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// Word.
    Word,
    /// Half-word, zero-extended.
    Half,
    /// Byte, zero-extended.
    Byte,
    /// Half-word, sign-extended.
    SignedHalf,
    /// Byte, sign-extended.
    SignedByte,
}

/// How a base and an offset make an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Index {
    /// Base plus offset; the base stays.
    Offset,
    /// Base plus offset, which becomes the base.
    Pre,
    /// Base, which moves by the offset afterwards.
    Post,
}

/// 16-bit extensions and reversals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rearrange {
    /// Sign-extend a half-word.
    Sxth,
    /// Sign-extend a byte.
    Sxtb,
    /// Zero-extend a half-word.
    Uxth,
    /// Zero-extend a byte.
    Uxtb,
    /// Reverse the bytes.
    Rev,
    /// Reverse the bytes of each half-word.
    Rev16,
    /// Reverse the bytes of the lower half-word, sign-extended.
    Revsh,
}

/// An operation. Variants without a shift, a choice of the operator or a
/// special register are the frequent ones: their destination is never R13 or
/// R15, so that they need not look. 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
#[allow(missing_docs)] // d, n, m, t are the manual's registers; imm its constant
pub enum Op {
    /// Not decoded yet.
    Missing,
    MovImm { d: Reg, imm: u32 },
    MovsImm { d: Reg, carry: Carry, imm: u32 },
    AddImm { d: Reg, n: Reg, imm: u32 },
    AddsImm { d: Reg, n: Reg, imm: u32 },
    SubsImm { d: Reg, n: Reg, imm: u32 },
    CmpImm { n: Reg, imm: u32 },
    /// R13 = Rn + imm.
    AddToSp { n: Reg, imm: u32 },
    DataImm { alu: Alu, flags: bool, carry: Carry, d: Reg, n: Reg, imm: u32 },
    TestImm { test: Test, carry: Carry, n: Reg, imm: u32 },
    Movt { d: Reg, imm: u32 },
    MovReg { d: Reg, m: Reg },
    AddReg { d: Reg, n: Reg, m: Reg },
    AddsReg { d: Reg, n: Reg, m: Reg },
    SubsReg { d: Reg, n: Reg, m: Reg },
    CmpReg { n: Reg, m: Reg },
    DataReg { alu: Alu, flags: bool, d: Reg, n: Reg, m: Reg, shift: Shift },
    TestReg { test: Test, n: Reg, m: Reg, shift: Shift },
    /// Shift by a constant.
    ShiftImm { flags: bool, d: Reg, m: Reg, shift: Shift },
    /// 16-bit shift by Rm\[7:0\].
    ShiftReg { kind: ShiftKind, flags: bool, d: Reg, n: Reg, m: Reg },
    /// 16-bit multiplication.
    Mul { flags: bool, d: Reg, n: Reg, m: Reg },
    Rearrange { kind: Rearrange, d: Reg, m: Reg },
    Bfi { d: Reg, n: Reg, lsb: u8, width: u8 },
    Bfc { d: Reg, lsb: u8, width: u8 },
    Sbfx { d: Reg, n: Reg, lsb: u8, width: u8 },
    Ubfx { d: Reg, n: Reg, lsb: u8, width: u8 },
    Ssat { d: Reg, n: Reg, bits: u8, shift: Shift },
    Usat { d: Reg, n: Reg, bits: u8, shift: Shift },
    Ssat16 { d: Reg, n: Reg, bits: u8 },
    Usat16 { d: Reg, n: Reg, bits: u8 },
    /// PKHBT, or PKHTB if `top`.
    Pkh { top: bool, d: Reg, n: Reg, m: Reg, shift: Shift },
    /// 32-bit register arithmetic.
    Arithmetic(arithmetic::Op),
    /// Floating point.
    Float(fpu::Op),

    Ldr { t: Reg, n: Reg, imm: u32 },
    Ldrh { t: Reg, n: Reg, imm: u32 },
    Ldrb { t: Reg, n: Reg, imm: u32 },
    Str { t: Reg, n: Reg, imm: u32 },
    Strh { t: Reg, n: Reg, imm: u32 },
    Strb { t: Reg, n: Reg, imm: u32 },
    LoadImm { kind: Load, t: Reg, n: Reg, imm: u32 },
    LoadReg { kind: Load, t: Reg, n: Reg, m: Reg, shift: u8 },
    StoreReg { size: Size, t: Reg, n: Reg, m: Reg, shift: u8 },
    LoadLiteral { kind: Load, t: Reg, address: u32 },
    /// Pre- or post-indexed.
    LoadIndexed { kind: Load, t: Reg, n: Reg, index: Index, imm: u32 },
    /// Pre- or post-indexed.
    StoreIndexed { size: Size, t: Reg, n: Reg, index: Index, imm: u32 },
    LoadUnprivileged { kind: Load, t: Reg, n: Reg, imm: u8 },
    StoreUnprivileged { size: Size, t: Reg, n: Reg, imm: u8 },
    LoadDual { t: Reg, t2: Reg, n: Reg, index: Index, imm: u32 },
    LoadDualLiteral { t: Reg, t2: Reg, address: u32 },
    StoreDual { t: Reg, t2: Reg, n: Reg, index: Index, imm: u32 },
    /// LDM, POP; decreasing before if `down`.
    LoadMultiple { n: Reg, writeback: bool, down: bool, list: u16 },
    /// STM, PUSH; decreasing before if `down`.
    StoreMultiple { n: Reg, writeback: bool, down: bool, list: u16 },
    LoadExclusive { size: Size, t: Reg, n: Reg, imm: u16 },
    StoreExclusive { size: Size, d: Reg, t: Reg, n: Reg, imm: u16 },
    ClearExclusive,

    /// `refill`: cycles of the pipeline's refill at the target.
    Branch { refill: u8, target: u32 },
    BranchIf { condition: u8, refill: u8, target: u32 },
    BranchLink { refill: u8, target: u32 },
    /// CBZ, or CBNZ if `nonzero`.
    CompareBranch { n: Reg, nonzero: bool, refill: u8, target: u32 },
    BranchExchange { m: Reg },
    BranchLinkExchange { m: Reg },
    MovToPc { m: Reg },
    /// PC = PC + 4 + Rm.
    AddToPc { m: Reg },
    /// TBB, or TBH if `half`.
    TableBranch { n: Reg, m: Reg, half: bool },

    It { state: u8 },
    /// NOP, YIELD, PLD, PLI, DBG.
    Nop,
    WaitForInterrupt,
    WaitForEvent,
    SendEvent,
    SupervisorCall,
    Breakpoint { immediate: u8 },
    /// CPSIE, or CPSID if `disable`.
    ChangeState { disable: bool, primask: bool, faultmask: bool },
    ReadSpecial { d: Reg, sysm: u8 },
    WriteSpecial { n: Reg, sysm: u8, mask: u8 },
    /// DMB, DSB.
    DataBarrier,
    /// ISB.
    InstructionBarrier,
    /// UNDEFINED by the architecture.
    Undefined,
    /// Of a coprocessor that this core lacks.
    NoCoprocessor,
    /// UNPREDICTABLE by the architecture: the run stops.
    Unpredictable,
}

impl Op {
    /// The same operation leaving the flags alone: what a 16-bit instruction
    /// does inside an IT block (Arm ARM A7.3.2, `setflags = !InITBlock()`).
    pub fn without_flags(self) -> Self {
        match self {
            Self::MovsImm { d, imm, .. } => Self::MovImm { d, imm },
            Self::AddsImm { d, n, imm } => Self::AddImm { d, n, imm },
            Self::SubsImm { d, n, imm } => Self::AddImm {
                d,
                n,
                imm: imm.wrapping_neg(),
            },
            Self::AddsReg { d, n, m } => Self::AddReg { d, n, m },
            Self::SubsReg { d, n, m } => Self::DataReg {
                alu: Alu::Sub,
                flags: false,
                d,
                n,
                m,
                shift: Shift::NONE,
            },
            mut other => {
                if let Self::DataImm { flags, .. }
                | Self::DataReg { flags, .. }
                | Self::ShiftImm { flags, .. }
                | Self::ShiftReg { flags, .. }
                | Self::Mul { flags, .. } = &mut other
                {
                    *flags = false;
                }
                other
            }
        }
    }
}
