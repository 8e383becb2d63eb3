//! Models EXTI (RM0090 chapter 12): 23 lines whose edges are latched in PR.

use super::Syscfg;
use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled};

/// Line of the programmable voltage detector.
pub const PVD: usize = 16;
/// Mask of lines 0–22.
const LINES: u32 = 0x007F_FFFF;

const IMR: u32 = 0x00;
const EMR: u32 = 0x04;
const RTSR: u32 = 0x08;
const FTSR: u32 = 0x0C;
const SWIER: u32 = 0x10;
const PR: u32 = 0x14;

/// External interrupt controller.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Exti {
    imr: u32,
    rtsr: u32,
    ftsr: u32,
    swier: u32,
    pr: u32,
}

impl Exti {
    /// Processes a change of the signal on `line` to `high`; latches it if that edge is selected.
    /// Lines beyond 22 are ignored.
    pub fn edge(&mut self, line: usize, high: bool) {
        let selected = if high { self.rtsr } else { self.ftsr };
        self.pr |= selected & LINES & 1u32.checked_shl(line as u32).unwrap_or(0);
    }

    /// Processes a change of a pin's level to `high`: passes it on to EXTI line `pin`, if SYSCFG
    /// connects that line to `port`.
    pub fn pin(&mut self, port: usize, pin: usize, high: bool, syscfg: &Syscfg) {
        if pin < 16 && syscfg.port(pin) == port {
            self.edge(pin, high);
        }
    }

    /// Returns the lines that request an interrupt, bit n is line n. Lines 5–9 and 10–15 share one
    /// NVIC input each (RM0090 table 61).
    pub const fn pending(&self) -> u32 {
        self.pr & self.imr
    }
}

impl Peripheral for Exti {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        match offset {
            IMR => Ok(self.imr),
            EMR => Ok(0),
            RTSR => Ok(self.rtsr),
            FTSR => Ok(self.ftsr),
            SWIER => Ok(self.swier),
            PR => Ok(self.pr),
            _ => Err(Unmodelled("an EXTI register")),
        }
    }

    fn write(&mut self, offset: u32, value: u32, _: Cycle) -> Modelled {
        let value = value & LINES;
        match offset {
            IMR => self.imr = value,
            EMR if value == 0 => (),
            EMR => return Err(Unmodelled("EXTI events (EMR)")),
            RTSR => self.rtsr = value,
            FTSR => self.ftsr = value,
            SWIER => {
                // A bit that changes from 0 to 1 sets PR; only PR clears it.
                self.pr |= value & !self.swier & self.imr;
                self.swier |= value;
            }
            PR => {
                self.pr &= !value;
                self.swier &= !value;
            }
            _ => return Err(Unmodelled("an EXTI register")),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    #[test]
    fn only_selected_edges_are_latched_and_writing_one_clears() {
        let mut exti = Exti::default();
        exti.set(FTSR, 1 << 7, 0);
        exti.set(RTSR, 1 << PVD, 0);
        exti.edge(7, true);
        exti.edge(PVD, false);
        exti.edge(40, true);
        assert_eq!(exti.get(PR, 0), 0);
        exti.edge(7, false);
        exti.edge(PVD, true);
        assert_eq!(exti.get(PR, 0), 1 << 7 | 1 << PVD);
        assert_eq!(exti.pending(), 0, "masked");
        exti.set(IMR, 1 << 7, 0);
        assert_eq!(exti.pending(), 1 << 7);
        exti.set(PR, 1 << 7, 0);
        assert_eq!(exti.pending(), 0);
    }

    #[test]
    fn a_pin_reaches_its_line_through_syscfg_only() {
        let (mut exti, mut syscfg) = (Exti::default(), Syscfg::default());
        exti.set(FTSR, 1 << 7, 0);
        exti.set(IMR, 1 << 7, 0);
        exti.pin(1, 7, false, &syscfg);
        assert_eq!(exti.pending(), 0);
        exti.pin(0, 7, false, &syscfg);
        assert_eq!(exti.pending(), 1 << 7);
        exti.set(PR, 1 << 7, 0);
        syscfg.set(0x0C, 1 << 12, 0);
        exti.pin(1, 7, false, &syscfg);
        assert_eq!(exti.pending(), 1 << 7);
    }

    #[test]
    fn software_raises_a_line_once_until_it_is_cleared() {
        let mut exti = Exti::default();
        exti.set(IMR, 1, 0);
        exti.set(SWIER, 1, 0);
        assert_eq!(exti.pending(), 1);
        exti.set(PR, 1, 0);
        assert_eq!(exti.get(SWIER, 0), 0);
        exti.set(SWIER, 1, 0);
        assert_eq!(exti.pending(), 1);
        assert!(exti.write(EMR, 1, 0).is_err());
    }
}
