//! The board as gdb sees it: registers, memory, breakpoints.

use super::registers::{CortexM4F, Packed};
use crate::chip::board::Board;
use crate::chip::cpu::{Bus, Observer, Size};
use gdbstub::common::Signal;
use gdbstub::target::ext::base::BaseOps;
use gdbstub::target::ext::base::singlethread::{
    SingleThreadBase, SingleThreadResume, SingleThreadResumeOps, SingleThreadSingleStep,
    SingleThreadSingleStepOps,
};
use gdbstub::target::ext::breakpoints::{
    Breakpoints, BreakpointsOps, HwBreakpoint, HwBreakpointOps, SwBreakpoint, SwBreakpointOps,
};
use gdbstub::target::{Target, TargetError, TargetResult};
use std::convert::Infallible;

/// Where gdb wants the core to stop, and how it last let it go.
#[derive(Clone, Debug, Default)]
pub struct Points {
    at: Vec<u32>,
    /// One instruction only.
    pub(super) steps: bool,
    /// It was let go and has not run an instruction since: a breakpoint where
    /// it stands is the one that it stopped at.
    pub(super) leaves: bool,
}

impl Observer for Points {
    #[inline]
    fn stops_before(&mut self, pc: u32) -> bool {
        !self.at.is_empty() && self.at.contains(&pc)
    }
}

impl Points {
    fn add(&mut self, address: u32) -> bool {
        self.at.push(address & !1);
        true
    }

    fn remove(&mut self, address: u32) -> bool {
        let found = self.at.iter().position(|&at| at == address & !1);
        found.map(|n| self.at.swap_remove(n)).is_some()
    }
}

impl Board<Points> {
    /// The byte at `address`, as no time passes: registers are read from a
    /// copy of the chip, so that reading changes nothing.
    fn peek(&self, from: u32, into: &mut [u8]) -> usize {
        let (at, soc) = (self.cpu.cycle, &self.around.soc);
        let (mut copy, mut system) = (None, None);
        for (n, byte) in (0u32..).zip(&mut *into) {
            let address = from.wrapping_add(n);
            let (word, lane) = (address & !3, 8 * (address & 3));
            let value = match address >> 24 {
                0x00 | 0x08 if address & 0x00FF_FFFF < 0x10_0000 => {
                    Some(soc.flash.peek(address, Size::Byte))
                }
                0x20 => soc.ram.read(address, Size::Byte),
                0x10 => soc.ccm.read(address, Size::Byte),
                // FSMC's: no memory hangs there, and a debugger that asks for all of it
                // would wait for a gigabyte of zeros.
                0x60..=0x9F => None,
                0xE0 if address >> 20 == 0xE00 => {
                    let system = system.get_or_insert_with(|| self.cpu.system.clone());
                    let value = system.read(word, Size::Word, at).ok();
                    value.map(|value| value >> lane)
                }
                _ => {
                    let copy = copy.get_or_insert_with(|| soc.clone());
                    let read = copy.read(word, Size::Word, at).ok();
                    read.map(|read| read.value >> lane)
                }
            };
            match value {
                Some(value) => *byte = value as u8,
                None => return n as usize,
            }
        }
        into.len()
    }

    /// RAM at once; registers as the core would write them, by words. Flash
    /// is not written.
    fn poke(&mut self, from: u32, bytes: &[u8]) -> Option<()> {
        let at = self.cpu.cycle;
        if matches!(from >> 24, 0x10 | 0x20) {
            for (n, &byte) in (0u32..).zip(bytes) {
                let (address, soc) = (from.wrapping_add(n), &mut self.around.soc);
                let ram = if address >> 24 == 0x10 {
                    &mut soc.ccm
                } else {
                    &mut soc.ram
                };
                ram.write(address, Size::Byte, byte.into())?;
            }
            return Some(());
        }
        if !from.is_multiple_of(4) || !bytes.len().is_multiple_of(4) || from >> 24 < 0x40 {
            return None;
        }
        for (n, word) in (0u32..).zip(bytes.chunks_exact(4)) {
            let address = from.wrapping_add(4 * n);
            let value = u32::from_le_bytes(*word.first_chunk()?);
            if address >> 20 == 0xE00 {
                let system = &mut self.cpu.system;
                system.write(address, Size::Word, value, at).ok()?;
            } else {
                self.around.write(address, Size::Word, value, at).ok()?;
            }
        }
        Some(())
    }
}

impl Target for Board<Points> {
    type Arch = CortexM4F;
    type Error = Infallible;

    fn base_ops(&mut self) -> BaseOps<'_, CortexM4F, Infallible> {
        BaseOps::SingleThread(self)
    }

    /// Answers that any client can read; a socket needs no compression.
    fn use_rle(&self) -> bool {
        false
    }

    fn support_breakpoints(&mut self) -> Option<BreakpointsOps<'_, Self>> {
        Some(self)
    }
}

impl SingleThreadBase for Board<Points> {
    fn read_registers(&mut self, packed: &mut Packed) -> TargetResult<(), Self> {
        *packed = Packed::pack(&self.cpu.registers, self.cpu.xpsr());
        Ok(())
    }

    fn write_registers(&mut self, packed: &Packed) -> TargetResult<(), Self> {
        packed.unpack(&mut self.cpu.registers);
        Ok(())
    }

    fn read_addrs(&mut self, from: u32, into: &mut [u8]) -> TargetResult<usize, Self> {
        match self.peek(from, into) {
            0 if !into.is_empty() => Err(TargetError::NonFatal),
            count => Ok(count),
        }
    }

    fn write_addrs(&mut self, from: u32, bytes: &[u8]) -> TargetResult<(), Self> {
        self.poke(from, bytes).ok_or(TargetError::NonFatal)
    }

    fn support_resume(&mut self) -> Option<SingleThreadResumeOps<'_, Self>> {
        Some(self)
    }
}

impl SingleThreadResume for Board<Points> {
    fn resume(&mut self, _: Option<Signal>) -> Result<(), Infallible> {
        (self.observer.steps, self.observer.leaves) = (false, true);
        Ok(())
    }

    fn support_single_step(&mut self) -> Option<SingleThreadSingleStepOps<'_, Self>> {
        Some(self)
    }
}

impl SingleThreadSingleStep for Board<Points> {
    fn step(&mut self, _: Option<Signal>) -> Result<(), Infallible> {
        (self.observer.steps, self.observer.leaves) = (true, true);
        Ok(())
    }
}

impl Breakpoints for Board<Points> {
    fn support_sw_breakpoint(&mut self) -> Option<SwBreakpointOps<'_, Self>> {
        Some(self)
    }

    fn support_hw_breakpoint(&mut self) -> Option<HwBreakpointOps<'_, Self>> {
        Some(self)
    }
}

impl SwBreakpoint for Board<Points> {
    fn add_sw_breakpoint(&mut self, address: u32, _: usize) -> TargetResult<bool, Self> {
        Ok(self.observer.add(address))
    }

    fn remove_sw_breakpoint(&mut self, address: u32, _: usize) -> TargetResult<bool, Self> {
        Ok(self.observer.remove(address))
    }
}

impl HwBreakpoint for Board<Points> {
    fn add_hw_breakpoint(&mut self, address: u32, _: usize) -> TargetResult<bool, Self> {
        Ok(self.observer.add(address))
    }

    fn remove_hw_breakpoint(&mut self, address: u32, _: usize) -> TargetResult<bool, Self> {
        Ok(self.observer.remove(address))
    }
}
