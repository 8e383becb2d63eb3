//! Models the injected group of ADC1 (RM0090 chapter 13). Regular conversions, ADC2 and 3, DMA,
//! watchdog and temperature sensor are not modelled.
//!
//! In: the trigger and the codes. Out: the time and channel of each sample, the results, an
//! interrupt line. The caller models the analogue inputs: it reads `next_sample`, and passes the
//! code of that input at that cycle to `deliver_sample`.
//!
//! Assumed: sampling begins three ADC clocks after the trigger, the data sheet's maximum latency,
//! and the ADC clock is in phase with the trigger.

mod registers;
#[cfg(test)]
mod tests;

use super::clock::cycles_in;
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, refuse_if};

/// Injected trigger latency, in ADC clocks (DS8626, ADC characteristics).
const LATENCY: u64 = 3;
/// Power-up time, at most 3 µs (the same table).
const POWER_UP_NS: u64 = 3_000;
/// Value of JEXTSEL that selects TIM2_TRGO as the trigger.
const TIM2_TRGO: u32 = 0b0011;

mod sr {
    pub const JEOC: u32 = 1 << 2;
    pub const JSTRT: u32 = 1 << 3;
}

mod cr1 {
    pub const JEOCIE: u32 = 1 << 7;
    pub const SCAN: u32 = 1 << 8;
    pub const RES: u32 = 3 << 24;
    pub const KNOWN: u32 = JEOCIE | SCAN | RES;
}

mod cr2 {
    pub const ADON: u32 = 1;
    pub const ALIGN: u32 = 1 << 11;
    pub const JEXTSEL: u32 = 0xF << 16;
    pub const JEXTEN: u32 = 3 << 20;
    pub const KNOWN: u32 = ADON | ALIGN | JEXTSEL | JEXTEN;
}

/// Input channel to be sampled, and when.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    /// Cycle at which the sampling time ends and the level of the input is captured for conversion.
    pub at: Cycle,
    /// Number of the input channel, 0–18.
    pub channel: u8,
}

/// Conversion in progress.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Conversion {
    /// Place of the channel in the injected group, 0–3.
    rank: u8,
    sample: Sample,
    end: Cycle,
    /// Code of the input, once it was sampled.
    code: Option<u16>,
}

/// ADC1 with the common registers.
#[derive(Clone, PartialEq, Debug)]
pub struct Adc {
    hz: u32,
    /// Core cycles per APB2 cycle.
    bus_divider: u32,
    sr: u32,
    cr1: u32,
    cr2: u32,
    sampling: [u32; 2],
    offsets: [u32; 4],
    jsqr: u32,
    ccr: u32,
    results: [u32; 4],
    /// Cycle from which a trigger is allowed: the end of the power-up time.
    ready: Cycle,
    conversion: Option<Conversion>,
    /// Injected fault: no trigger begins a conversion.
    pub deaf: bool,
    /// Injected fault: number of coming triggers that are ignored.
    pub unheard: u8,
}

impl Default for Adc {
    /// Returns the reset state, with core and bus at 16 MHz.
    fn default() -> Self {
        Self {
            hz: super::rcc::HSI_HZ,
            bus_divider: 1,
            sr: 0,
            cr1: 0,
            cr2: 0,
            sampling: [0; 2],
            offsets: [0; 4],
            jsqr: 0,
            ccr: 0,
            results: [0; 4],
            ready: 0,
            conversion: None,
            deaf: false,
            unheard: 0,
        }
    }
}

impl Adc {
    /// Resets the registers; clocks and injected faults stay.
    pub fn reset(&mut self) {
        *self = Self {
            hz: self.hz,
            bus_divider: self.bus_divider,
            deaf: self.deaf,
            unheard: self.unheard,
            ..Self::default()
        };
    }

    /// Sets the core clock to `hz` and APB2 to `hz / bus_divider`, from the next conversion on.
    pub fn set_clock(&mut self, hz: u32, bus_divider: u32) {
        self.hz = hz;
        self.bus_divider = bus_divider;
    }

    /// Processes a rising edge of TIM2's trigger output at `at`.
    ///
    /// # Errors
    /// Fails if the group is still converting, the power-up time has not passed, or the ADC's clock
    /// is above 36 MHz.
    pub fn trigger(&mut self, at: Cycle) -> Modelled {
        let enabled = cr2::ADON | 1 << 20; // JEXTEN: rising edge
        if self.cr2 & (cr2::ADON | cr2::JEXTEN) != enabled
            || (self.cr2 & cr2::JEXTSEL) >> 16 != TIM2_TRGO
            || self.deaf
        {
            return Ok(());
        }
        if self.unheard > 0 {
            self.unheard -= 1;
            return Ok(());
        }
        refuse_if(
            self.conversion.is_some(),
            "ADC: triggered during a conversion",
        )?;
        refuse_if(at < self.ready, "ADC: triggered within its power-up time")?;
        refuse_if(
            self.clock() * 36_000_000 < u64::from(self.hz),
            "ADC: clock above 36 MHz",
        )?;
        self.sr |= sr::JSTRT;
        self.begin(0, at.saturating_add(LATENCY * self.clock()));
        Ok(())
    }

    /// Returns the channel and cycle of the next sample; `None` if no conversion is sampling. The
    /// caller must pass the code of that channel to `deliver_sample` before it advances beyond that
    /// cycle.
    pub fn next_sample(&self) -> Option<Sample> {
        let conversion = self.conversion?;
        conversion.code.is_none().then_some(conversion.sample)
    }

    /// Passes in the code, 0–4095, that the input has at the cycle of the sample that `next_sample`
    /// returned.
    pub fn deliver_sample(&mut self, code: u16) {
        if let Some(conversion) = &mut self.conversion {
            conversion.code.get_or_insert(code.min(0xFFF));
        }
    }

    /// Returns the level of the ADC interrupt, line 18.
    pub const fn interrupt(&self) -> bool {
        self.cr1 & cr1::JEOCIE != 0 && self.sr & sr::JEOC != 0
    }

    /// Returns the number of core cycles per ADC clock.
    fn clock(&self) -> u64 {
        let prescaler = 2 * ((self.ccr >> 16 & 3) + 1);
        u64::from(self.bus_divider) * u64::from(prescaler)
    }

    /// Returns the number of conversions in the group, 1–4.
    const fn length(&self) -> u8 {
        (self.jsqr >> 20 & 3) as u8 + 1
    }

    /// Returns the channel at `rank`. The sequence begins at JSQ(4 − JL) (section 13.13.12).
    const fn channel(&self, rank: u8) -> u8 {
        (self.jsqr >> (5 * (4 - self.length() + rank)) & 0x1F) as u8
    }

    /// Returns the sampling time of `channel`, ADC clocks (section 13.13.4).
    const fn sampling_time(&self, channel: u8) -> u64 {
        let (register, place) = if channel < 10 {
            (1, channel)
        } else {
            (0, channel - 10)
        };
        match self.sampling[register] >> (3 * place) & 7 {
            0 => 3,
            1 => 15,
            2 => 28,
            3 => 56,
            4 => 84,
            5 => 112,
            6 => 144,
            _ => 480,
        }
    }

    /// Returns the number of bits of a result: 12, 10, 8 or 6; a conversion takes as many clocks.
    const fn bits(&self) -> u32 {
        12 - 2 * ((self.cr1 & cr1::RES) >> 24)
    }

    fn begin(&mut self, rank: u8, at: Cycle) {
        let channel = self.channel(rank);
        let held = at.saturating_add(self.sampling_time(channel) * self.clock());
        self.conversion = Some(Conversion {
            rank,
            sample: Sample { at: held, channel },
            end: held.saturating_add(u64::from(self.bits()) * self.clock()),
            code: None,
        });
    }

    fn finish(&mut self, conversion: Conversion, code: u16) {
        let rank = usize::from(conversion.rank);
        let reduced = u32::from(code) >> (12 - self.bits());
        let result = reduced.wrapping_sub(self.offsets[rank]);
        // Injected results are signed; left alignment has the sign on top and, at 6 bits, byte
        // alignment (figures 49, 50).
        let result = if self.cr2 & cr2::ALIGN == 0 {
            result
        } else if self.bits() == 6 {
            result << 1
        } else {
            result << (15 - self.bits())
        };
        self.results[rank] = result & 0xFFFF;
        // Without SCAN only the first channel of the group is converted (section 13.3.8).
        let length = match self.cr1 & cr1::SCAN {
            0 => 1,
            _ => self.length(),
        };
        if conversion.rank + 1 < length {
            self.begin(conversion.rank + 1, conversion.end);
        } else {
            self.conversion = None;
            self.sr |= sr::JEOC;
        }
    }

    fn switch_on(&mut self, at: Cycle) {
        self.ready = at.saturating_add(cycles_in(POWER_UP_NS, self.hz));
    }
}
