//! Defines decoded operations, with all constants already computed.

use crate::chip::cpu::{Size, arithmetic, fpu};

/// Number of a core register, 0–15.
pub type Reg = u8;

/// Effect of computing an immediate operand on the carry flag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CarryOut {
    Kept,  // Unchanged
    Clear, // 0
    Set,   // 1
}

/// Kind of a shift or rotation of an operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShiftKind {
    Lsl, // Logical left
    Lsr, // Logical right
    Asr, // Arithmetic right
    Ror, // Rotate right
    Rrx, // Rotate right by one through the carry
}

/// A shift by a constant: 0–31 for LSL, 1–32 for LSR and ASR, 1–31 for ROR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shift {
    /// Direction and fill of the shift.
    pub kind: ShiftKind,
    /// Number of bits by which the operand is shifted.
    pub amount: u8,
}

impl Shift {
    /// A shift that changes nothing.
    pub const NONE: Self = Self {
        kind: ShiftKind::Lsl,
        amount: 0,
    };
}

/// Data processing with a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alu {
    And, // And
    Bic, // And not
    Orr, // Or
    Orn, // Or not
    Eor, // Exclusive or
    Mov, // Second operand
    Mvn, // Complement of the second operand
    Add, // Sum
    Adc, // Sum with carry
    Sbc, // Difference with borrow
    Sub, // Difference
    Rsb, // Second operand minus first
}

/// Data processing that only sets flags.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Test {
    Tst, // And
    Teq, // Exclusive or
    Cmn, // Sum
    Cmp, // Difference
}

/// Width and extension of loaded data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    Word,       // Word
    Half,       // Half-word, zero-extended
    Byte,       // Byte, zero-extended
    SignedHalf, // Half-word, sign-extended
    SignedByte, // Byte, sign-extended
}

/// Use of the offset of a load or store for the address and the base register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Index {
    Offset, // Base plus offset; the base stays
    Pre,    // Base plus offset, which also becomes the new base
    Post,   // Base; the offset is added to the base afterwards
}

/// Extension or reversal of bytes and half-words by a 16-bit instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rearrange {
    Sxth,  // Sign-extend a half-word
    Sxtb,  // Sign-extend a byte
    Uxth,  // Zero-extend a half-word
    Uxtb,  // Zero-extend a byte
    Rev,   // Reverse the bytes
    Rev16, // Reverse the bytes of each half-word
    Revsh, // Reverse the bytes of the lower half-word, sign-extended
}

/// A decoded operation, 12 bytes. The frequent operations are variants without a shift, an operator
/// or a special register; their destination is never R13 or R15, so that they need no check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
#[allow(missing_docs)] // d, n, m, t are the manual's registers; imm is its constant
pub enum Op {
    Missing, // Not decoded yet
    MovImm { d: Reg, imm: u32 },
    MovsImm { d: Reg, carry: CarryOut, imm: u32 },
    AddImm { d: Reg, n: Reg, imm: u32 },
    AddsImm { d: Reg, n: Reg, imm: u32 },
    SubsImm { d: Reg, n: Reg, imm: u32 },
    CmpImm { n: Reg, imm: u32 },
    /// R13 = Rn + imm.
    AddToSp { n: Reg, imm: u32 },
    DataImm { alu: Alu, flags: bool, carry: CarryOut, d: Reg, n: Reg, imm: u32 },
    TestImm { test: Test, carry: CarryOut, n: Reg, imm: u32 },
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
    Arithmetic(arithmetic::Op), // 32-bit register arithmetic
    Float(fpu::Op), // Floating point

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
    /// Load with pre- or post-indexed address.
    LoadIndexed { kind: Load, t: Reg, n: Reg, index: Index, imm: u32 },
    /// Store with pre- or post-indexed address.
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

    /// B without condition; `refill` is the cycles of the pipeline's refill at the target.
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
    Nop, // NOP, YIELD, PLD, PLI, DBG
    WaitForInterrupt,
    WaitForEvent,
    SendEvent,
    SupervisorCall,
    Breakpoint { immediate: u8 },
    /// CPSIE, or CPSID if `disable`.
    ChangeState { disable: bool, primask: bool, faultmask: bool },
    ReadSpecial { d: Reg, sysm: u8 },
    WriteSpecial { n: Reg, sysm: u8, mask: u8 },
    DataBarrier, // DMB, DSB
    InstructionBarrier, // ISB
    Undefined, // UNDEFINED by the architecture
    NoCoprocessor, // For a coprocessor that this core lacks
    Unpredictable, // UNPREDICTABLE by the architecture: stops the run
}

impl Op {
    /// Returns the operation without its change of the flags. 16-bit instructions leave the flags
    /// unchanged inside an IT block (Arm ARM A7.3.2, `setflags = !InITBlock()`).
    #[rustfmt::skip]
    pub fn without_flags(self) -> Self {
        match self {
            Self::MovsImm { d, imm, .. } => Self::MovImm { d, imm },
            Self::AddsImm { d, n, imm } => Self::AddImm { d, n, imm },
            Self::SubsImm { d, n, imm } => Self::AddImm { d, n, imm: imm.wrapping_neg() },
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
