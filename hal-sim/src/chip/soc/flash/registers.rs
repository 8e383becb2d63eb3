//! Registers of the flash interface (RM0090 section 3.9).

use super::Flash;
use crate::chip::soc::peripheral::{Cycle, Modelled, Peripheral, Unmodelled, refuse_if};

impl Flash {
    pub(super) fn set_acr(&mut self, value: u32) -> Modelled {
        self.accelerator
            .set_acr(value)
            .ok_or(Unmodelled("FLASH_ACR: reset of a cache that is on"))
    }
}

impl Peripheral for Flash {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        let word = match offset {
            0x00 => self.accelerator.acr(),
            0x04 | 0x08 => 0,
            0x0C => self.programming.status(),
            0x10 => self.programming.cr,
            0x14 => self.programming.option_control(),
            _ => return Err(Unmodelled("FLASH register")),
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        match offset {
            0x00 => self.set_acr(value),
            0x04 => self.programming.write_key(value),
            0x0C => {
                self.programming.clear(value);
                Ok(())
            }
            0x10 => self.write_cr(value, at),
            _ => Err(Unmodelled("FLASH: option bytes")),
        }
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        self.programming.advance(to);
        if !self.before.1.is_empty() && !self.programming.is_busy(to) {
            self.before = (0, Vec::new());
        }
        refuse_if(
            self.accelerator.delivered_stale,
            "FLASH: code that was cached before it changed",
        )?;
        Ok(())
    }

    fn next_event(&self) -> Cycle {
        self.programming.end()
    }
}
