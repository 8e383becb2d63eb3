//! The chip as the core's bus.

use super::Soc;
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{Bus, Denied, LINE_WORDS, Modelled, Read, Unmodelled};

impl Bus for Soc {
    #[inline]
    fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<Read, Denied> {
        Self::read(self, address, size, at)
    }

    #[inline]
    fn write(&mut self, address: u32, size: Size, value: u32, at: Cycle) -> Result<u32, Denied> {
        Self::write(self, address, size, value, at)
    }

    #[inline(always)]
    fn read_at_once(&self, address: u32, size: Size) -> Option<u32> {
        Self::read_at_once(self, address, size)
    }

    #[inline(always)]
    fn write_at_once(&mut self, address: u32, size: Size, value: u32) -> bool {
        Self::write_at_once(self, address, size, value)
    }

    fn code(&mut self, address: u32) -> Result<u16, Denied> {
        let outside = Denied::Unmodelled(Unmodelled("code outside flash and RAM"));
        match address >> 24 {
            0x08 | 0x00 if address & 0x00FF_FFFF < 0x0010_0000 => {
                Ok(self.flash.peek(address, Size::Half) as u16)
            }
            0x20 => Ok(self.ram.read(address, Size::Half).ok_or(outside)? as u16),
            _ => Err(outside),
        }
    }

    #[inline]
    fn fetch(&mut self, line: u32, at: Cycle) -> u32 {
        if line >> 24 == 0 {
            self.flash.fetch(line, at)
        } else {
            0 // RAM
        }
    }

    fn is_writable_code(&self, address: u32) -> bool {
        address >> 28 != 0
    }

    fn code_version(&self) -> u32 {
        self.flash.code_version()
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        Self::advance(self, to)
    }

    fn next_event(&self) -> Cycle {
        Self::next_event(self)
    }

    fn lines(&self) -> [u32; LINE_WORDS] {
        Self::lines(self)
    }

    fn nmi(&self) -> bool {
        self.rcc.nmi()
    }

    fn request_reset(&mut self, _at: Cycle) {
        Self::request_reset(self);
    }

    fn wants_reset(&self) -> bool {
        Self::wants_reset(self).is_some()
    }
}
