//! The clock tree: from the crystal to the core, the timers and USB.

/// Crystal and PLL (RM0090 section 7.3.2): crystal / `divider` × `multiplier` is the VCO,
/// from which the core and USB get their clocks.
#[derive(Clone, Copy, Debug)]
pub struct Clocks {
    /// Frequency of the crystal, Hz: whole MHz.
    pub crystal_hz: u32,
    /// PLLM, which divides the crystal to the 1 to 2 MHz of the VCO's input.
    pub divider: u32,
    /// PLLN.
    pub multiplier: u32,
    /// PLLP: 2, 4, 6 or 8. Divides the VCO for the core.
    pub core_divider: u32,
    /// PLLQ. Divides the VCO for USB, which needs 48 MHz.
    pub usb_divider: u32,
}

impl Clocks {
    /// Divider of APB1, on every board: timers on it, TIM2 among them, run at half of the
    /// core's clock, and SPI3 at an eighth.
    pub const APB1_DIVIDER: u32 = 4;
    /// Divider of APB2, on every board: timers on it, TIM1 among them, run at the core's
    /// clock, and the ADC at an eighth.
    pub const APB2_DIVIDER: u32 = 2;

    /// The crystal, MHz.
    #[must_use]
    pub const fn crystal_mhz(&self) -> u32 {
        self.crystal_hz / 1_000_000
    }

    /// Input of the VCO, Hz.
    #[must_use]
    pub const fn vco_input_hz(&self) -> u32 {
        self.crystal_hz / self.divider
    }

    /// The VCO, Hz.
    #[must_use]
    pub const fn vco_hz(&self) -> u32 {
        self.vco_input_hz() * self.multiplier
    }

    /// The core's clock, HCLK, Hz.
    #[must_use]
    pub const fn core_hz(&self) -> u32 {
        self.vco_hz() / self.core_divider
    }

    /// The clock of USB, Hz.
    #[must_use]
    pub const fn usb_hz(&self) -> u32 {
        self.vco_hz() / self.usb_divider
    }

    /// Core cycles, and counts of TIM1, in a microsecond.
    #[must_use]
    pub const fn cycles_per_us(&self) -> u32 {
        self.core_hz() / 1_000_000
    }

    /// Wait states of the flash at 2.7 V and more: one for each 30 MHz (RM0090 table 10).
    #[must_use]
    pub const fn wait_states(&self) -> u32 {
        (self.core_hz() - 1) / 30_000_000
    }

    /// What RCC_PLLCFGR must read, of the bits [`Self::PLLCFGR_BITS`] (RM0090 section 7.3.2).
    #[must_use]
    pub const fn pllcfgr(&self) -> u32 {
        const FROM_CRYSTAL: u32 = 1 << 22;
        let core = (self.core_divider / 2 - 1) << 16; // 2, 4, 6, 8
        self.usb_divider << 24 | FROM_CRYSTAL | core | self.multiplier << 6 | self.divider
    }

    /// The bits of RCC_PLLCFGR that are not reserved.
    pub const PLLCFGR_BITS: u32 = 0x0F43_7FFF;
}
