//! Counts cycles of instructions (TRM section 3.3), including the effects between instructions.
//!
//! Exact where the TRM is: base cycles of table 3-1, pipelined loads, the address stall, unaligned
//! accesses, the one-entry write buffer (3.3.2, 3.5). Approximate, because the TRM leaves it open:
//! - refill P: see [`REFILL_DIRECT`], [`REFILL_REGISTER`], [`REFILL_LOAD`];
//! - prefetch: see [`Pipeline::line`];
//! - IT is folded whenever a 16-bit instruction ran directly before it;
//! - loads whose 32-bit opcode straddles words are pipelined like others;
//! - LDR from code costs no extra cycle beyond those of the bus;
//! - LDM, STM and divisions run to their end before an interrupt is taken, whereas the core
//!   abandons them: up to 16 cycles late.
//!
//! Effect of a rule: without the address stall the `bench` image and CoreMark take 1.3–1.6 % fewer
//! cycles, without folding 1.2–1.4 % more.

mod floating;

use super::instruction::{Op, Reg};
use super::{Bus, Cpu};
use crate::chip::Cycle;

/// Cycles to refill the pipeline (P of TRM 3.3.1) after a branch whose target is in the
/// instruction. The decode stage computes the target and fetches early, so P is at its minimum.
pub const REFILL_DIRECT: u8 = 1;
/// Cycles to refill the pipeline after a branch to a register's value, which is known only in the
/// execute stage: one more than [`REFILL_DIRECT`].
pub const REFILL_REGISTER: u8 = 2;
/// Cycles to refill the pipeline after a load into R15, TBB and TBH: three (TRM 3.3.2).
pub const REFILL_LOAD: u8 = 3;
/// Largest number of cycles to refill the pipeline (P of TRM 3.3.1).
const REFILL_MOST: u8 = 3;

/// Number of bytes that the core fetches ahead of the instruction that begins to execute. The
/// decode stage has four bytes, the fetch stage the next ones, and words are fetched whole.
const AHEAD: u32 = 10;
/// Cycles from a word's fetch to its execution: fetch, decode.
const STAGES: Cycle = 2;

/// Returns whether `first` is the first half of a 32-bit instruction (Arm ARM A5.1).
pub const fn is_wide(first: u16) -> bool {
    first >> 11 >= 0x1D
}

/// Returns 1 if the instruction at `target` is a 32-bit instruction that straddles two words, so
/// that it needs two fetches before decoding.
pub(super) fn straddles(bus: &mut impl Bus, target: u32) -> u8 {
    let wide = target & 2 != 0 && bus.read_code(target).is_ok_and(is_wide);
    u8::from(wide)
}

/// Effect of an instruction on the timing of the next instruction.
///
/// One word, so that it is copied at once: bits 15:0 are registers that a following address must
/// wait for (results of data processing and loads), followed by the values of [`Self::load`] and
/// [`Self::length`], 8 bits each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PipelineState(u32);

impl PipelineState {
    /// State after a refill of the pipeline: no instruction before affects the timing.
    pub const NONE: Self = Self(0);

    /// Returns the state after an instruction of `length` bytes whose condition failed.
    pub const fn idle(length: u8) -> Self {
        Self((length as u32) << 24)
    }

    /// Returns 1 after a single load, whose data phase overlaps a following load or store.
    #[inline(always)]
    pub const fn load(self) -> u8 {
        (self.0 >> 16 & 1) as u8
    }

    /// Returns the length of the instruction, bytes; 0 if there was none.
    #[inline(always)]
    pub const fn length(self) -> u8 {
        (self.0 >> 24) as u8
    }

    /// Returns the state after `op`, whose encoding is `code`.
    pub fn new(op: &Op, code: u32, length: u8) -> Self {
        let (produced, load): (u16, u32) = match *op {
            Op::Ldr { t, .. }
            | Op::Ldrh { t, .. }
            | Op::Ldrb { t, .. }
            | Op::LoadImm { t, .. }
            | Op::LoadReg { t, .. }
            | Op::LoadLiteral { t, .. }
            | Op::LoadUnprivileged { t, .. }
            | Op::LoadExclusive { t, .. } => (1 << t, 1),
            Op::StoreExclusive { d, .. } => (1 << d, 1),
            Op::LoadIndexed { t, n, .. } => (1 << t | 1 << n, 1),
            _ => (results(op, code), 0),
        };
        Self(u32::from(produced) | load << 16 | u32::from(length) << 24)
    }
}

/// Returns 1 if the instruction before, whose effect is `last`, produced register `n`; otherwise 0.
#[inline(always)]
pub(super) const fn depends_on_last(last: PipelineState, n: Reg) -> u16 {
    (last.0 >> (n & 15) & 1) as u16
}

/// Returns the registers that an instruction of data processing writes, one bit each; 0 for other
/// instructions.
fn results(op: &Op, code: u32) -> u16 {
    match *op {
        Op::MovImm { d, .. }
        | Op::MovsImm { d, .. }
        | Op::AddImm { d, .. }
        | Op::AddsImm { d, .. }
        | Op::SubsImm { d, .. }
        | Op::DataImm { d, .. }
        | Op::Movt { d, .. }
        | Op::MovReg { d, .. }
        | Op::AddReg { d, .. }
        | Op::AddsReg { d, .. }
        | Op::SubsReg { d, .. }
        | Op::DataReg { d, .. }
        | Op::ShiftImm { d, .. }
        | Op::ShiftReg { d, .. }
        | Op::Mul { d, .. }
        | Op::Rearrange { d, .. }
        | Op::Bfi { d, .. }
        | Op::Bfc { d, .. }
        | Op::Sbfx { d, .. }
        | Op::Ubfx { d, .. }
        | Op::Ssat { d, .. }
        | Op::Usat { d, .. }
        | Op::Ssat16 { d, .. }
        | Op::Usat16 { d, .. }
        | Op::Pkh { d, .. }
        | Op::ReadSpecial { d, .. } => 1 << d,
        Op::AddToSp { .. } => 1 << 13,
        Op::Arithmetic(_) => {
            // Rd; for long multiplications RdLo too (A5.3.17).
            let low = if code >> 23 == 0xFB8 >> 3 {
                1 << (code >> 12 & 0xF)
            } else {
                0
            };
            1 << (code >> 8 & 0xF) | low
        }
        _ => 0,
    }
}

/// State of the pipeline, as earlier instructions left it.
#[derive(Clone, PartialEq, Debug)]
pub struct Pipeline {
    /// Effect of the previous instruction on the timing of the present one.
    pub(super) last: PipelineState,
    /// First or next data phase of the executing instruction, in cycles after its start.
    pub(super) phase: Cycle,
    /// State of the floating-point unit.
    pub(super) floating: floating::Floating,
    /// Cycle before which the write buffer is busy.
    pub(super) buffer: Cycle,
    /// The 16-byte line fetched last, [`Self::NO_LINE`] while a fetch is under way.
    ///
    /// The core requests words ahead of need (prefetch buffer of three words). The model requests
    /// the next line when an instruction begins to execute less than [`AHEAD`] bytes before it, and
    /// waits for it only when execution gets there. A full buffer would request up to two words
    /// earlier.
    line: u32,
    /// 16-byte line of code that was requested last.
    asked: u32,
    /// Cycle at which the first instruction of `asked` can execute.
    ready: Cycle,
    /// First of `quiet_bytes` addresses of instructions that neither request the next line nor wait
    /// for one.
    quiet_from: u32,
    quiet_bytes: u32,
}

impl Pipeline {
    const NO_LINE: u32 = u32::MAX;

    /// Restarts the pipeline after an exception's entry or return fetched the code at `target`: no
    /// instruction ran before, and the write buffer is empty.
    pub(super) fn begin_at(&mut self, target: u32) {
        *self = Self {
            asked: target >> 4,
            ..Self::default()
        };
        self.note_line_fetched(target >> 4);
    }

    /// Notes that `line` has arrived; the next line is requested [`AHEAD`] bytes before its start.
    #[inline(always)]
    fn note_line_fetched(&mut self, line: u32) {
        self.line = line;
        self.quiet_from = (line << 4).wrapping_sub(AHEAD);
        self.quiet_bytes = 16;
    }

    /// Notes that the fetch of line `asked` is under way. Execution waits for the line when it gets
    /// there, 4 bytes before it at the earliest.
    #[inline(always)]
    fn wait_for_asked(&mut self) {
        self.line = Self::NO_LINE;
        self.quiet_from = (self.asked << 4).wrapping_sub(AHEAD);
        self.quiet_bytes = AHEAD - 3;
    }
}

impl Default for Pipeline {
    fn default() -> Self {
        Self {
            last: PipelineState::NONE,
            phase: 1,
            floating: floating::Floating::default(),
            buffer: 0,
            line: Self::NO_LINE,
            asked: Self::NO_LINE,
            ready: 0,
            quiet_from: 0,
            quiet_bytes: 0,
        }
    }
}

impl Cpu {
    /// Adds `cycles` to the present cycle. 64 bits outlast any run, so overflow is not checked.
    #[inline(always)]
    pub(super) const fn advance_by(&mut self, cycles: Cycle) {
        self.cycle = self.cycle.wrapping_add(cycles);
    }

    /// Fetches code ahead, before the instruction of `length` bytes at `pc` executes.
    #[inline(always)]
    pub(super) fn fetch_ahead(&mut self, bus: &mut impl Bus, pc: u32, length: u8) {
        let pipeline = &self.pipeline;
        if pc.wrapping_sub(pipeline.quiet_from) >= pipeline.quiet_bytes {
            self.fetch_line(bus, pc, length);
        }
    }

    #[inline(never)]
    fn fetch_line(&mut self, bus: &mut impl Bus, pc: u32, length: u8) {
        let ahead = pc.wrapping_add(AHEAD) >> 4;
        let needed = pc.wrapping_add(u32::from(length)).wrapping_sub(1) >> 4;
        let pipeline = &mut self.pipeline;
        if pipeline.line == Pipeline::NO_LINE && pipeline.asked != Pipeline::NO_LINE {
            if needed != pipeline.asked {
                return;
            }
            self.cycle = self.cycle.max(pipeline.ready);
            pipeline.note_line_fetched(needed);
        }
        if pipeline.line != ahead {
            let wait = bus.fetch(ahead, self.cycle);
            pipeline.asked = ahead;
            pipeline.ready = self.cycle + STAGES + Cycle::from(wait);
            if wait == 0 {
                pipeline.note_line_fetched(ahead);
            } else {
                pipeline.wait_for_asked();
            }
        }
    }

    /// Branches to `target` in `cycles` cycles, which include the refill of the pipeline; returns
    /// `target`.
    #[inline(always)]
    pub(super) fn branch_to(&mut self, bus: &mut impl Bus, target: u32, cycles: u8) -> u32 {
        self.advance_by(cycles.into());
        let fetch = self.cycle.wrapping_sub(STAGES);
        self.pipeline.last = PipelineState::NONE;
        if target >> 4 != self.pipeline.line {
            self.refill(bus, target, fetch);
        }
        target
    }

    /// Branches to `target`, which is not encoded in the instruction but read from a register,
    /// after `before` cycles and the refill of the pipeline; returns `target`.
    pub(super) fn branch_far(
        &mut self,
        bus: &mut impl Bus,
        target: u32,
        before: u8,
        refill: u8,
    ) -> u32 {
        let straddles = straddles(bus, target);
        let refill = (refill + straddles).min(REFILL_MOST);
        self.branch_to(bus, target, before + refill)
    }

    /// Fetches the line of code at `target` at cycle `at`, and waits for it.
    #[inline(never)]
    pub(super) fn refill(&mut self, bus: &mut impl Bus, target: u32, at: Cycle) {
        let line = target >> 4;
        let pipeline = &mut self.pipeline;
        if pipeline.asked != line {
            let wait = bus.fetch(line, at);
            pipeline.asked = line;
            pipeline.ready = at + STAGES + Cycle::from(wait);
        }
        pipeline.note_line_fetched(line);
        self.cycle = self.cycle.max(pipeline.ready);
    }
}
