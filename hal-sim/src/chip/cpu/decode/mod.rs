//! Decodes machine code into operations, and caches them by address.
//!
//! `narrow` decodes 16-bit and `wide*` 32-bit encodings (Arm ARM chapter A5); this module holds the
//! cache. The operations are in `instruction`, their execution in `execute`. In: half-words of
//! code. Out: one `Entry` each.

mod fields;
mod narrow;
mod wide;
mod wide_data;
mod wide_memory;

use super::bus::{AccessError, Unmodelled};
use super::instruction::Op;
use super::timing::{self, PipelineState};
use super::{Bus, Cpu, Fault, Stop, Trap, TrapResult};

/// A decoded instruction, 16 bytes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Entry {
    /// Operation of the instruction.
    pub op: Op,
    /// Length, and the properties that the next instruction's timing depends on.
    pub trail: PipelineState,
}

const _: () = assert!(size_of::<Entry>() <= 16);

impl Entry {
    const MISSING: Self = Self {
        op: Op::Missing,
        trail: PipelineState::NONE,
    };
}

/// Start of flash as images are linked; the same flash also appears at 0 as the boot alias (RM0090
/// 2.4).
const FLASH: u32 = 0x0800_0000;
/// Largest number of bytes of code in the cache: the STM32F405's flash.
const KEPT_BYTES: u32 = 1 << 20;

/// Decoded instructions in a table by address, up to the highest address executed so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Cache {
    flash: Vec<Entry>,
    alias: Vec<Entry>,
    version: u32,
}

impl Cache {
    /// Returns the instruction at `pc`, or [`Op::Missing`] if it is not in the cache.
    #[inline(always)]
    pub fn lookup(&self, pc: u32) -> &Entry {
        let at = (pc.wrapping_sub(FLASH) >> 1) as usize;
        self.flash.get(at).unwrap_or(&Entry::MISSING)
    }

    /// Clears the cache if `version`, the bus's version of the code, has changed since the last
    /// call.
    pub fn check(&mut self, version: u32) {
        if version != self.version {
            self.version = version;
            self.flash.clear();
            self.alias.clear();
        }
    }

    fn lookup_alias(&self, pc: u32) -> Entry {
        let entry = self.alias.get((pc >> 1) as usize);
        entry.copied().unwrap_or(Entry::MISSING)
    }

    fn keep(&mut self, pc: u32, entry: Entry) {
        let (table, offset) = if pc < KEPT_BYTES {
            (&mut self.alias, pc)
        } else {
            (&mut self.flash, pc.wrapping_sub(FLASH))
        };
        if offset >= KEPT_BYTES {
            return;
        }
        let at = (offset >> 1) as usize;
        if at >= table.len() {
            table.resize((at | 0xFFF) + 1, Entry::MISSING);
        }
        if let Some(place) = table.get_mut(at) {
            *place = entry;
        }
    }
}

/// Decodes the instruction at `pc`. For a branch with a known target, also reads the code at the
/// target, to compute how many cycles the pipeline takes to refill there.
pub(super) fn decode(bus: &mut impl Bus, pc: u32) -> TrapResult<Entry> {
    let failed = |denied| match denied {
        AccessError::Error => Trap::Fault(Fault::InstructionBus),
        AccessError::Unmodelled(Unmodelled(what)) => Trap::Stop(Stop::Outside { pc, what }),
    };
    let first = bus.read_code(pc).map_err(failed)?;
    if !timing::is_wide(first) {
        let mut op = narrow::decode(first, pc);
        add_refill(&mut op, bus);
        let trail = PipelineState::new(&op, u32::from(first), 2);
        return Ok(Entry { op, trail });
    }
    let second = bus.read_code(pc.wrapping_add(2)).map_err(failed)?;
    let mut op = wide::decode(first, second, pc);
    add_refill(&mut op, bus);
    let instruction = u32::from(first) << 16 | u32::from(second);
    let trail = PipelineState::new(&op, instruction, 4);
    Ok(Entry { op, trail })
}

/// Computes the cycles in which the pipeline refills after a branch whose target is known.
fn add_refill(op: &mut Op, bus: &mut impl Bus) {
    if let Op::Branch { refill, target }
    | Op::BranchIf { refill, target, .. }
    | Op::BranchLink { refill, target }
    | Op::CompareBranch { refill, target, .. } = op
    {
        *refill = timing::REFILL_DIRECT + timing::straddles(bus, *target);
    }
}

impl Cpu {
    /// Decodes the instruction at `pc`, which was not in the cache, and caches it unless it is in
    /// RAM.
    #[cold]
    #[inline(never)]
    pub(super) fn decode_missing(
        &mut self,
        bus: &mut impl Bus,
        decoded: &mut Cache,
        pc: u32,
    ) -> TrapResult<Entry> {
        let kept = decoded.lookup_alias(pc);
        if kept.op != Op::Missing {
            return Ok(kept);
        }
        // Cached code is not checked again: if an MPU region later denied flash that a program has
        // executed, this would go unnoticed.
        let privileged = self.registers.is_privileged();
        if !self.system.may_execute(pc, privileged) {
            return Err(Fault::InstructionAccess.into());
        }
        let entry = decode(bus, pc)?;
        if !bus.is_writable_code(pc) {
            decoded.keep(pc, entry);
        }
        Ok(entry)
    }

    /// Returns the stop that reports the instruction at R15, with `problem` as the problem.
    #[cold]
    pub(super) fn refuse(&self, bus: &mut impl Bus, problem: &'static str) -> Trap {
        let pc = self.registers.r[15];
        let mut code = |at| u32::from(bus.read_code(at).unwrap_or(0));
        let first = code(pc);
        let instruction = if timing::is_wide((first & 0xFFFF) as u16) {
            first << 16 | code(pc.wrapping_add(2))
        } else {
            first
        };
        Trap::Stop(Stop::Instruction {
            instruction,
            pc,
            what: problem,
        })
    }
}
