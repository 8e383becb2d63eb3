//! Execution of a program on the simulated core.

use super::Program;
use super::encodings::{Encodings, is_wide};
use anyhow::{Result, bail, ensure};
use hal_sim::chip::cpu::Cpu;
use hal_sim::chip::cpu::flat::Flat;
use hal_sim::chip::cpu::registers::flag;

/// Step limit, far above the length of a program.
const STEPS: u64 = 10_000_000;

/// Returns the records of `program`, one after another, computed by the simulated core. `executed`
/// counts the executed instructions of its cases by encoding, without those whose condition fails.
///
/// # Errors
/// Fails if the core stops or the program does not end.
pub fn records(program: &Program, encodings: &Encodings, executed: &mut [u32]) -> Result<Vec<u8>> {
    let mut bus = Flat::default();
    ensure!(
        bus.load(Flat::FLASH, &program.flash),
        "the image does not fit"
    );
    let mut cpu = Cpu::default();
    cpu.reset(&mut bus)?;
    let start = program.cases.first().map_or(0, |(at, _)| *at);
    let [open, write, exit] = program.calls;
    let mut records = Vec::new();
    for _ in 0..STEPS {
        let pc = cpu.registers.r[15];
        if pc == exit {
            return Ok(records);
        }
        if pc == open || pc == write {
            if pc == write {
                copy(&bus, cpu.registers.r[1], &mut records)?;
            }
            cpu.registers.r[0] = u32::from(pc == open);
            cpu.registers.r[15] = pc + 2;
            continue;
        }
        if (start..program.end).contains(&pc) && condition_passes(&cpu) {
            count(program, pc, encodings, executed);
        }
        if let Err(stop) = cpu.step(&mut bus) {
            let cases = &program.cases;
            let index = cases.partition_point(|(at, _)| *at <= pc).saturating_sub(1);
            bail!("seed {}, case {index}: {stop}", program.seed);
        }
    }
    bail!("seed {}: the program does not end", program.seed)
}

/// Appends to `records` the data of a semihosting write whose parameters are at the address
/// `block`.
fn copy(bus: &Flat, block: u32, records: &mut Vec<u8>) -> Result<()> {
    let word = |at: u32| {
        let word = bus.word(at);
        word.ok_or_else(|| anyhow::anyhow!("no memory at {at:#010x}"))
    };
    let (buffer, length) = (word(block + 4)?, word(block + 8)?);
    for at in (buffer..buffer + length).step_by(4) {
        records.extend(word(at)?.to_le_bytes());
    }
    Ok(())
}

/// Returns whether the next instruction's condition in an IT block holds.
fn condition_passes(cpu: &Cpu) -> bool {
    let (value, apsr) = (cpu.registers.it, cpu.registers.apsr);
    if value & 15 == 0 {
        return true;
    }
    let [n, z, c, v] = [flag::N, flag::Z, flag::C, flag::V].map(|bit| apsr & bit != 0);
    let holds = match value >> 5 {
        0 => z,
        1 => c,
        2 => n,
        3 => v,
        4 => c && !z,
        5 => n == v,
        6 => n == v && !z,
        _ => true,
    };
    holds != (value & 0x10 != 0)
}

fn count(program: &Program, pc: u32, encodings: &Encodings, executed: &mut [u32]) {
    let half = |at: u32| {
        let at = (at - Flat::FLASH) as usize;
        let bytes = program.flash.get(at..at + 2);
        bytes.map_or(0, |b| u16::from_le_bytes([b[0], b[1]]))
    };
    let first = half(pc);
    let (width, word) = if is_wide(first) {
        (32, u32::from(first) << 16 | u32::from(half(pc + 2)))
    } else {
        (16, u32::from(first))
    };
    if let Some(id) = encodings.find(width, word) {
        executed[id] += 1;
    }
}
