//! A minimal chip around the core for tests: code memory and RAM, no peripherals.

use super::Size;
use super::bus::{AccessError, Bus, LINE_WORDS, Modelled, ReadResult};
use crate::chip::Cycle;
use crate::chip::soc::Ram;
use std::collections::VecDeque;

/// Memory for tests of the core alone: flash at 0x0800_0000 with its alias at 0, SRAM at
/// 0x2000_0000, CCM at 0x1000_0000, with the sizes of the STM32F405. Every other address is a bus
/// error. There are no wait states unless set; the test sets the interrupt lines.
#[derive(Clone, PartialEq, Debug)]
pub struct Flat {
    /// Levels of the interrupt lines; line n is bit n % 32 of word n / 32.
    pub lines: [u32; LINE_WORDS],
    /// Levels that `lines` takes from a cycle on, in ascending order.
    pub schedule: VecDeque<(Cycle, [u32; LINE_WORDS])>,
    /// Cycle of the last request for a system reset.
    pub reset_requested: Option<Cycle>,
    /// Wait states of every data access to RAM.
    pub ram_wait: u32,
    /// Wait states of fetching a 16-byte line of code, unless it is the line fetched last.
    pub line_wait: u32,
    /// Whether the core's clock stops during sleep.
    pub stops_in_sleep: bool,
    flash: Ram,
    sram: Ram,
    ccm: Ram,
    last_line: u32,
    version: u32,
}

impl Default for Flat {
    /// Returns a chip with zeroed memory, no interrupts and no wait states.
    fn default() -> Self {
        Self {
            lines: [0; LINE_WORDS],
            schedule: VecDeque::new(),
            reset_requested: None,
            ram_wait: 0,
            line_wait: 0,
            stops_in_sleep: false,
            flash: Ram::new(Self::FLASH, Self::FLASH_BYTES),
            sram: Ram::new(Self::SRAM, Self::SRAM_BYTES),
            ccm: Ram::new(Self::CCM, Self::CCM_BYTES),
            last_line: u32::MAX,
            version: 0,
        }
    }
}

impl Flat {
    /// First address of flash.
    pub const FLASH: u32 = 0x0800_0000;
    /// First address of SRAM.
    pub const SRAM: u32 = 0x2000_0000;
    /// First address of the core-coupled RAM.
    pub const CCM: u32 = 0x1000_0000;
    /// Size of the flash, 1 MiB.
    pub const FLASH_BYTES: u32 = 1 << 20;
    /// Size of SRAM1 and SRAM2, 128 KiB.
    pub const SRAM_BYTES: u32 = 128 << 10;
    /// Size of the core-coupled RAM, 64 KiB.
    pub const CCM_BYTES: u32 = 64 << 10;

    /// Copies `bytes` to `address` on, in flash or RAM, and invalidates decoded code. Returns
    /// whether all bytes fit one memory.
    pub fn load(&mut self, address: u32, bytes: &[u8]) -> bool {
        self.version = self.version.wrapping_add(1);
        for (memory, base) in [
            (&mut self.flash, Self::FLASH),
            (&mut self.sram, Self::SRAM),
            (&mut self.ccm, Self::CCM),
        ] {
            let at = address.wrapping_sub(base) as usize;
            let Some(room) = memory.bytes.get_mut(at..) else {
                continue;
            };
            let Some(room) = room.get_mut(..bytes.len()) else {
                continue;
            };
            room.copy_from_slice(bytes);
            return true;
        }
        false
    }

    /// Returns the word at `address` without passing time; `None` if there is no memory.
    pub fn word(&self, address: u32) -> Option<u32> {
        self.peek(address, Size::Word)
    }

    #[inline]
    fn peek(&self, address: u32, size: Size) -> Option<u32> {
        self.sram
            .read(address, size)
            .or_else(|| self.ccm.read(address, size))
            .or_else(|| self.peek_flash(address, size))
    }

    #[inline]
    fn peek_flash(&self, address: u32, size: Size) -> Option<u32> {
        let address = if address < Self::FLASH_BYTES {
            address + Self::FLASH
        } else {
            address
        };
        self.flash.read(address, size)
    }
}

impl Bus for Flat {
    #[inline]
    fn read(&mut self, address: u32, size: Size, _at: Cycle) -> Result<ReadResult, AccessError> {
        let value = self.peek(address, size).ok_or(AccessError::Error)?;
        let wait = self.ram_wait;
        Ok(ReadResult { value, wait })
    }

    #[inline]
    fn write(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        _at: Cycle,
    ) -> Result<u32, AccessError> {
        self.sram
            .write(address, size, value)
            .or_else(|| self.ccm.write(address, size, value))
            .ok_or(AccessError::Error)?;
        Ok(self.ram_wait)
    }

    #[inline]
    fn read_code(&mut self, address: u32) -> Result<u16, AccessError> {
        let code = self.peek(address, Size::Half).ok_or(AccessError::Error)?;
        Ok((code & 0xFFFF) as u16)
    }

    #[inline]
    fn fetch(&mut self, line: u32, _at: Cycle) -> u32 {
        let again = line == self.last_line;
        self.last_line = line;
        if again { 0 } else { self.line_wait }
    }

    #[inline]
    fn is_writable_code(&self, address: u32) -> bool {
        address >= Self::CCM
    }

    #[inline]
    fn code_version(&self) -> u32 {
        self.version
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        while let Some((_, levels)) = self.schedule.pop_front_if(|(at, _)| *at <= to) {
            self.lines = levels;
        }
        Ok(())
    }

    #[inline]
    fn next_event(&self) -> Cycle {
        self.schedule.front().map_or(Cycle::MAX, |(at, _)| *at)
    }

    fn interrupt_lines(&self) -> [u32; LINE_WORDS] {
        self.lines
    }

    fn clocks_sleeping_core(&self) -> bool {
        !self.stops_in_sleep
    }

    fn request_reset(&mut self, at: Cycle) {
        self.reset_requested = Some(at);
    }
}
