//! Models SYSCFG (RM0090 chapter 9): selects the port of each EXTI line.

use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled};

const MEMRMP: u32 = 0x00;
const PMC: u32 = 0x04;
const EXTICR1: u32 = 0x08;
const EXTICR4: u32 = 0x14;
const CMPCR: u32 = 0x20;

/// System configuration controller. The compensation cell is not modelled, and neither is the memory
/// at address 0 after remapping.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Syscfg {
    exticr: [u32; 4],
    memrmp: u32,
}

impl Syscfg {
    /// Returns the port (0 is A) connected to EXTI line `line`, 0–15.
    pub fn port(&self, line: usize) -> usize {
        let exticr = self.exticr.get(line / 4).copied().unwrap_or(0);
        (exticr >> (4 * (line % 4)) & 0xF) as usize
    }
}

impl Peripheral for Syscfg {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        match offset {
            MEMRMP => Ok(self.memrmp),
            PMC | CMPCR => Ok(0),
            EXTICR1..=EXTICR4 => Ok(self.exticr[(offset - EXTICR1) as usize / 4]),
            _ => Err(Unmodelled("a SYSCFG register")),
        }
    }

    fn write(&mut self, offset: u32, value: u32, _: Cycle) -> Modelled {
        match (offset, value) {
            (MEMRMP, 0..=3) => self.memrmp = value,
            (PMC | CMPCR, 0) => (),
            (EXTICR1..=EXTICR4, _) => {
                self.exticr[(offset - EXTICR1) as usize / 4] = value & 0xFFFF;
            }
            _ => return Err(Unmodelled("a SYSCFG register")),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    #[test]
    fn each_line_has_four_bits_for_its_port() {
        let mut syscfg = Syscfg::default();
        syscfg.set(0x0C, 0x2_1070, 0);
        assert_eq!(syscfg.get(0x0C, 0), 0x1070);
        assert_eq!([4, 5, 6, 7].map(|line| syscfg.port(line)), [0, 7, 0, 1]);
        syscfg.set(MEMRMP, 1, 0);
        assert_eq!(syscfg.get(MEMRMP, 0), 1);
        assert!(syscfg.write(MEMRMP, 4, 0).is_err());
    }
}
