//! Memory map (RM0090 table 1): finds the block that answers at an address.

use super::matrix::Bridge;
use super::playback;
use super::rcc::{APB1, APB2, Block};

/// A block of registers or memory that answers on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// TIM1–5, DMA1/2, GPIO.
    Playback(playback::Block),
    /// RTC, of which only the backup registers are modelled.
    Backup,
    /// Backup SRAM, 4 KiB.
    BackupSram,
    /// Independent watchdog.
    Iwdg,
    /// SPI3, which controls the DACs.
    Spi3,
    /// USART2, an asynchronous serial port.
    Usart2,
    /// Power control.
    Pwr,
    /// ADC1 and the common registers.
    Adc,
    /// System configuration.
    Syscfg,
    /// External interrupts.
    Exti,
    /// Reset and clock control.
    Rcc,
    /// CRC calculation unit.
    Crc,
    /// Flash interface.
    Flash,
    /// General-purpose timer TIM11.
    Tim11,
    /// USB OTG_FS.
    Otg,
    /// DBGMCU, the debug support of the chip outside the core.
    Dbgmcu,
}

/// Returns the block at `address`, from 0x4000_0000 on, and the offset within it.
pub fn find_unit(address: u32) -> Option<(Unit, u32)> {
    if address >> 18 == 0x5000_0000 >> 18 {
        return Some((Unit::Otg, address & 0x3_FFFF));
    }
    if (0x4002_4000..0x4002_5000).contains(&address) {
        return Some((Unit::BackupSram, address & 0xFFF));
    }
    let base = address & !0x3FF;
    let unit = match base {
        0x4000_0000 => Unit::Playback(playback::Block::Timer(2)),
        0x4000_0400 => Unit::Playback(playback::Block::Timer(3)),
        0x4000_0800 => Unit::Playback(playback::Block::Timer(4)),
        0x4000_0C00 => Unit::Playback(playback::Block::Timer(5)),
        0x4000_2800 => Unit::Backup,
        0x4000_3000 => Unit::Iwdg,
        0x4000_3C00 => Unit::Spi3,
        0x4000_4400 => Unit::Usart2,
        0x4000_7000 => Unit::Pwr,
        0x4001_0000 => Unit::Playback(playback::Block::Timer(1)),
        0x4001_2000 => Unit::Adc,
        0x4001_3800 => Unit::Syscfg,
        0x4001_3C00 => Unit::Exti,
        0x4001_4800 => Unit::Tim11,
        0x4002_0000..=0x4002_2000 => {
            let port = (base - 0x4002_0000) >> 10;
            Unit::Playback(playback::Block::Gpio(port as usize))
        }
        0x4002_3000 => Unit::Crc,
        0x4002_3800 => Unit::Rcc,
        0x4002_3C00 => Unit::Flash,
        0x4002_6000 => Unit::Playback(playback::Block::Dma1),
        0x4002_6400 => Unit::Playback(playback::Block::Dma2),
        0xE004_2000 => Unit::Dbgmcu,
        _ => return None,
    };
    Some((unit, address & 0x3FF))
}

/// Returns the clock enable (bus and bit in RCC's enable registers) of a block that is not
/// modelled; `None` where RM0090 table 1 has no block. Without its clock a block reads 0 and
/// ignores writes.
pub const fn unmodelled_clock(address: u32) -> Option<(usize, u32)> {
    const AHB1: usize = 0;
    const AHB2: usize = 1;
    const AHB3: usize = 2;
    Some(match address {
        0x4000_1000..=0x4000_23FF => (APB1, 4 + ((address - 0x4000_1000) >> 10)), // TIM6, 7, 12-14
        0x4000_2C00..=0x4000_2FFF => (APB1, 11),                                  // WWDG
        0x4000_3400..=0x4000_3BFF => (APB1, 14), // SPI2 and its I2S
        0x4000_4000..=0x4000_43FF => (APB1, 15), // I2S3
        0x4000_4800..=0x4000_53FF => (APB1, 18 + ((address - 0x4000_4800) >> 10)), // USART3-5
        0x4000_5400..=0x4000_5FFF => (APB1, 21 + ((address - 0x4000_5400) >> 10)), // I2C1-3
        0x4000_6400..=0x4000_6BFF => (APB1, 25 + ((address - 0x4000_6400) >> 10)), // CAN1, 2
        0x4000_7400..=0x4000_77FF => (APB1, 29), // DAC
        0x4001_0400..=0x4001_07FF => (APB2, 1),  // TIM8
        0x4001_1000..=0x4001_17FF => (APB2, 4 + ((address - 0x4001_1000) >> 10)), // USART1, 6
        0x4001_2C00..=0x4001_33FF => (APB2, 11 + ((address - 0x4001_2C00) >> 10)), // SDIO, SPI1
        0x4001_4000..=0x4001_47FF => (APB2, 16 + ((address - 0x4001_4000) >> 10)), // TIM9, 10
        0x4002_8000..=0x4002_93FF => (AHB1, 25), // Ethernet
        0x4004_0000..=0x4007_FFFF => (AHB1, 29), // OTG_HS
        0x5005_0000..=0x5005_03FF => (AHB2, 0),  // DCMI
        0x5006_0000..=0x5006_07FF => (AHB2, 4 + ((address - 0x5006_0000) >> 10)), // CRYP, HASH
        0x5006_0800..=0x5006_0BFF => (AHB2, 6),  // RNG
        0x6000_0000..=0xA000_0FFF => (AHB3, 0),  // FSMC
        _ => return None,
    })
}

impl Unit {
    /// Returns the bridge between the block and AHB1: [`Bridge::None`] if the block is on AHB1
    /// itself, `None` if it is not connected to AHB1.
    pub const fn bridge(self) -> Option<Bridge> {
        Some(match self {
            Self::Playback(_) | Self::Rcc | Self::Flash | Self::Crc | Self::BackupSram => {
                Bridge::None
            }
            Self::Backup | Self::Iwdg | Self::Spi3 | Self::Usart2 | Self::Pwr => Bridge::Apb1,
            Self::Adc | Self::Syscfg | Self::Exti | Self::Tim11 => Bridge::Apb2,
            Self::Otg | Self::Dbgmcu => return None,
        })
    }

    /// Returns the clock that the block needs to answer; `None` if its clock is always on.
    pub const fn clock(self) -> Option<Block> {
        Some(match self {
            Self::Playback(playback::Block::Timer(n)) => Block::Timer(n),
            Self::Playback(playback::Block::Dma1) => Block::Dma(1),
            Self::Playback(playback::Block::Dma2) => Block::Dma(2),
            Self::Playback(playback::Block::Gpio(port)) => Block::Gpio(port as u8), // 0–8
            Self::Spi3 => Block::Spi(3),
            Self::Usart2 => Block::Usart2,
            Self::Pwr => Block::Pwr,
            Self::Adc => Block::Adc,
            Self::Syscfg => Block::Syscfg,
            Self::Tim11 => Block::Timer(11),
            Self::Otg => Block::OtgFs,
            Self::Crc => Block::Crc,
            Self::BackupSram => Block::BackupSram,
            // EXTI runs on APB2's own clock; the backup domain and the watchdog have their own
            // clocks (RM0090 section 7.3).
            Self::Exti | Self::Backup | Self::Iwdg | Self::Rcc | Self::Flash | Self::Dbgmcu => {
                return None;
            }
        })
    }
}

/// Returns the part of `Playback` that the reset bit of `block` in RCC resets; `None` if `block`
/// does not belong to `Playback`.
pub const fn playback_block(block: Block) -> Option<playback::Block> {
    Some(match block {
        Block::Timer(n @ 1..=5) => playback::Block::Timer(n),
        Block::Dma(1) => playback::Block::Dma1,
        Block::Dma(_) => playback::Block::Dma2,
        Block::Gpio(port) => playback::Block::Gpio(port as usize),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_where_the_manual_says() {
        let timer = |n| Unit::Playback(playback::Block::Timer(n));
        assert_eq!(find_unit(0x4000_0024), Some((timer(2), 0x24)));
        assert_eq!(find_unit(0x4001_0010), Some((timer(1), 0x10)));
        let port_b = Unit::Playback(playback::Block::Gpio(1));
        assert_eq!(find_unit(0x4002_0418), Some((port_b, 0x18)));
        assert_eq!(find_unit(0x4001_2304), Some((Unit::Adc, 0x304)));
        assert_eq!(find_unit(0x5000_1000), Some((Unit::Otg, 0x1000)));
        assert_eq!(find_unit(0x4000_2850), Some((Unit::Backup, 0x50)));
        assert_eq!(find_unit(0x4002_4C04), Some((Unit::BackupSram, 0xC04)));
        assert_eq!(find_unit(0x4002_5000), None, "beyond backup SRAM");
        assert_eq!(find_unit(0x4002_2400), None, "beyond port I");
        assert_eq!(find_unit(0x4001_4834), Some((Unit::Tim11, 0x34)));
        assert_eq!(find_unit(0x4000_1000), None, "TIM6");
    }

    #[test]
    fn blocks_that_nobody_models_have_their_clocks_where_the_manual_says() {
        for (address, place) in [
            (0x4000_1000, Some((APB1, 4))),  // TIM6
            (0x4000_2000, Some((APB1, 8))),  // TIM14
            (0x4000_5000, Some((APB1, 20))), // UART5
            (0x4000_5C00, Some((APB1, 23))), // I2C3
            (0x4000_6800, Some((APB1, 26))), // CAN2
            (0x4001_1400, Some((APB2, 5))),  // USART6
            (0x4001_3000, Some((APB2, 12))), // SPI1
            (0x4001_4400, Some((APB2, 17))), // TIM10
            (0x5006_0400, Some((1, 5))),     // HASH
            (0x4000_2400, None),
            (0x4000_6000, None),
            (0x4001_0800, None),
            (0xC000_0000, None),
        ] {
            assert_eq!(unmodelled_clock(address), place, "{address:#x}");
            assert!(
                place.is_none() || find_unit(address).is_none(),
                "{address:#x}"
            );
        }
    }
}
