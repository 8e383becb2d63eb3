//! The blocks that RCC clocks and resets, by register and bit.

/// Number of AHB and APB buses: AHB1, AHB2, AHB3, APB1, APB2.
pub const BUSES: usize = 5;

const AHB1: usize = 0;
const AHB2: usize = 1;
/// Bus index of APB1 in registers that come by bus.
pub const APB1: usize = 3;
/// Bus index of APB2.
pub const APB2: usize = 4;

/// A block with a clock enable and a reset bit. Only those that a model exists
/// for (RM0090 sections 7.3.5–7.3.14).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // the names are the manual's
pub enum Block {
    /// 0 is port A, 8 port I.
    Gpio(u8),
    Crc,
    BackupSram,
    /// 1, 2.
    Dma(u8),
    OtgFs,
    /// 1–5, 11.
    Timer(u8),
    /// 1–3.
    Spi(u8),
    Usart2,
    Pwr,
    Adc,
    Syscfg,
}

impl Block {
    /// All of them, by bus and bit.
    #[rustfmt::skip]
    pub const ALL: [Self; 27] = [
        Self::Gpio(0), Self::Gpio(1), Self::Gpio(2), Self::Gpio(3), Self::Gpio(4),
        Self::Gpio(5), Self::Gpio(6), Self::Gpio(7), Self::Gpio(8), Self::Crc, Self::BackupSram, Self::Dma(1), Self::Dma(2),
        Self::OtgFs,
        Self::Timer(2), Self::Timer(3), Self::Timer(4), Self::Timer(5),
        Self::Spi(2), Self::Spi(3), Self::Usart2, Self::Pwr,
        Self::Timer(1), Self::Adc, Self::Spi(1), Self::Syscfg, Self::Timer(11),
    ];

    /// Bus index (AHB1, AHB2, AHB3, APB1, APB2) and bit, the same in the reset
    /// and the enable register.
    pub const fn place(self) -> (usize, u32) {
        match self {
            Self::Gpio(port) => (AHB1, port as u32),
            Self::Crc => (AHB1, 12),
            Self::BackupSram => (AHB1, 18),
            Self::Dma(n) => (AHB1, 20 + n as u32),
            Self::OtgFs => (AHB2, 7),
            Self::Timer(1) => (APB2, 0),
            Self::Timer(11) => (APB2, 18),
            Self::Timer(n) => (APB1, n as u32 - 2),
            Self::Spi(1) => (APB2, 12),
            Self::Spi(n) => (APB1, 12 + n as u32),
            Self::Usart2 => (APB1, 17),
            Self::Pwr => (APB1, 28),
            Self::Adc => (APB2, 8),
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
