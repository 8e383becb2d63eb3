//! Tests exceptions with direct calls and with programs, on a flat bus.

mod entry;
mod exit;
mod faults;
mod floating;
mod soak;
mod special;

use crate::chip::Cycle;
use crate::chip::cpu::flat::Flat;
use crate::chip::cpu::{Bus, Cpu, Size, Stop};

/// Main stack pointer at reset.
const STACK: u32 = Flat::SRAM + 0x1000;
/// Address of the main program.
const MAIN: u32 = Flat::FLASH + 0x400;

/// Returns the address of the handler of `number`; handlers have 64 bytes each.
const fn handler(number: u16) -> u32 {
    Flat::FLASH + 0x1000 + number as u32 * 0x40
}

/// Returns a core after reset with all lines enabled, handlers that return at once, and a main
/// program that loops.
fn machine() -> (Cpu, Flat) {
    let mut bus = Flat::default();
    let mut table = vec![STACK, MAIN | 1];
    table.extend((2..98).map(|number| handler(number) | 1));
    for (index, word) in (0..).zip(table) {
        assert!(bus.load(Flat::FLASH + 4 * index, &word.to_le_bytes()));
    }
    code(&mut bus, MAIN, &[0xE7FE]); // b .
    for number in 2..98 {
        code(&mut bus, handler(number), &[0x4770]); // bx lr
    }
    let mut cpu = Cpu::default();
    assert_eq!(cpu.reset(&mut bus), Ok(()));
    for word in 0..3 {
        set(&mut cpu, 0xE000_E100 + 4 * word, u32::MAX);
    }
    (cpu, bus)
}

fn code(bus: &mut Flat, address: u32, halves: &[u16]) {
    let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
    assert!(bus.load(address, &bytes));
}

/// Writes a private register.
fn set(cpu: &mut Cpu, address: u32, value: u32) {
    let at = cpu.cycle;
    assert_eq!(cpu.system.write(address, Size::Word, value, at), Ok(()));
}

fn get(cpu: &mut Cpu, address: u32) -> u32 {
    let at = cpu.cycle;
    cpu.system.read(address, Size::Word, at).unwrap_or(0xDEAD)
}

/// Sets the priority of line `line`, and pends the line by software.
fn pend(cpu: &mut Cpu, line: u16, priority: u8) {
    cpu.system.nvic.set_priority(16 + line, priority);
    set(cpu, 0xE000_EF00, u32::from(line));
}

/// Takes the pending exception, and returns its cycles; `None` if there is none.
fn take(cpu: &mut Cpu, bus: &mut Flat) -> Option<Cycle> {
    let before = cpu.cycle;
    let taken = cpu.take_pending(bus);
    assert!(taken.is_ok(), "{taken:?}");
    (taken == Ok(true)).then(|| cpu.cycle - before)
}

/// Returns from the exception, and returns the cycles that it took.
fn leave(cpu: &mut Cpu, bus: &mut Flat) -> Cycle {
    let before = cpu.cycle;
    let exc_return = cpu.registers.r[14];
    assert_eq!(cpu.return_from_exception(bus, exc_return), Ok(()));
    cpu.cycle - before
}

/// Runs until `until`, from where the core is.
fn run(cpu: &mut Cpu, bus: &mut impl Bus, until: Cycle) -> Result<(), Stop> {
    cpu.run(bus, until)
}
