//! The blocks that RCC clocks and resets, by register and bit.

/// Number of AHB and APB buses: AHB1, AHB2, AHB3, APB1, APB2.
pub const BUSES: usize = 5;

/// Bus index of APB1 in registers that come by bus.
pub const APB1: usize = 3;
/// Bus index of APB2.
pub const APB2: usize = 4;

/// A block with a clock enable and a reset bit. Only those that a model exists
/// for (RM0090 sections 7.3.5–7.3.14).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // the names are the manual's
pub enum Block {
    GpioA,
    GpioB,
    GpioC,
    GpioD,
    GpioE,
    GpioF,
    GpioG,
    GpioH,
    GpioI,
    Dma1,
    Dma2,
    OtgFs,
    Tim2,
    Tim3,
    Tim4,
    Tim5,
    Spi2,
    Spi3,
    Usart2,
    Pwr,
    Tim1,
    Adc,
    Spi1,
    Syscfg,
}

impl Block {
    /// All of them.
    pub const ALL: [Self; 24] = [
        Self::GpioA,
        Self::GpioB,
        Self::GpioC,
        Self::GpioD,
        Self::GpioE,
        Self::GpioF,
        Self::GpioG,
        Self::GpioH,
        Self::GpioI,
        Self::Dma1,
        Self::Dma2,
        Self::OtgFs,
        Self::Tim2,
        Self::Tim3,
        Self::Tim4,
        Self::Tim5,
        Self::Spi2,
        Self::Spi3,
        Self::Usart2,
        Self::Pwr,
        Self::Tim1,
        Self::Adc,
        Self::Spi1,
        Self::Syscfg,
    ];

    /// Bus index (AHB1, AHB2, AHB3, APB1, APB2) and bit, the same in the reset
    /// and the enable register.
    #[must_use]
    pub const fn place(self) -> (usize, u32) {
        match self {
            Self::GpioA => (0, 0),
            Self::GpioB => (0, 1),
            Self::GpioC => (0, 2),
            Self::GpioD => (0, 3),
            Self::GpioE => (0, 4),
            Self::GpioF => (0, 5),
            Self::GpioG => (0, 6),
            Self::GpioH => (0, 7),
            Self::GpioI => (0, 8),
            Self::Dma1 => (0, 21),
            Self::Dma2 => (0, 22),
            Self::OtgFs => (1, 7),
            Self::Tim2 => (APB1, 0),
            Self::Tim3 => (APB1, 1),
            Self::Tim4 => (APB1, 2),
            Self::Tim5 => (APB1, 3),
            Self::Spi2 => (APB1, 14),
            Self::Spi3 => (APB1, 15),
            Self::Usart2 => (APB1, 17),
            Self::Pwr => (APB1, 28),
            Self::Tim1 => (APB2, 0),
            Self::Adc => (APB2, 8),
            Self::Spi1 => (APB2, 12),
            Self::Syscfg => (APB2, 14),
        }
    }

    /// All blocks whose bits are set in `masks`, one mask per bus.
    pub fn in_masks(masks: [u32; BUSES]) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |block| {
            let (bus, bit) = block.place();
            masks[bus] & 1 << bit != 0
        })
    }
}
