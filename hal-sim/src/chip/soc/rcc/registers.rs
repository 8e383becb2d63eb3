//! Register map of RCC (RM0090 section 7.3.24).

use super::{APB1, APB2, CSSC, CSSF, LPENR_RESET, PLLCFGR_FIELDS, PLLCFGR_RESET, RMVF, Rcc};
use super::{LSI_START_NS, cr};
use crate::chip::soc::clock::cycles_in;
use crate::chip::soc::peripheral::{Cycle, Modelled, Peripheral, Unmodelled, refuse_if};

const CSR: u32 = 0x74;
const LSION: u32 = 1;
const LSIRDY: u32 = 1 << 1;
const BDRST: u32 = 1 << 16;

/// Returns the bus index of the register at `offset` in a group of registers that begins at `bank`:
/// one each for AHB1–3, a gap, and one each for APB1–2.
const fn bus(offset: u32, bank: u32) -> Option<usize> {
    match offset.wrapping_sub(bank) {
        0x00 => Some(0),
        0x04 => Some(1),
        0x08 => Some(2),
        0x10 => Some(APB1),
        0x14 => Some(APB2),
        _ => None,
    }
}

impl Rcc {
    fn write_reset(&mut self, bus: usize, value: u32) {
        self.new_resets[bus] |= value & !self.resets[bus];
        self.resets[bus] = value;
    }

    /// Writes an enable register. An AHB block answers 2 AHB cycles after its enable, an APB block
    /// 1 APB cycle and 1 AHB cycle after (ES0182).
    fn write_enable(&mut self, bus: usize, value: u32, at: Cycle) {
        let delay = match bus {
            APB1 => 1 + self.clocks.apb1_divider(),
            APB2 => 1 + self.clocks.apb2_divider(),
            _ => 2,
        };
        self.fresh[bus] = value & !self.enables[bus];
        self.settled[bus] = at.saturating_add(u64::from(delay));
        self.enables[bus] = value;
    }

    fn write_csr(&mut self, value: u32, at: Cycle) {
        if value & RMVF != 0 {
            self.csr &= LSION | LSIRDY;
        }
        if value & LSION == 0 {
            self.csr &= !(LSION | LSIRDY);
            self.starting.lsi = Cycle::MAX;
        } else if self.csr & LSION == 0 {
            self.csr |= LSION;
            self.starting.lsi = at.saturating_add(cycles_in(LSI_START_NS, self.clocks.hclk_hz));
        }
    }

    fn write_bdcr(&mut self, value: u32) -> Modelled {
        if !self.backup_writable {
            return Ok(()); // section 5.1.2: write-protected, ignored
        }
        refuse_if(value & !BDRST != 0, "RCC_BDCR: LSE and RTC clock")?;
        self.backup_reset |= value & !self.bdcr & BDRST != 0;
        self.bdcr = value;
        Ok(())
    }

    fn write_cir(&mut self, value: u32) -> Modelled {
        refuse_if(value & 0x3F00 != 0, "RCC_CIR: ready interrupts")?;
        if value & CSSC != 0 {
            self.cssf = false;
        }
        Ok(())
    }
}

impl Peripheral for Rcc {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        let word = match offset {
            0x00 => self.cr,
            0x04 => self.pllcfgr,
            0x08 => self.cfgr & !0xC | self.source.field() << 2,
            0x0C if self.cssf => CSSF,
            0x0C => 0,
            0x70 => self.bdcr,
            CSR => self.csr,
            // 0x8C is DCKCFGR on the F405's successors, and embassy-stm32 reads it on all. Assumed:
            // reserved registers read 0.
            0x80 | 0x8C => 0,
            0x84 => 0x2000_3000,
            register => {
                if let Some(bus) = bus(register, 0x10) {
                    self.resets[bus]
                } else if let Some(bus) = bus(register, 0x30) {
                    self.enables[bus]
                } else if let Some(bus) = bus(register, 0x50) {
                    LPENR_RESET[bus]
                } else {
                    return Err(Unmodelled("RCC register"));
                }
            }
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        match offset {
            0x00 => self.write_cr(value, at)?,
            0x04 if value & PLLCFGR_FIELDS == self.pllcfgr & PLLCFGR_FIELDS => {}
            0x04 => {
                refuse_if(
                    self.cr & cr::PLLON != 0,
                    "RCC_PLLCFGR: written while the PLL is on",
                )?;
                self.pllcfgr = value & PLLCFGR_FIELDS | PLLCFGR_RESET & !PLLCFGR_FIELDS;
            }
            0x08 => self.write_cfgr(value, at)?,
            0x0C => self.write_cir(value)?,
            0x70 => self.write_bdcr(value)?,
            CSR => self.write_csr(value, at),
            0x80 | 0x8C if value == 0 => {}
            register => {
                if let Some(bus) = bus(register, 0x10) {
                    self.write_reset(bus, value);
                } else if let Some(bus) = bus(register, 0x30) {
                    self.write_enable(bus, value, at);
                } else if bus(register, 0x50).is_some_and(|bus| LPENR_RESET[bus] == value) {
                    // Unchanged: every block keeps its clock in sleep mode.
                } else {
                    return Err(Unmodelled("RCC register"));
                }
            }
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        let due = |at: &mut Cycle| {
            let is_due = *at <= to;
            let when = *at;
            if is_due {
                *at = Cycle::MAX;
            }
            is_due.then_some(when)
        };
        let hsi = due(&mut self.starting.hsi).map(|at| (at, cr::HSIRDY));
        let hse = due(&mut self.starting.hse).map(|at| (at, cr::HSERDY));
        let pll = due(&mut self.starting.pll).map(|at| (at, cr::PLLRDY));
        if due(&mut self.starting.lsi).is_some() {
            self.csr |= LSIRDY;
        }
        for (at, ready) in [hsi, hse, pll].into_iter().flatten() {
            self.cr |= ready;
            self.follow_switch(at)?;
        }
        Ok(())
    }

    fn next_event(&self) -> Cycle {
        let Self { starting, .. } = self;
        let core = starting.hsi.min(starting.hse).min(starting.pll);
        core.min(starting.lsi)
    }
}
