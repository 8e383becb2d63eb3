//! Connects the chip to the core's bus: accesses by the memory map, time, interrupt lines.

use super::map;
use super::matrix::{Bridge, Slave};
use super::rcc::Cause;
use super::registers::{NOTHING, no_answer};
use super::unheeded::IgnoredBits;
use super::watch::FirstAccess;
use super::word::read_part;
use super::{Peripheral, Soc, exti, playback};
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{AccessError, Bus, LINE_WORDS, Modelled, ReadResult, Unmodelled};

/// First address of SRAM2.
const SRAM2: u32 = 0x2001_C000;
/// Addresses of SRAM1, below SRAM2.
const SRAM1: std::ops::Range<u32> = 0x2000_0000..SRAM2;
/// Addresses of system memory, which holds the boot loader (RM0090 section 2.3).
const SYSTEM_MEMORY: std::ops::Range<u32> = 0x1FFF_0000..0x1FFF_7800;
/// First two words of the boot loader: its stack, and the address at which it starts. Only these are
/// modelled; a run ends where the boot loader begins.
const BOOT_LOADER_STACK: u32 = 0x2000_2D40;
const BOOT_LOADER_START: u32 = 0x1FFF_3DB5;
/// Name of the boot loader in a [`Stop::Outside`](crate::chip::cpu::Stop::Outside).
pub(super) const BOOT_LOADER: &str = "the chip's boot loader";
/// Numbers of the interrupt lines: positions in the vector table (RM0090 table 61).
mod line {
    pub const PVD: u32 = 1;
    pub const FLASH: u32 = 4;
    pub const EXTI0: u32 = 6;
    pub const ADC: u32 = 18;
    pub const EXTI9_5: u32 = 23;
    pub const USART2: u32 = 38;
    pub const EXTI15_10: u32 = 40;
    pub const OTG_FS: u32 = 67;
}

impl Bus for Soc {
    #[inline]
    fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<ReadResult, AccessError> {
        match address >> 24 {
            0x20 => {
                self.record_access(address, size, FirstAccess::Read);
                let wait = self.pass_ram(address, at)?;
                let value = self.ram.read(address, size).ok_or(NOTHING)?;
                Ok(ReadResult { value, wait })
            }
            0x08 if address < 0x0810_0000 => self.flash.read(address, size, at),
            0x40..=0xA0 | 0xE0 => {
                let ReadResult { value, wait } = self.read_register(address, size, at)?;
                let value = self.unheeded.apply_to_read(address, value);
                Ok(ReadResult { value, wait })
            }
            0x10 => {
                let value = self.ccm.read(address, size).ok_or(NOTHING)?;
                Ok(ReadResult { value, wait: 0 })
            }
            0x00 if address < 0x0010_0000 => self.flash.read(address, size, at),
            0x1F if SYSTEM_MEMORY.contains(&address) => {
                let value = match address & !3 {
                    0x1FFF_0000 => BOOT_LOADER_STACK,
                    0x1FFF_0004 => BOOT_LOADER_START,
                    _ => return Err(AccessError::Unmodelled(Unmodelled(BOOT_LOADER))),
                };
                let value = read_part(value, address, size);
                Ok(ReadResult { value, wait: 0 })
            }
            0x1F => self
                .flash
                .read_information(&self.signature, address, size, at)
                .ok_or(AccessError::Unmodelled(Unmodelled("system memory"))),
            _ => Err(no_answer(address)),
        }
    }

    #[inline]
    fn write(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, AccessError> {
        match address >> 24 {
            0x20 => {
                self.record_access(address, size, FirstAccess::Written);
                let wait = self.pass_ram(address, at)?;
                self.ram.write(address, size, value).ok_or(NOTHING)?;
                Ok(wait)
            }
            0x40..=0xA0 | 0xE0 => {
                self.unheeded.note_write(address);
                self.write_register(address, size, value, at)
            }
            0x10 => {
                self.ccm.write(address, size, value).ok_or(NOTHING)?;
                Ok(0)
            }
            0x00 | 0x08 if address & 0x00FF_FFFF < 0x0010_0000 => {
                let wait = self.flash.write(address, size, value, at)?;
                self.reschedule_at(at);
                Ok(wait)
            }
            _ => Err(no_answer(address)),
        }
    }

    /// Reads SRAM1 without wait states. Returns `None` for other memory, while a DMA stream uses
    /// SRAM1, and while accesses are watched.
    #[inline(always)]
    fn read_without_wait(&self, address: u32, size: Size) -> Option<u32> {
        if self.shares[0] || self.watch.is_some() || !SRAM1.contains(&address) {
            return None;
        }
        self.ram.read(address, size)
    }

    /// Writes SRAM1 without wait states. Returns `false`, and writes nothing, for other memory,
    /// while a DMA stream uses SRAM1, and while accesses are watched.
    #[inline(always)]
    fn write_without_wait(&mut self, address: u32, size: Size, value: u32) -> bool {
        !self.shares[0]
            && self.watch.is_none()
            && SRAM1.contains(&address)
            && self.ram.write(address, size, value).is_some()
    }

    fn read_code(&mut self, address: u32) -> Result<u16, AccessError> {
        match address >> 24 {
            0x08 | 0x00 if address & 0x00FF_FFFF < 0x0010_0000 => {
                Ok(self.flash.peek(address, Size::Half) as u16)
            }
            0x20 => Ok(self.ram.read(address, Size::Half).ok_or(NOTHING)? as u16),
            0x1F if SYSTEM_MEMORY.contains(&address) => {
                Err(AccessError::Unmodelled(Unmodelled(BOOT_LOADER)))
            }
            _ => Err(no_answer(address)),
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

    /// Executes all events up to `to` in the order of cycles. A sample of the ADC must be delivered
    /// before time advances beyond it.
    fn advance(&mut self, to: Cycle) -> Modelled {
        self.now = to;
        if to < self.due {
            return Ok(());
        }
        if to < self.event {
            // An access requested this call: only the level of an interrupt line can have changed.
            self.due = self.event;
            self.otg.advance(to)?;
            return self.playback.advance(to, &mut self.ram);
        }
        self.playback.advance(to, &mut self.ram)?;
        let triggers = self.playback.triggers_mut();
        if !triggers.is_empty() {
            for at in triggers.drain(..) {
                self.adc.trigger(at)?;
            }
        }
        self.rcc.advance(to)?;
        self.follow_clocks(to)?;
        self.follow_oscillators(to);
        self.adc.advance(to)?;
        self.spi3.advance(to)?;
        self.flash.advance(to)?;
        self.usart2.advance(to)?;
        self.otg.advance(to)?;
        self.iwdg.advance(to)?;
        if self.iwdg.bitten {
            self.reset = Some(Cause::Watchdog);
        }
        self.event = self.find_event();
        self.due = self.event;
        Ok(())
    }

    fn next_event(&self) -> Cycle {
        self.due
    }

    fn interrupt_lines(&self) -> [u32; LINE_WORDS] {
        let mut lines = self.playback.interrupt_lines();
        let mut set = |line: u32, high: bool| {
            lines[(line / 32) as usize] |= u32::from(high) << (line % 32);
        };
        let pending = self.exti.pending();
        if pending != 0 {
            set(line::PVD, pending & 1 << exti::PVD != 0);
            for n in 0..5 {
                set(line::EXTI0 + n, pending & 1 << n != 0);
            }
            set(line::EXTI9_5, pending & 0x03E0 != 0);
            set(line::EXTI15_10, pending & 0xFC00 != 0);
        }
        set(line::FLASH, self.flash.interrupt());
        set(line::ADC, self.adc.interrupt());
        set(line::USART2, self.usart2.interrupt());
        set(line::OTG_FS, self.otg.line);
        lines
    }

    fn nmi(&self) -> bool {
        self.rcc.cssf
    }

    fn clocks_sleeping_core(&self) -> bool {
        self.dbgmcu.clocks_sleeping_core()
    }

    fn request_reset(&mut self, _at: Cycle) {
        self.reset.get_or_insert(Cause::Software);
    }

    fn is_reset_requested(&self) -> bool {
        self.reset.is_some()
    }
}

impl Soc {
    /// Inverts bits of the configuration register at `address` at cycle `at`, whether or not it is
    /// locked. Radiation or a glitch may do so, but no access can.
    ///
    /// # Errors
    /// Fails if the register cannot be written or the result is not modelled.
    pub fn upset(&mut self, address: u32, bits: u32, at: Cycle) -> Result<(), AccessError> {
        self.advance(at)?;
        if let Some((map::Unit::Playback(playback::Block::Gpio(port)), offset)) =
            map::find_unit(address)
        {
            // Execute earlier events of the tape first.
            self.playback.advance(at, &mut self.ram)?;
            self.playback.gpio.upset(port, offset, bits, at)?;
        } else if let Some((map::Unit::Playback(playback::Block::Dma2), offset)) =
            map::find_unit(address)
            && self
                .playback
                .upset_stream(offset, bits, at, &mut self.ram)?
        {
            self.shares = [Slave::Sram1, Slave::Sram2].map(|s| self.playback.is_shared(s));
        } else if let Some((map::Unit::Rcc, offset)) = map::find_unit(address)
            && self.rcc.upset(offset, bits, at)?
        {
            self.follow_clocks(at)?;
        } else if let Some((map::Unit::Flash, offset)) = map::find_unit(address)
            && self.flash.upset(offset, bits, self.pwr.supply_mv)?
        {
            // Wait states take effect with the next read.
        } else {
            let old = self.read(address, Size::Word, at)?.value;
            self.write(address, Size::Word, old ^ bits, at)?;
        }
        self.reschedule_at(at);
        Ok(())
    }

    /// Makes `bits` of the register at `address` read inverted until the register is written. The
    /// peripheral itself behaves as before.
    pub fn flip_shown_bits(&mut self, address: u32, bits: u32) {
        self.unheeded = IgnoredBits::new(address, bits);
    }

    #[inline]
    fn record_access(&mut self, address: u32, size: Size, first: FirstAccess) {
        if let Some(watch) = &mut self.watch {
            watch.touch(address, size, first);
        }
    }

    /// Returns the wait states of an access to SRAM1 or SRAM2.
    #[inline]
    fn pass_ram(&mut self, address: u32, at: Cycle) -> Result<u32, AccessError> {
        let (slave, shared) = if address < SRAM2 {
            (Slave::Sram1, self.shares[0])
        } else {
            (Slave::Sram2, self.shares[1])
        };
        if !shared {
            return Ok(0);
        }
        Ok(self
            .playback
            .access_slave(slave, Bridge::None, at, &mut self.ram)?)
    }
}
