//! Models DBGMCU (RM0090 section 38.16): the identity of the chip, whether the core clock runs in
//! sleep, and which timers a halted core stops.
//!
//! The simulator's own debugger stops all time, regardless of these bits; they apply to a core that
//! is halted in simulated time (`Soc::debug_halt`).

use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled};

/// DBGMCU_IDCODE: device 0x413, revision 0x1007 (section 38.6.1).
pub const IDCODE: u32 = 0x1007_6413;

/// CR bit with which the core clock runs in sleep. Without it CYCCNT stops in sleep. (Section
/// 38.16.1 says that the clock is off; other projects observed that the counter stops.)
const DBG_SLEEP: u32 = 1;

/// Registers CR, APB1FZR and APB2FZR. A system reset does not change them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Dbgmcu {
    registers: [u32; 3],
}

impl Dbgmcu {
    /// Existing bits of CR, APB1FZR and APB2FZR.
    const FIELDS: [u32; 3] = [0xE7, 0x06E0_1DFF, 0x0007_0003];

    /// Returns whether the core clock runs while the core sleeps.
    pub const fn clocks_sleeping_core(&self) -> bool {
        self.registers[0] & DBG_SLEEP != 0
    }

    /// Returns whether a halted core stops timer `number`, 1 to 5 or 11.
    pub const fn stops_timer(&self, number: u8) -> bool {
        match number {
            1 => self.registers[2] & 1 != 0,
            2..=5 => self.registers[1] >> (number - 2) & 1 != 0,
            11 => self.registers[2] >> 18 & 1 != 0,
            _ => false,
        }
    }

    /// Returns whether a halted core stops the independent watchdog.
    pub const fn stops_watchdog(&self) -> bool {
        self.registers[1] & 1 << 12 != 0
    }
}

impl Peripheral for Dbgmcu {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        let word = match offset {
            0 => IDCODE,
            register @ 4..=0xC => self.registers[register as usize / 4 - 1],
            _ => return Err(Unmodelled("DBGMCU register")),
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, _at: Cycle) -> Modelled {
        match offset {
            4 | 8 | 0xC => {
                let index = offset as usize / 4 - 1;
                self.registers[index] = value & Self::FIELDS[index];
                Ok(())
            }
            _ => Err(Unmodelled("DBGMCU register")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    #[test]
    fn it_names_the_device_and_keeps_its_bits() {
        let mut dbgmcu = Dbgmcu::default();
        assert_eq!(dbgmcu.get(0, 0), 0x1007_6413);
        assert!(!dbgmcu.clocks_sleeping_core());
        for (offset, kept) in [(4, 0xE7), (8, 0x06E0_1DFF), (12, 0x0007_0003)] {
            dbgmcu.set(offset, u32::MAX, 0);
            assert_eq!(dbgmcu.get(offset, 0), kept);
        }
        assert!(dbgmcu.clocks_sleeping_core());
        assert!(dbgmcu.write(0, 0, 0).is_err());
        assert!(dbgmcu.read(16, 0).is_err());
    }
}
