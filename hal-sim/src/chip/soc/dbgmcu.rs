//! DBGMCU: who the chip is; whether the core's clock goes on in sleep; which timers a
//! halted core stops (RM0090 section 38.16). The simulator's own debugger stops all time, whatever the bits say; a
//! core that is halted in simulated time (`Soc::debug_halt`) heeds them.

use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled};

/// DBGMCU_IDCODE: device 0x413, revision 0x1007 (section 38.6.1).
pub const IDCODE: u32 = 0x1007_6413;

/// CR: the core's clock goes on in sleep. Without it CYCCNT stands there (section 38.16.1
/// says that the clock is off; that the counter then stands, other projects saw).
const DBG_SLEEP: u32 = 1;

/// The three registers CR, APB1FZR, APB2FZR. A system reset leaves them alone.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Dbgmcu {
    registers: [u32; 3],
}

impl Dbgmcu {
    /// Bits that exist, in CR, APB1FZR and APB2FZR.
    const FIELDS: [u32; 3] = [0xE7, 0x06E0_1DFF, 0x0007_0003];

    /// Whether the core's clock goes on while it sleeps.
    pub const fn clocks_sleeping_core(&self) -> bool {
        self.registers[0] & DBG_SLEEP != 0
    }

    /// Whether a halted core stops timer 1 to 5, 11.
    pub const fn stops_timer(&self, number: u8) -> bool {
        match number {
            1 => self.registers[2] & 1 != 0,
            2..=5 => self.registers[1] >> (number - 2) & 1 != 0,
            11 => self.registers[2] >> 18 & 1 != 0,
            _ => false,
        }
    }

    /// Whether it stops the independent watchdog.
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
