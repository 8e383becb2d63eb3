//! Models the debug and trace registers that programs and debuggers use: DEMCR, DHCSR, DWT's cycle
//! counter (Arm ARM C1.6, C1.8). The comparators are in `compare`.

use super::compare::Comparators;
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled};

const TRCENA: u32 = 1 << 24;
const CYCCNTENA: u32 = 1;

/// Constant part of DWT_CTRL: four comparators (TRM table 8-1).
const DWT_CTRL: u32 = 0x4000_0000;

/// Bit C_DEBUGEN of DHCSR.
const C_DEBUGEN: u32 = 1;

/// Address of DWT_COMP0, the first register of the comparators.
const COMP0: u32 = 0xE000_1020;
/// End of the comparators' registers.
const COMP_END: u32 = 0xE000_1060;

/// State of the debug and trace registers.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Trace {
    trcena: bool,
    cyccntena: bool,
    /// Value of the cycle counter while it is stopped; otherwise its difference from the cycle.
    count: u32,
    /// Whether a debugger is attached, so that DHCSR.C_DEBUGEN reads 1.
    pub debugger: bool,
    /// Comparators that watch data.
    pub comparators: Comparators,
}

impl Trace {
    /// Returns the state after a system reset, which keeps the debugger's settings.
    pub fn reset(self) -> Self {
        Self {
            debugger: self.debugger,
            comparators: self.comparators,
            ..Self::default()
        }
    }

    const fn counts(&self) -> bool {
        self.trcena && self.cyccntena
    }

    const fn counter(&self, at: Cycle) -> u32 {
        if self.counts() {
            self.count.wrapping_add(at as u32)
        } else {
            self.count
        }
    }

    fn set_counter(&mut self, value: u32, at: Cycle) {
        let offset = if self.counts() { at as u32 } else { 0 };
        self.count = value.wrapping_sub(offset);
    }

    /// Takes `cycles` off the cycle counter, if it counts: the core's clock was stopped for so
    /// long.
    pub const fn skip_cycles(&mut self, cycles: Cycle) {
        if self.counts() {
            self.count = self.count.wrapping_sub(cycles as u32);
        }
    }

    /// Reads the register at `address`; returns `None` if it is not a debug or trace register.
    pub fn read(&mut self, address: u32, at: Cycle) -> Option<u32> {
        Some(match address {
            0xE000_1000 => DWT_CTRL | self.cyccntena as u32,
            0xE000_1004 => self.counter(at),
            0xE000_EDF0 => self.debugger as u32 * C_DEBUGEN,
            0xE000_EDFC => {
                if self.trcena {
                    TRCENA
                } else {
                    0
                }
            }
            COMP0..COMP_END => return self.comparators.read(address - COMP0),
            _ => return None,
        })
    }

    /// Writes the register at `address`; returns `None` if it is not a debug or trace register.
    pub fn write(&mut self, address: u32, value: u32, at: Cycle) -> Option<Modelled> {
        let counter = self.counter(at);
        match address {
            0xE000_1000 => {
                if value & 0x0FFF_FFFE != 0 {
                    return Some(Err(Unmodelled("a bit of DWT_CTRL other than CYCCNTENA")));
                }
                self.cyccntena = value & CYCCNTENA != 0;
                self.set_counter(counter, at);
            }
            0xE000_1004 => self.set_counter(value, at),
            0xE000_EDFC => {
                if value & !TRCENA != 0 {
                    return Some(Err(Unmodelled("a bit of DEMCR other than TRCENA")));
                }
                self.trcena = value & TRCENA != 0;
                self.set_counter(counter, at);
            }
            COMP0..COMP_END => return self.comparators.write(address - COMP0, value),
            _ => return None,
        }
        Some(Ok(()))
    }
}
