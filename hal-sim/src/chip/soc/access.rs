//! The core's data accesses, by the memory map.

use super::map::{self, Unit};
use super::matrix::{Bridge, Slave};
use super::{Peripheral, Soc, playback};
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{Denied, Modelled, Read, Unmodelled};

/// First address of SRAM2.
const SRAM2: u32 = 0x2001_C000;
/// SRAM1.
const SRAM1: std::ops::Range<u32> = 0x2000_0000..SRAM2;
/// An access to AHB2 or to the debug support: the manuals give no wait states.
const UNSHARED_WAIT: u32 = 0;

impl Soc {
    /// See [`crate::chip::cpu::Bus::read`].
    #[inline]
    pub fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<Read, Denied> {
        match address >> 24 {
            0x20 => {
                let wait = self.pass_ram(address, at)?;
                let value = self.ram.read(address, size).ok_or(BEYOND_RAM)?;
                Ok(Read { value, wait })
            }
            0x08 if address < 0x0810_0000 => self.flash.read(address, size, at),
            0x40..=0x50 | 0xE0 => self.read_register(address, size, at),
            0x10 => {
                let value = self.ccm.read(address, size).ok_or(BEYOND_RAM)?;
                Ok(Read { value, wait: 0 })
            }
            0x00 if address < 0x0010_0000 => self.flash.read(address, size, at),
            0x1F => self
                .flash
                .read_information(&self.signature, address, size, at)
                .ok_or(Denied::Unmodelled(Unmodelled("system memory"))),
            _ => Err(RESERVED),
        }
    }

    /// See [`crate::chip::cpu::Bus::write`].
    #[inline]
    pub fn write(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, Denied> {
        match address >> 24 {
            0x20 => {
                let wait = self.pass_ram(address, at)?;
                self.ram.write(address, size, value).ok_or(BEYOND_RAM)?;
                Ok(wait)
            }
            0x40..=0x50 | 0xE0 => self.write_register(address, size, value, at),
            0x10 => {
                self.ccm.write(address, size, value).ok_or(BEYOND_RAM)?;
                Ok(0)
            }
            0x08 if address < 0x0810_0000 => {
                let wait = self.flash.write(address, size, value, at)?;
                self.reschedule_at(at);
                Ok(wait)
            }
            _ => Err(RESERVED),
        }
    }

    /// See [`crate::chip::cpu::Bus::read_at_once`]: SRAM1 while no DMA uses it.
    #[inline(always)]
    pub fn read_at_once(&self, address: u32, size: Size) -> Option<u32> {
        if self.shares[0] || !SRAM1.contains(&address) {
            return None;
        }
        self.ram.read(address, size)
    }

    /// See [`crate::chip::cpu::Bus::write_at_once`]: SRAM1 while no DMA uses it.
    #[inline(always)]
    pub fn write_at_once(&mut self, address: u32, size: Size, value: u32) -> bool {
        !self.shares[0]
            && SRAM1.contains(&address)
            && self.ram.write(address, size, value).is_some()
    }

    /// Wait states of an access to SRAM1 or SRAM2.
    #[inline]
    fn pass_ram(&mut self, address: u32, at: Cycle) -> Result<u32, Denied> {
        let (slave, shared) = if address < SRAM2 {
            (Slave::Sram1, self.shares[0])
        } else {
            (Slave::Sram2, self.shares[1])
        };
        if !shared {
            return Ok(0);
        }
        Ok(self.playback.pass(slave, Bridge::None, at, &mut self.ram)?)
    }

    #[inline(never)]
    fn read_register(&mut self, address: u32, size: Size, at: Cycle) -> Result<Read, Denied> {
        let (unit, offset) = map::find(address).ok_or(RESERVED)?;
        self.check_clock(unit, at)?;
        self.due = at;
        if let Unit::Playback(block) = unit {
            let read = self.playback.read(block, offset, size, at, &mut self.ram)?;
            self.event = self.event.min(self.playback.next_event());
            return Ok(read);
        }
        let wait = self.pass_register(unit, at)?;
        let done = at + Cycle::from(wait);
        let unit = self.peripheral(unit);
        unit.advance(done)?;
        let value = unit.read(offset, size, done)?;
        let event = unit.next_event();
        self.event = self.event.min(event);
        Ok(Read { value, wait })
    }

    #[inline(never)]
    fn write_register(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, Denied> {
        let (unit, offset) = map::find(address).ok_or(RESERVED)?;
        self.check_clock(unit, at)?;
        self.due = at;
        if let Unit::Playback(block) = unit {
            let wait = self
                .playback
                .write(block, offset, size, value, at, &mut self.ram)?;
            self.event = self.event.min(self.playback.next_event());
            if block == playback::Block::Dma2 {
                self.shares = [Slave::Sram1, Slave::Sram2].map(|s| self.playback.shares(s));
            }
            return Ok(wait);
        }
        let wait = self.pass_register(unit, at)?;
        let done = at + Cycle::from(wait);
        let peripheral = self.peripheral(unit);
        peripheral.advance(done)?;
        peripheral.write(offset, size, value, done)?;
        let event = peripheral.next_event();
        self.event = self.event.min(event);
        self.follow_write(unit, done)?;
        Ok(wait)
    }

    /// Silicon answers 0 and loses writes; here it is a mistake of the program.
    fn check_clock(&self, unit: Unit, at: Cycle) -> Modelled {
        // An access reaches a block behind a bridge with a later APB clock.
        let clocks = self.rcc.clocks();
        let divider = match unit.bridge() {
            Some(Bridge::Apb1) => clocks.apb1_divider(),
            Some(Bridge::Apb2) => clocks.apb2_divider(),
            _ => 1,
        };
        let reached = (at + 1).next_multiple_of(divider.into());
        match unit.clock() {
            Some(block) if !self.rcc.is_enabled(block, reached)? => {
                Err(Unmodelled("a peripheral whose clock is off"))
            }
            _ => Ok(()),
        }
    }

    fn pass_register(&mut self, unit: Unit, at: Cycle) -> Modelled<u32> {
        match unit.bridge() {
            Some(bridge) => self.playback.pass(Slave::Ahb1, bridge, at, &mut self.ram),
            None => Ok(UNSHARED_WAIT),
        }
    }

    fn peripheral(&mut self, unit: Unit) -> &mut dyn Peripheral {
        match unit {
            Unit::Backup => &mut self.backup,
            Unit::Iwdg => &mut self.iwdg,
            Unit::Spi3 => &mut self.spi3,
            Unit::Usart2 => &mut self.usart2,
            Unit::Pwr => &mut self.pwr,
            Unit::Adc => &mut self.adc,
            Unit::Syscfg => &mut self.syscfg,
            Unit::Exti => &mut self.exti,
            Unit::Rcc => &mut self.rcc,
            Unit::Flash => &mut self.flash,
            Unit::Otg => &mut self.otg,
            // `Playback` is served before.
            Unit::Dbgmcu | Unit::Playback(_) => &mut self.dbgmcu,
        }
    }
}

const RESERVED: Denied = Denied::Unmodelled(Unmodelled("an address where nothing is modelled"));
const BEYOND_RAM: Denied = Denied::Unmodelled(Unmodelled("an address beyond the RAM"));
