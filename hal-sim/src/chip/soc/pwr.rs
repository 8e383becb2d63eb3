//! Models PWR: write protection of the backup domain, regulator scale, supply supervision (RM0090
//! chapter 5, F405).
//!
//! Low-power modes other than sleep are not modelled. The voltage detector is assumed to have no
//! delay.

use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled, refuse_if};

const CR: u32 = 0;
const CSR: u32 = 4;
const PVDE: u32 = 1 << 4;
const DBP: u32 = 1 << 8;
const VOS: u32 = 1 << 14;
/// Reserved on the F405, part of VOS on its successors: common drivers set it.
const RESERVED_VOS: u32 = 1 << 15;
const CLEAR_FLAGS: u32 = 0b11 << 2;
/// LPDS, PDDS, FPDS, which only select among modes that need SLEEPDEEP.
const DEEP: u32 = 0b11 | 1 << 9;
const PVDO: u32 = 1 << 2;
const VOSRDY: u32 = 1 << 14;

/// Thresholds of levels PLS 0–7 for a falling and a rising supply, mV, typical (DS8626, embedded
/// reset and power control block characteristics).
const THRESHOLDS_MV: [(u32, u32); 8] = [
    (2040, 2140),
    (2190, 2300),
    (2350, 2450),
    (2510, 2600),
    (2660, 2760),
    (2840, 2930),
    (2930, 3030),
    (3030, 3140),
];
/// Voltages at which a falling supply resets the chip and a rising one releases it, mV, typical
/// (the same table), for BOR_LEV 0 to 3 of the option bytes: brown-out level 3, 2, 1, and off,
/// where only power-down and power-on reset act.
const BROWN_OUT_MV: [(u32, u32); 4] = [(2830, 2920), (2500, 2590), (2190, 2290), (1680, 1720)];

/// Power control.
#[derive(Clone, PartialEq, Debug)]
pub struct Pwr {
    cr: u32,
    /// Voltage of the supply, mV.
    pub(crate) supply_mv: u32,
    /// PVDO, the level of EXTI line 16: whether the supply is below the threshold.
    pub(crate) low: bool,
    /// Whether the supply is above the power-down and the brown-out level; otherwise the chip is
    /// held in reset.
    pub(crate) powered: bool,
}

impl Default for Pwr {
    /// Registers in their reset state, with a supply of 3.3 V.
    fn default() -> Self {
        Self {
            cr: VOS,
            supply_mv: 3300,
            low: false,
            powered: true,
        }
    }
}

impl Pwr {
    /// Resets the registers; the supply stays.
    pub fn reset(&mut self) {
        self.cr = VOS;
        self.low = false;
    }

    /// Sets the supply to `mv` millivolts from now on, with BOR_LEV of the option bytes.
    pub fn supply(&mut self, mv: u32, bor_lev: u32) {
        self.supply_mv = mv;
        let (falling, rising) = BROWN_OUT_MV[(bor_lev & 3) as usize];
        self.powered = mv >= if self.powered { falling } else { rising };
        self.watch();
    }

    /// Checks whether the regulator scale suffices for a core clock of `hz`. The limits of scale 1
    /// follow from those of the clocks.
    ///
    /// # Errors
    /// Fails if scale 2 is selected above 144 MHz (RM0090 section 5.1.3).
    pub fn check_scale(&self, hz: u32) -> Modelled {
        refuse_if(
            self.cr & VOS == 0 && hz > 144_000_000,
            "PWR_CR: regulator scale 2 above 144 MHz",
        )
    }

    /// Returns whether backup registers and RCC_BDCR can be written (PWR_CR.DBP).
    pub const fn is_backup_writable(&self) -> bool {
        self.cr & DBP != 0
    }

    fn watch(&mut self) {
        let (falling, rising) = THRESHOLDS_MV[(self.cr >> 5 & 7) as usize];
        let threshold = if self.low { rising } else { falling };
        self.low = self.cr & PVDE != 0 && self.supply_mv < threshold;
    }
}

impl Peripheral for Pwr {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        let word = match offset {
            CR => self.cr,
            CSR => VOSRDY | if self.low { PVDO } else { 0 },
            _ => return Err(Unmodelled("PWR register")),
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, _at: Cycle) -> Modelled {
        match offset {
            CR => {
                let known = PVDE | 7 << 5 | DBP | VOS | RESERVED_VOS | CLEAR_FLAGS | DEEP;
                refuse_if(value & !known != 0, "PWR_CR: reserved bits")?;
                self.cr = value & (PVDE | 7 << 5 | DBP | VOS | DEEP);
                self.watch();
                Ok(())
            }
            CSR if value & 0x0300 == 0 => Ok(()),
            _ => Err(Unmodelled("PWR register")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    #[test]
    fn the_supply_watch_has_the_thresholds_and_hysteresis_of_the_data_sheet() {
        let mut pwr = Pwr::default();
        pwr.supply(1900, 3);
        assert!(!pwr.low, "off after reset");
        pwr.supply(3300, 3);
        for (level, (falling, rising)) in (0..).zip(THRESHOLDS_MV) {
            pwr.supply(3300, 3);
            pwr.set(CR, VOS | PVDE | level << 5, 0);
            assert!(!pwr.low);
            pwr.supply(falling, 3);
            assert!(!pwr.low);
            pwr.supply(falling - 1, 3);
            assert!(pwr.low);
            assert_eq!(pwr.get(CSR, 0), VOSRDY | PVDO);
            pwr.supply(rising - 1, 3);
            assert!(pwr.low);
            pwr.supply(rising, 3);
            assert!(!pwr.low);
        }
    }

    #[test]
    fn the_chip_has_power_above_the_brown_out_level() {
        for (bor_lev, (falling, rising)) in (0..).zip(BROWN_OUT_MV) {
            let mut pwr = Pwr::default();
            for (mv, powered) in [
                (falling, true),
                (falling - 1, false),
                (rising - 1, false),
                (rising, true),
            ] {
                pwr.supply(mv, bor_lev);
                assert_eq!(pwr.powered, powered, "level {bor_lev}, {mv} mV");
            }
        }
    }

    #[test]
    fn control_resets_as_printed_and_keeps_no_reserved_bit() {
        let mut pwr = Pwr::default();
        assert_eq!(pwr.get(CR, 0), 0x4000);
        assert!(!pwr.is_backup_writable());
        pwr.set(CR, 0xC100, 0);
        assert_eq!(pwr.get(CR, 0), 0x4100);
        assert!(pwr.is_backup_writable());
        assert!(pwr.check_scale(168_000_000).is_ok());
        pwr.set(CR, 0x0100, 0);
        assert!(pwr.check_scale(144_000_000).is_ok(), "scale 2");
        assert!(pwr.check_scale(144_000_001).is_err());
        pwr.reset();
        assert_eq!(pwr.get(CR, 0), 0x4000);
    }
}
