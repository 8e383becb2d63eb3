//! Rules for register accesses narrower than a word: the widths that a block's chapter of RM0090
//! permits, and the effect of the bus.
//!
//! A block on AHB changes only the written bytes. A bridge to APB makes a word of every access, and
//! duplicates the written data (section 2.1.11, note). An access that the chapter forbids has an
//! unknown effect and is refused.

use super::map::Unit;
use super::matrix::Bridge;
use super::playback::Block;
use super::word::Lanes;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};

/// Narrowest accesses that a register permits, and the text with which others are refused.
struct NarrowestAccess {
    read: Size,
    write: Size,
    else_refused: &'static str,
}

const fn permitted(read: Size, write: Size, else_refused: &'static str) -> NarrowestAccess {
    NarrowestAccess {
        read,
        write,
        else_refused,
    }
}

/// Offsets of FLASH_KEYR and FLASH_OPTKEYR.
const KEYS: std::ops::RangeInclusive<u32> = 0x04..=0x0B;
/// Offset of RCC_PLLCFGR.
const PLLCFGR: u32 = 0x04;
/// Offset of CRC_IDR.
const IDR: u32 = 0x04;
/// Offset of the data register in a USART.
const USART_DR: u32 = 0x04;
/// Offset of the data register in an SPI.
const SPI_DR: u32 = 0x0C;
/// Offsets of TIMx_CNT, ARR, CCR1 to 4, which have 32 bits in TIM2 and TIM5.
const COUNTS: [u32; 6] = [0x24, 0x2C, 0x34, 0x38, 0x3C, 0x40];

const HALVES: &str = "a byte written to a register of half-words";

/// Returns the narrowest accesses that the register at `offset` of `unit` permits. `offset` is a
/// multiple of 4.
fn rule(unit: Unit, offset: u32) -> NarrowestAccess {
    use Size::{Byte, Half, Word};
    match unit {
        // Sections 8.4, 7.3, 3.9; memory.
        Unit::Flash if KEYS.contains(&offset) => {
            permitted(Byte, Word, "a FLASH key narrower than a word")
        }
        Unit::Rcc if offset == PLLCFGR => permitted(Byte, Half, "a byte written to RCC_PLLCFGR"),
        Unit::Playback(Block::Gpio(_)) | Unit::Rcc | Unit::Flash | Unit::BackupSram => {
            permitted(Byte, Byte, "")
        }
        // Sections 10.5, 4.4; the CMSIS header defines IDR as a byte.
        Unit::Playback(Block::Dma1 | Block::Dma2) => {
            permitted(Word, Word, "a DMA access narrower than a word")
        }
        Unit::Crc if offset == IDR => permitted(Byte, Byte, ""),
        Unit::Crc => permitted(Word, Word, "a CRC access narrower than a word"),
        Unit::Otg => permitted(Word, Word, "an OTG_FS access narrower than a word"),
        Unit::Dbgmcu => permitted(Byte, Word, "a DBGMCU write narrower than a word"),
        // Sections 17.4, 18.4, 19.4.
        Unit::Playback(Block::Timer(2 | 5)) if COUNTS.contains(&offset) => {
            permitted(Byte, Word, "a TIM write narrower than its register")
        }
        Unit::Playback(Block::Timer(_)) | Unit::Tim11 => permitted(Byte, Half, HALVES),
        // Sections 13.13, 26.6.
        Unit::Adc => permitted(Byte, Word, "an ADC write narrower than a word"),
        Unit::Backup => permitted(Byte, Word, "an RTC write narrower than a word"),
        // Sections 28.5, 30.6 have half-words, but ST's own drivers write data as bytes.
        Unit::Spi3 if offset == SPI_DR => permitted(Byte, Byte, ""),
        Unit::Usart2 if offset == USART_DR => permitted(Byte, Byte, ""),
        // The same sections, and 21.4.
        Unit::Spi3 | Unit::Usart2 | Unit::Iwdg => permitted(Byte, Half, HALVES),
        // Their chapters give no rule: that of the bridge applies.
        Unit::Pwr | Unit::Syscfg | Unit::Exti => permitted(Byte, Byte, ""),
    }
}

/// Refuses a read of `size` at `offset` of `unit` that is not permitted.
pub(super) fn check_read(unit: Unit, offset: u32, size: Size) -> Modelled {
    if size == Size::Word {
        return Ok(());
    }
    let rule = rule(unit, offset & !3);
    refuse_if(size.bytes() < rule.read.bytes(), rule.else_refused)
}

/// Returns the bytes of the register that a write of `size` at `offset` of `unit` changes.
///
/// # Errors
/// Returns [`Unmodelled`] if the width is not permitted.
pub(super) fn written_lanes(unit: Unit, offset: u32, size: Size, value: u32) -> Modelled<Lanes> {
    if size == Size::Word {
        return Ok(Lanes::whole(value));
    }
    let rule = rule(unit, offset & !3);
    if size.bytes() < rule.write.bytes() {
        return Err(Unmodelled(rule.else_refused));
    }
    let is_on_apb = match unit {
        Unit::Playback(block) => matches!(block, Block::Timer(_)),
        _ => matches!(unit.bridge(), Some(Bridge::Apb1 | Bridge::Apb2)),
    };
    Ok(match is_on_apb {
        true => Lanes::whole(replicate_lanes(unit, size, value)),
        false => Lanes::from_access(offset, size, value),
    })
}

/// Returns the word that a bridge makes of a byte or half-word. Registers of half-words have no
/// upper half.
const fn replicate_lanes(unit: Unit, size: Size, value: u32) -> u32 {
    let half = match size {
        Size::Byte => (value & 0xFF) * 0x0101,
        _ => value & 0xFFFF,
    };
    match unit {
        Unit::Exti | Unit::Syscfg => half * 0x0001_0001,
        _ => half,
    }
}

#[cfg(test)]
mod tests;
