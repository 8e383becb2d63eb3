//! The core's bus on a board.

use super::super::wiring;
use super::Surroundings;
use crate::chip::Cycle;
use crate::chip::cpu::bus::{AccessError, Bus, LINE_WORDS, Modelled, ReadResult, Size};

/// Mode register of the pump's port, GPIOB_MODER.
const PUMP_MODER: u32 = 0x4002_0400;

impl Bus for Surroundings {
    #[inline]
    fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<ReadResult, AccessError> {
        self.poll_cable(address, at);
        self.soc.read(address, size, at)
    }

    #[inline]
    fn write(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, AccessError> {
        self.poll_cable(address, at);
        self.margins
            .record_write(address, at.saturating_sub(self.outputs.origin()));
        let done = self.soc.write(address, size, value, at);
        if address & !3 == PUMP_MODER {
            let (port, pin) = wiring::PUMP;
            let is_input = self.soc.playback.gpio.is_input(port.index(), pin.into());
            self.pump_drives += u64::from(!is_input);
        }
        done
    }

    #[inline(always)]
    fn read_without_wait(&self, address: u32, size: Size) -> Option<u32> {
        self.soc.read_without_wait(address, size)
    }

    #[inline(always)]
    fn write_without_wait(&mut self, address: u32, size: Size, value: u32) -> bool {
        // Only for SRAM1, where nothing is observed.
        self.soc.write_without_wait(address, size, value)
    }

    fn read_code(&mut self, address: u32) -> Result<u16, AccessError> {
        self.soc.read_code(address)
    }

    #[inline]
    fn fetch(&mut self, line: u32, at: Cycle) -> u32 {
        self.soc.fetch(line, at)
    }

    fn is_writable_code(&self, address: u32) -> bool {
        self.soc.is_writable_code(address)
    }

    fn code_version(&self) -> u32 {
        self.soc.code_version()
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        loop {
            let next = self.next_event().max(self.now);
            if next >= to {
                break;
            }
            self.advance_step(next)?;
        }
        self.advance_step(to)
    }

    fn next_event(&self) -> Cycle {
        self.soc
            .next_event()
            .min(self.host.next_event(&self.soc.otg))
    }

    #[inline]
    fn interrupt_lines(&self) -> [u32; LINE_WORDS] {
        self.lines
    }

    fn nmi(&self) -> bool {
        self.soc.rcc.cssf
    }

    fn request_reset(&mut self, at: Cycle) {
        self.soc.request_reset(at);
    }

    fn clocks_sleeping_core(&self) -> bool {
        self.soc.clocks_sleeping_core()
    }

    fn is_reset_requested(&self) -> bool {
        self.soc.is_reset_requested()
    }
}
