//! Models the backup SRAM, 4 KiB (RM0090 sections 2.3 and 5.1.2).
//!
//! A system reset does not change it. A loss of power erases it, because nothing here sets
//! PWR_CSR.BRE, with which a battery at VBAT would keep it.

use super::Ram;
use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled};
use crate::chip::cpu::Size;

/// First address of the backup SRAM.
pub const BASE: u32 = 0x4002_4000;
/// Length of the backup SRAM, bytes.
pub const LENGTH: u32 = 0x1000;
/// Byte that fills the memory after power-up. Real contents are random; a constant that resembles
/// no stored data stands for them.
const FADED: u8 = 0xA7;

const OUTSIDE: Unmodelled = Unmodelled("backup SRAM: an access beyond the end");

/// Backup SRAM, clocked by RCC_AHB1ENR.BKPSRAMEN.
#[derive(Clone, PartialEq, Debug)]
pub struct BackupSram {
    ram: Ram,
    is_writable: bool,
}

impl Default for BackupSram {
    fn default() -> Self {
        let mut sram = Self {
            ram: Ram::new(BASE, LENGTH),
            is_writable: false,
        };
        sram.lose_contents();
        sram
    }
}

impl BackupSram {
    /// Sets whether the memory can be written (PWR_CR.DBP); if not, writes are ignored.
    pub fn set_writable(&mut self, is_writable: bool) {
        self.is_writable = is_writable;
    }

    /// Erases the contents, as a loss of power does.
    pub fn lose_contents(&mut self) {
        self.ram.bytes.fill(FADED);
    }

    /// Returns the bytes, for reading or damaging them without the bus.
    pub fn bytes(&mut self) -> &mut [u8] {
        &mut self.ram.bytes
    }
}

impl Peripheral for BackupSram {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        self.ram.read(BASE + offset, Size::Word).ok_or(OUTSIDE)
    }

    fn write(&mut self, offset: u32, value: u32, _at: Cycle) -> Modelled {
        if self.is_writable {
            let written = self.ram.write(BASE + offset, Size::Word, value);
            return written.ok_or(OUTSIDE);
        }
        Ok(())
    }
}
