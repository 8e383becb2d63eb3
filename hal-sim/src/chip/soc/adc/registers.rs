//! Registers of ADC1 and the common registers (RM0090 section 13.13), by offset from ADC1.

use super::{Adc, cr1, cr2, sr};
use crate::chip::soc::peripheral::{Cycle, Modelled, Peripheral, Unmodelled, refuse_if};

const CSR: u32 = 0x300;
const CCR: u32 = 0x304;
/// Modelled bits of ADC_CCR: the prescaler ADCPRE.
const CCR_KNOWN: u32 = 3 << 16;

impl Adc {
    fn write_cr2(&mut self, value: u32, at: Cycle) -> Modelled {
        refuse_if(
            value & !cr2::KNOWN != 0,
            "ADC_CR2: a regular group, or one started by software",
        )?;
        if value & !self.cr2 & cr2::ADON != 0 {
            self.switch_on(at);
        }
        if value & cr2::ADON == 0 {
            self.conversion = None;
        }
        self.cr2 = value;
        Ok(())
    }
}

impl Peripheral for Adc {
    fn read(&mut self, offset: u32, at: Cycle) -> Modelled<u32> {
        self.advance(at)?;
        let word = match offset {
            0x00 | CSR => self.sr,
            0x04 => self.cr1,
            0x08 => self.cr2,
            register @ (0x0C | 0x10) => self.sampling[(register - 0x0C) as usize / 4],
            register @ 0x14..=0x20 => self.offsets[(register - 0x14) as usize / 4],
            0x38 => self.jsqr,
            register @ 0x3C..=0x48 => self.results[(register - 0x3C) as usize / 4],
            CCR => self.ccr,
            _ => return Err(Unmodelled("ADC register")),
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        self.advance(at)?;
        let busy = self.conversion.is_some();
        let resolution = offset == 0x04 && (value ^ self.cr1) & cr1::RES == 0;
        if busy && !resolution && !matches!(offset, 0 | 0x08 | 0x38) {
            return Err(Unmodelled("ADC: a setting written during a conversion"));
        }
        match offset {
            // rc_w0: writing 0 clears a bit, 1 leaves it unchanged.
            0x00 => self.sr &= value | !(sr::JEOC | sr::JSTRT),
            0x04 if value & !cr1::KNOWN != 0 => {
                return Err(Unmodelled("ADC_CR1: a bit other than SCAN, RES and JEOCIE"));
            }
            0x04 => self.cr1 = value,
            0x08 => self.write_cr2(value, at)?,
            0x0C | 0x10 => self.sampling[(offset - 0x0C) as usize / 4] = value & 0x3FFF_FFFF,
            0x14 | 0x18 | 0x1C | 0x20 => {
                self.offsets[(offset - 0x14) as usize / 4] = value & 0xFFF;
            }
            0x38 => {
                self.jsqr = value & 0x3F_FFFF;
                // A new group restarts the conversion with its first channel (section 13.3.3).
                if busy {
                    self.begin(0, at);
                }
            }
            CCR if value & !CCR_KNOWN != 0 => {
                return Err(Unmodelled("ADC_CCR: a bit other than ADCPRE"));
            }
            CCR => self.ccr = value,
            _ => return Err(Unmodelled("ADC register")),
        }
        Ok(())
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        while let Some(conversion) = self.conversion.filter(|c| c.end <= to) {
            let code = conversion.code.ok_or(Unmodelled(
                "ADC: conversion of an input without a simulated signal",
            ))?;
            self.finish(conversion, code);
        }
        Ok(())
    }

    /// Returns the cycle of the next sample or, once the input was sampled, of the end of the
    /// conversion.
    fn next_event(&self) -> Cycle {
        self.conversion.map_or(Cycle::MAX, |c| {
            if c.code.is_none() { c.sample.at } else { c.end }
        })
    }
}
