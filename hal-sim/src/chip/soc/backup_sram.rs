//! Backup SRAM, 4 KiB (RM0090 sections 2.3 and 5.1.2): a system reset leaves it alone. Power
//! that goes takes it along, for nothing here sets PWR_CSR.BRE, by which a battery at VBAT
//! would keep it.

use super::Ram;
use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled};
use crate::chip::cpu::Size;

/// First address.
pub const BASE: u32 = 0x4002_4000;
/// Bytes.
pub const LENGTH: u32 = 0x1000;
/// What silicon holds when power came up is random; this is no copy of anything.
const FADED: u8 = 0xA7;

const OUTSIDE: Unmodelled = Unmodelled("backup SRAM: an access beyond its end");

/// Its clock is RCC_AHB1ENR.BKPSRAMEN.
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
    /// PWR_CR.DBP: without it writes are ignored.
    pub fn set_writable(&mut self, is_writable: bool) {
        self.is_writable = is_writable;
    }

    /// Power is gone, and what it held.
    pub fn lose_contents(&mut self) {
        self.ram.bytes.fill(FADED);
    }

    /// Its bytes, for whoever looks or damages without the bus.
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
