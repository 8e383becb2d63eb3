//! Models the backup registers of the RTC (RM0090 section 26.6.20). The clock and calendar are not
//! modelled.

use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled};

const FIRST: u32 = 0x50;
const COUNT: usize = 20;

/// Registers RTC_BKP0R–RTC_BKP19R. Only a reset of the backup domain clears them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Backup {
    words: [u32; COUNT],
    writable: bool,
}

impl Backup {
    /// Sets whether the registers can be written (PWR_CR.DBP); if not, writes are ignored (section
    /// 5.1.2).
    pub fn set_writable(&mut self, writable: bool) {
        self.writable = writable;
    }

    /// Resets the backup domain: RCC_BDCR.BDRST, or loss of power and battery.
    pub fn reset_domain(&mut self) {
        self.words = [0; COUNT];
    }

    /// Returns RTC_BKPnR without a bus access; 0 beyond the last register.
    pub fn word(&self, n: usize) -> u32 {
        self.words.get(n).copied().unwrap_or(0)
    }

    /// Sets RTC_BKPnR without a bus access, as a tool behind the chip would; does nothing beyond the
    /// last register.
    pub fn put(&mut self, n: usize, value: u32) {
        if let Some(word) = self.words.get_mut(n) {
            *word = value;
        }
    }

    fn index(offset: u32) -> Modelled<usize> {
        let index = (offset.wrapping_sub(FIRST) / 4) as usize;
        if offset >= FIRST && index < COUNT {
            Ok(index)
        } else {
            Err(Unmodelled("RTC register"))
        }
    }
}

impl Peripheral for Backup {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        Ok(self.words[Self::index(offset)?])
    }

    fn write(&mut self, offset: u32, value: u32, _at: Cycle) -> Modelled {
        let index = Self::index(offset)?;
        if self.writable {
            self.words[index] = value;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    #[test]
    fn twenty_words_behind_the_write_protection() {
        let mut backup = Backup::default();
        backup.set(0x50, 1, 0);
        assert_eq!(backup.get(0x50, 0), 0, "DBP is off");
        backup.set_writable(true);
        for n in 0..20 {
            backup.set(0x50 + 4 * n, n + 1, 0);
        }
        backup.set_writable(false);
        backup.set(0x9C, 99, 0);
        assert_eq!(backup.get(0x9C, 0), 20);
        assert!(backup.read(0xA0, 0).is_err());
        assert!(backup.read(0x4C, 0).is_err());
        assert!(backup.read(0, 0).is_err());
        backup.reset_domain();
        assert_eq!(backup.get(0x50, 0), 0);
    }
}
