//! Tests hand-assembled instructions against the Arm ARM and the TRM.

mod bit_band;
mod branch;
mod control;
mod it;
mod memory;
mod refused;
mod timing;

use crate::chip::cpu::flat::Flat;
use crate::chip::cpu::{Cpu, Stop};

/// Start of the code under test.
pub const CODE: u32 = Flat::FLASH;
/// Start of the RAM that tests use.
pub const RAM: u32 = Flat::SRAM;

/// A core and its memory.
pub struct Machine {
    pub cpu: Cpu,
    pub bus: Flat,
}

impl Machine {
    /// Loads `code` at [`CODE`], ready to run, with SP in the middle of RAM. All vectors, at
    /// 0x800_8000, point to an endless loop at 0x800_9000.
    pub fn new(code: &[u16]) -> Self {
        let mut bus = Flat::default();
        assert!(bus.load(CODE, &bytes(code)));
        let vectors = 0x0800_9001_u32.to_le_bytes().repeat(128);
        assert!(bus.load(CODE + 0x8000, &vectors));
        assert!(bus.load(CODE + 0x9000, &bytes(&[0xE7FE])));
        let mut cpu = Cpu::default();
        cpu.system
            .write(0xE000_ED08, super::Size::Word, CODE + 0x8000, 0)
            .expect("VTOR is modelled");
        cpu.registers.r[15] = CODE;
        cpu.registers.r[13] = RAM + 0x8000;
        Self { cpu, bus }
    }

    pub fn with(mut self, registers: &[(usize, u32)]) -> Self {
        for (n, value) in registers {
            self.cpu.registers.r[*n] = *value;
        }
        self
    }

    /// Executes `count` instructions.
    pub fn steps(&mut self, count: usize) -> &mut Self {
        for _ in 0..count {
            assert_eq!(self.cpu.step(&mut self.bus), Ok(()));
        }
        self
    }

    /// Executes an instruction, and returns its stop, if there is one.
    pub fn stop(&mut self) -> Option<Stop> {
        self.cpu.step(&mut self.bus).err()
    }

    pub fn r(&self, n: usize) -> u32 {
        self.cpu.registers.r[n]
    }

    pub fn word(&self, address: u32) -> u32 {
        self.bus.word(address).expect("memory")
    }

    pub fn poke(&mut self, address: u32, words: &[u32]) {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        assert!(self.bus.load(address, &bytes));
    }
}

pub fn bytes(code: &[u16]) -> Vec<u8> {
    code.iter().flat_map(|half| half.to_le_bytes()).collect()
}

/// Executes `count` instructions of `code` from reset, with these values in `registers`.
pub fn run(code: &[u16], count: usize, registers: &[(usize, u32)]) -> Machine {
    let mut machine = Machine::new(code).with(registers);
    machine.steps(count);
    machine
}
