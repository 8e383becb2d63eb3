//! Instructions against the Arm ARM and the TRM, hand-assembled.

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
/// RAM that tests use.
pub const RAM: u32 = Flat::SRAM;

/// A core and its memory.
pub struct Machine {
    pub cpu: Cpu,
    pub bus: Flat,
}

impl Machine {
    /// Half-words of `code` at [`CODE`], about to run; SP in the middle of
    /// RAM. A vector table at 0x800_8000 with all handlers at 0x800_9000, which
    /// holds an endless loop.
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

    /// Steps `count` instructions.
    pub fn steps(&mut self, count: usize) -> &mut Self {
        for _ in 0..count {
            assert_eq!(self.cpu.step(&mut self.bus), Ok(()));
        }
        self
    }

    /// The stop of the next instruction.
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

/// Runs `code`, `count` instructions from reset, with `registers`.
pub fn run(code: &[u16], count: usize, registers: &[(usize, u32)]) -> Machine {
    let mut machine = Machine::new(code).with(registers);
    machine.steps(count);
    machine
}
