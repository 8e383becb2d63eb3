//! Tests the private peripherals against the Arm ARM, without instructions.

mod mpu;
mod priorities;
mod registers;
mod systick;

use super::System;
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::Unmodelled;

/// Writes a word at cycle 0.
fn write(system: &mut System, address: u32, value: u32) {
    write_at(system, address, value, 0);
}

fn write_at(system: &mut System, address: u32, value: u32, at: Cycle) {
    assert_eq!(system.write(address, Size::Word, value, at), Ok(()));
}

/// Reads a word at cycle 0.
fn read(system: &mut System, address: u32) -> u32 {
    read_at(system, address, 0)
}

fn read_at(system: &mut System, address: u32, at: Cycle) -> u32 {
    match system.read(address, Size::Word, at) {
        Ok(value) => value,
        Err(Unmodelled(what)) => panic!("{address:#010x}: {what}"),
    }
}
