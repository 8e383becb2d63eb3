//! Register accesses of the core: finds the block that answers, and determines time and width of
//! the access.

use super::map::{self, Unit};
use super::matrix::{Bridge, Slave};
use super::word::read_part;
use super::{Peripheral, Soc, playback, width};
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{AccessError, Modelled, ReadResult, Unmodelled};

/// Wait states of an access to AHB2 or to the debug support, for which the manuals give no figure.
const UNSHARED_WAIT: u32 = 0;

const DEBUG_SUPPORT: AccessError = AccessError::Unmodelled(Unmodelled("this debug register"));
const UNMODELLED: AccessError = AccessError::Unmodelled(Unmodelled("this peripheral"));
/// Bus error for an address without a block. DS8626 and RM0090 call such addresses reserved and say
/// no more; AHB's default slave answers with an error (IHI 0033, 2.4).
pub(super) const NOTHING: AccessError = AccessError::Error;
/// Addresses of the debug support outside the core, which exists but is not modelled.
const DEBUG: std::ops::RangeInclusive<u32> = 0xE004_0000..=0xE00F_FFFF;

/// Returns the error for `address`, at which no block with a clock answers.
pub(super) fn no_answer(address: u32) -> AccessError {
    match DEBUG.contains(&address) {
        true => DEBUG_SUPPORT,
        false => NOTHING,
    }
}

impl Soc {
    #[inline(never)]
    pub(super) fn read_register(
        &mut self,
        address: u32,
        size: Size,
        at: Cycle,
    ) -> Result<ReadResult, AccessError> {
        let Some((unit, offset)) = map::find_unit(address) else {
            self.find_silent(address)?;
            return Ok(ReadResult {
                value: 0,
                wait: UNSHARED_WAIT,
            });
        };
        if !self.has_clock(unit, at)? {
            self.unclocked += 1;
            let wait = self.pass_register(unit, at)?;
            return Ok(ReadResult { value: 0, wait });
        }
        self.due = at;
        width::check_read(unit, offset, size)?;
        let register = offset & !3;
        if let Unit::Playback(block) = unit {
            let ReadResult { value, wait } =
                self.playback.read(block, register, at, &mut self.ram)?;
            self.event = self.event.min(self.playback.next_event());
            let value = read_part(value, offset, size);
            return Ok(ReadResult { value, wait });
        }
        let wait = self.pass_register(unit, at)?;
        let done = at + Cycle::from(wait);
        let unit = self.peripheral(unit);
        unit.advance(done)?;
        let value = read_part(unit.read(register, done)?, offset, size);
        let event = unit.next_event();
        self.event = self.event.min(event);
        Ok(ReadResult { value, wait })
    }

    #[inline(never)]
    pub(super) fn write_register(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, AccessError> {
        let Some((unit, offset)) = map::find_unit(address) else {
            self.find_silent(address)?;
            return Ok(UNSHARED_WAIT);
        };
        if !self.has_clock(unit, at)? {
            self.unclocked += 1;
            return Ok(self.pass_register(unit, at)?);
        }
        self.due = at;
        let written = width::written_lanes(unit, offset, size, value)?;
        let register = offset & !3;
        if let Unit::Playback(block) = unit {
            let wait = self
                .playback
                .write(block, register, written, at, &mut self.ram)?;
            self.event = self.event.min(self.playback.next_event());
            if block == playback::Block::Dma2 {
                self.shares = [Slave::Sram1, Slave::Sram2].map(|s| self.playback.is_shared(s));
            }
            return Ok(wait);
        }
        let wait = self.pass_register(unit, at)?;
        let done = at + Cycle::from(wait);
        let peripheral = self.peripheral(unit);
        peripheral.advance(done)?;
        let value = match written.is_whole() {
            true => written.value,
            false => written.merge_into(peripheral.read(register, done)?),
        };
        peripheral.write(register, value, done)?;
        let event = peripheral.next_event();
        self.event = self.event.min(event);
        self.follow_write(unit, done)?;
        Ok(wait)
    }

    /// Accepts an access to a block that is not modelled while its clock is off, and fails
    /// otherwise.
    fn find_silent(&mut self, address: u32) -> Result<(), AccessError> {
        match map::unmodelled_clock(address) {
            Some(clock) if self.rcc.is_set(clock) => Err(UNMODELLED),
            Some(_) => {
                self.unclocked += 1;
                Ok(())
            }
            None => Err(no_answer(address)),
        }
    }

    /// Returns whether `unit` answers: without its clock, or held in reset, reads give 0 and writes
    /// are ignored (RM0090 section 7.3.10, the note on enables).
    fn has_clock(&self, unit: Unit, at: Cycle) -> Modelled<bool> {
        // An access reaches a block behind a bridge at a later APB clock.
        let clocks = self.rcc.clocks;
        let divider = match unit.bridge() {
            Some(Bridge::Apb1) => clocks.apb1_divider(),
            Some(Bridge::Apb2) => clocks.apb2_divider(),
            _ => 1,
        };
        let reached = (at + 1).next_multiple_of(divider.into());
        let block = unit.clock();
        block.map_or(Ok(true), |block| self.rcc.is_enabled(block, reached))
    }

    fn pass_register(&mut self, unit: Unit, at: Cycle) -> Modelled<u32> {
        let Some(bridge) = unit.bridge() else {
            return Ok(UNSHARED_WAIT);
        };
        let wait = self
            .playback
            .access_slave(Slave::Ahb1, bridge, at, &mut self.ram)?;
        Ok(match unit {
            Unit::Crc => wait + self.crc.wait(at + Cycle::from(wait)),
            _ => wait,
        })
    }

    fn peripheral(&mut self, unit: Unit) -> &mut dyn Peripheral {
        match unit {
            Unit::Backup => &mut self.backup,
            Unit::BackupSram => &mut self.backup_sram,
            Unit::Iwdg => &mut self.iwdg,
            Unit::Spi3 => &mut self.spi3,
            Unit::Usart2 => &mut self.usart2,
            Unit::Pwr => &mut self.pwr,
            Unit::Adc => &mut self.adc,
            Unit::Syscfg => &mut self.syscfg,
            Unit::Exti => &mut self.exti,
            Unit::Rcc => &mut self.rcc,
            Unit::Crc => &mut self.crc,
            Unit::Flash => &mut self.flash,
            Unit::Tim11 => &mut self.tim11,
            Unit::Otg => &mut self.otg,
            // `Playback` was handled earlier.
            Unit::Dbgmcu | Unit::Playback(_) => &mut self.dbgmcu,
        }
    }
}
