//! Clock tree: computes the bus clocks from the oscillators (RM0090 figure 21).

use crate::chip::cpu::bus::{Modelled, refuse_if};
use crate::chip::soc::clock::Clocks;

/// HSI frequency, Hz (DS8626, HSI oscillator characteristics).
pub const HSI_HZ: u32 = 16_000_000;

/// Source of the system clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Internal oscillator, 16 MHz.
    Hsi,
    /// External crystal.
    Hse,
    /// PLL output P.
    Pll,
}

impl Source {
    /// Decodes the field SW or SWS; `None` for the forbidden value.
    pub const fn from_field(bits: u32) -> Option<Self> {
        match bits & 3 {
            0 => Some(Self::Hsi),
            1 => Some(Self::Hse),
            2 => Some(Self::Pll),
            _ => None,
        }
    }

    /// Returns the value of CFGR.SWS that shows this source.
    pub const fn field(self) -> u32 {
        self as u32
    }
}

/// Allowed ranges and maxima of the clocks, Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Minimum and maximum of the PLL input.
    input_hz: [u32; 2],
    /// Minimum and maximum of the VCO.
    vco_hz: [u32; 2],
    hclk_hz: u32,
    pclk1_hz: u32,
    pclk2_hz: u32,
}

impl Limits {
    /// Limits of the data sheet (RM0090 section 7.3.2; DS8626, main PLL characteristics and general
    /// operating conditions).
    pub const DATA_SHEET: Self = Self {
        input_hz: [1_000_000, 2_000_000],
        vco_hz: [100_000_000, 432_000_000],
        hclk_hz: 168_000_000,
        pclk1_hz: 42_000_000,
        pclk2_hz: 84_000_000,
    };
    /// Limits for clocks that only a fault may select. The core is known to run at Betaflight's
    /// fastest setting of this chip, N 480 / 2 from 1 MHz, with the prescalers and wait states of
    /// 168 MHz. Assumed: up to there the PLL multiplies according to its fields, at any low input
    /// and VCO frequency, and everything that it clocks works; APB1, of which nothing is known
    /// beyond 60 MHz, works at up to the 168 MHz for which the core is made. APB2 clocks the ADC.
    pub const KNOWN: Self = Self {
        input_hz: [0, u32::MAX],
        vco_hz: [0, 480_000_000],
        hclk_hz: 240_000_000,
        pclk1_hz: 168_000_000,
        pclk2_hz: 120_000_000,
    };

    /// Checks that no bus clock is above its maximum.
    ///
    /// # Errors
    /// Fails if the clock of a bus is too high.
    pub fn check(&self, clocks: &Clocks) -> Modelled {
        refuse_if(clocks.hclk_hz > self.hclk_hz, "RCC: HCLK above its limit")?;
        refuse_if(clocks.pclk1_hz > self.pclk1_hz, "RCC: APB1 above its limit")?;
        refuse_if(clocks.pclk2_hz > self.pclk2_hz, "RCC: APB2 above its limit")
    }
}

/// PLL input, and outputs P and Q, as PLLCFGR selects them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pll {
    /// PLLSRC: whether the input is HSE, otherwise HSI.
    pub from_hse: bool,
    /// Frequency of output P, Hz.
    pub p_hz: u32,
    /// Frequency of output Q, Hz.
    pub q_hz: u32,
}

impl Pll {
    /// Decodes PLLCFGR (RM0090 section 7.3.2).
    ///
    /// # Errors
    /// Fails for dividers that the manual forbids, or frequencies beyond `limits`.
    pub fn decode(pllcfgr: u32, hse_hz: u32, limits: &Limits) -> Modelled<Self> {
        let field = |shift: u32, width: u32| pllcfgr >> shift & ((1 << width) - 1);
        let (m, n, q) = (field(0, 6), field(6, 9), field(24, 4));
        let p = 2 * (field(16, 2) + 1);
        refuse_if(
            m < 2 || !(2..=432).contains(&n) || q < 2,
            "RCC: PLL divider out of range",
        )?;
        let from_hse = pllcfgr & 1 << 22 != 0;
        let input = if from_hse { hse_hz } else { HSI_HZ };
        // Compared without division.
        let [least, most] = limits.input_hz.map(|hz| u64::from(hz) * u64::from(m));
        refuse_if(
            !(least..=most).contains(&u64::from(input)),
            "RCC: PLL input beyond its limits",
        )?;
        let vco = u64::from(input) * u64::from(n) / u64::from(m); // < 2^33: 16 MHz × 432
        let [least, most] = limits.vco_hz.map(u64::from);
        refuse_if(
            !(least..=most).contains(&vco),
            "RCC: PLL VCO beyond its limits",
        )?;
        Ok(Self {
            from_hse,
            p_hz: vco as u32 / p,
            q_hz: vco as u32 / q,
        })
    }
}

impl Pll {
    /// Returns the same PLL with an actual output P of `hz`, and Q in proportion.
    pub const fn running_at(self, hz: u32) -> Self {
        let q_hz = self.q_hz as u64 * hz as u64 / self.p_hz as u64;
        Self {
            p_hz: hz,
            q_hz: q_hz as u32,
            ..self
        }
    }
}

/// Returns the bus clocks for a system clock of `sysclk_hz` and the prescalers in `cfgr`.
pub const fn buses(sysclk_hz: u32, usb_hz: u32, cfgr: u32) -> Clocks {
    let hclk_hz = sysclk_hz / ahb_divider(cfgr >> 4 & 0xF);
    let (divider1, divider2) = (apb_divider(cfgr >> 10 & 7), apb_divider(cfgr >> 13 & 7));
    Clocks {
        hclk_hz,
        pclk1_hz: hclk_hz / divider1,
        pclk2_hz: hclk_hz / divider2,
        timer1_hz: hclk_hz / if divider1 == 1 { 1 } else { divider1 / 2 },
        timer2_hz: hclk_hz / if divider2 == 1 { 1 } else { divider2 / 2 },
        usb_hz,
    }
}

/// Decodes HPRE: 0xxx undivided, 1000–1111 are 2, 4, 8, 16, 64, 128, 256, 512.
const fn ahb_divider(hpre: u32) -> u32 {
    match hpre {
        0..=7 => 1,
        8..=11 => 2 << (hpre - 8),
        _ => 64 << (hpre - 12),
    }
}

/// Decodes PPRE: 0xx undivided, 100–111 are 2, 4, 8, 16.
const fn apb_divider(ppre: u32) -> u32 {
    if ppre < 4 { 1 } else { 2 << (ppre - 4) }
}
