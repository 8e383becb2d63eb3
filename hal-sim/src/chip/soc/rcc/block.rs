//! Blocks that RCC clocks and resets, with their registers and bits.

/// Number of AHB and APB buses: AHB1, AHB2, AHB3, APB1, APB2.
pub const BUSES: usize = 5;

const AHB1: usize = 0;
const AHB2: usize = 1;
/// Index of APB1 among the buses.
pub const APB1: usize = 3;
/// Index of APB2 among the buses.
pub const APB2: usize = 4;

/// A modelled block with a clock enable and a reset bit (RM0090 sections 7.3.5–7.3.14).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)] // the names are those of RM0090
pub enum Block {
    /// A port: 0 is port A, 8 port I.
    Gpio(u8),
    Crc,
    BackupSram,
    /// DMA controller 1 or 2.
    Dma(u8),
    OtgFs,
    /// Timer with its number: 1–5 or 11.
    Timer(u8),
    /// SPI interface with its number: 1–3.
    Spi(u8),
    Usart2,
    Pwr,
    Adc,
    Syscfg,
}

impl Block {
    /// All blocks, in the order of bus and bit.
    #[rustfmt::skip]
    pub const ALL: [Self; 27] = [
        Self::Gpio(0), Self::Gpio(1), Self::Gpio(2), Self::Gpio(3), Self::Gpio(4),
        Self::Gpio(5), Self::Gpio(6), Self::Gpio(7), Self::Gpio(8), Self::Crc, Self::BackupSram, Self::Dma(1), Self::Dma(2),
        Self::OtgFs,
        Self::Timer(2), Self::Timer(3), Self::Timer(4), Self::Timer(5),
        Self::Spi(2), Self::Spi(3), Self::Usart2, Self::Pwr,
        Self::Timer(1), Self::Adc, Self::Spi(1), Self::Syscfg, Self::Timer(11),
    ];

    /// Returns the bus index (AHB1, AHB2, AHB3, APB1, APB2) and the bit, which is the same in the
    /// reset and the enable register.
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

    /// Returns all blocks whose bits are set in `masks`, one mask per bus.
    pub fn in_masks(masks: [u32; BUSES]) -> impl Iterator<Item = Self> {
        Self::ALL.into_iter().filter(move |block| {
            let (bus, bit) = block.place();
            masks[bus] & 1 << bit != 0
        })
    }
}
