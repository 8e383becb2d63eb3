//! The clock tree: from the crystal to the core, the timers and USB.

/// Crystal and PLL (RM0090 section 7.3.2). The VCO runs at crystal / `divider` × `multiplier`; the
/// core and USB derive their clocks from it.
#[derive(Clone, Copy, Debug)]
pub struct Clocks {
    /// Frequency of the crystal, Hz; whole MHz.
    pub crystal_hz: u32,
    /// PLLM, which divides the crystal to the 1 to 2 MHz of the VCO's input.
    pub divider: u32,
    /// PLLN, from the VCO's input to the VCO.
    pub multiplier: u32,
    /// PLLP, which divides the VCO for the core: 2, 4, 6 or 8.
    pub core_divider: u32,
    /// PLLQ, which divides the VCO to the 48 MHz of USB.
    pub usb_divider: u32,
}

impl Clocks {
    /// Divider of APB1 on every board. Its timers, such as TIM2, run at half of the core's clock,
    /// and SPI3 at an eighth.
    pub const APB1_DIVIDER: u32 = 4;
    /// Divider of APB2 on every board. Its timers, such as TIM1, run at the core's clock, and the
    /// ADC at an eighth.
    pub const APB2_DIVIDER: u32 = 2;

    /// Returns the crystal's frequency in MHz.
    #[must_use]
    pub const fn crystal_mhz(&self) -> u32 {
        self.crystal_hz / 1_000_000
    }

    /// Returns the frequency at the VCO's input in Hz, after PLLM.
    #[must_use]
    pub const fn vco_input_hz(&self) -> u32 {
        self.crystal_hz / self.divider
    }

    /// Returns the frequency of the VCO in Hz, after PLLN.
    #[must_use]
    pub const fn vco_hz(&self) -> u32 {
        self.vco_input_hz() * self.multiplier
    }

    /// Returns the core's clock, HCLK, in Hz.
    #[must_use]
    pub const fn core_hz(&self) -> u32 {
        self.vco_hz() / self.core_divider
    }

    /// Returns the USB clock in Hz; USB needs 48 MHz.
    #[must_use]
    pub const fn usb_hz(&self) -> u32 {
        self.vco_hz() / self.usb_divider
    }

    /// Returns the core cycles, and counts of TIM1, per microsecond.
    #[must_use]
    pub const fn cycles_per_us(&self) -> u32 {
        self.core_hz() / 1_000_000
    }

    /// Returns the flash's wait states at 2.7 V or more: one for each 30 MHz (RM0090 table 10).
    #[must_use]
    pub const fn wait_states(&self) -> u32 {
        (self.core_hz() - 1) / 30_000_000
    }

    /// Returns the value of RCC_PLLCFGR, for the bits [`Self::PLLCFGR_BITS`] (RM0090 section
    /// 7.3.2).
    #[must_use]
    pub const fn pllcfgr(&self) -> u32 {
        const FROM_CRYSTAL: u32 = 1 << 22;
        let core = (self.core_divider / 2 - 1) << 16; // core_divider is 2, 4, 6 or 8
        self.usb_divider << 24 | FROM_CRYSTAL | core | self.multiplier << 6 | self.divider
    }

    /// Bits of RCC_PLLCFGR that are not reserved.
    pub const PLLCFGR_BITS: u32 = 0x0F43_7FFF;
}
