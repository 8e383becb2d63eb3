//! SPI as a transmitting master on one data line (RM0090 chapter 28).
//!
//! Reception, DMA, CRC, slave mode and I2S are not modelled. Taken here: the
//! first bit begins in the cycle of the write to an idle SPI, and a buffered
//! word follows without a pause.

use super::peripheral::{Cycle, Modelled, Peripheral, Size, Unmodelled, part, refuse};

mod cr1 {
    pub const CPHA: u32 = 1;
    pub const CPOL: u32 = 1 << 1;
    pub const MSTR: u32 = 1 << 2;
    pub const SPE: u32 = 1 << 6;
    pub const LSBFIRST: u32 = 1 << 7;
    pub const SSI: u32 = 1 << 8;
    pub const SSM: u32 = 1 << 9;
    pub const DFF: u32 = 1 << 11;
    pub const BIDIOE: u32 = 1 << 14;
    pub const BIDIMODE: u32 = 1 << 15;
}

const TXE: u32 = 1 << 1;
const BSY: u32 = 1 << 7;
const I2SPR_RESET: u32 = 2;

/// A word that left the shift register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// End of its last bit.
    pub end: Cycle,
    /// Its bits, the first sent being the highest.
    pub value: u16,
    /// Number of bits, 8 or 16.
    pub bits: u8,
}

/// One SPI block.
#[derive(Clone, PartialEq, Debug)]
pub struct Spi {
    cr1: u32,
    /// Core cycles per cycle of its bus.
    bus_divider: u32,
    buffer: Option<u16>,
    shifting: Option<Word>,
    sent: Vec<Word>,
}

impl Default for Spi {
    /// At reset, its bus as fast as the core.
    fn default() -> Self {
        Self {
            cr1: 0,
            bus_divider: 1,
            buffer: None,
            shifting: None,
            sent: Vec::new(),
        }
    }
}

impl Spi {
    /// Reset of the block or the chip. A word cut off is never delivered.
    pub fn reset(&mut self) {
        *self = Self {
            bus_divider: self.bus_divider,
            sent: std::mem::take(&mut self.sent),
            ..Self::default()
        };
    }

    /// Core cycles per cycle of its bus, from the next word on.
    pub fn set_bus_divider(&mut self, divider: u32) {
        self.bus_divider = divider;
    }

    /// Words that ended since the last call, oldest first.
    pub fn words(&mut self) -> impl Iterator<Item = Word> + '_ {
        self.sent.drain(..)
    }

    /// The clock line is running: a word is under way.
    pub const fn is_shifting(&self) -> bool {
        self.shifting.is_some()
    }

    fn begin(&mut self, value: u16, at: Cycle) {
        let bits: u8 = if self.cr1 & cr1::DFF != 0 { 16 } else { 8 };
        let divider = 2 << (self.cr1 >> 3 & 7);
        let cycles = u64::from(self.bus_divider) * divider * u64::from(bits);
        self.shifting = Some(Word {
            end: at.saturating_add(cycles),
            value: if bits == 8 { value & 0xFF } else { value },
            bits,
        });
    }

    fn write_cr1(&mut self, value: u32) -> Modelled {
        refuse(
            self.shifting.is_some() && value != self.cr1,
            "SPI_CR1: changed while busy",
        )?;
        let must = cr1::MSTR | cr1::SSM | cr1::SSI | cr1::BIDIMODE | cr1::BIDIOE;
        let may = must | cr1::CPHA | cr1::CPOL | 7 << 3 | cr1::SPE | cr1::DFF;
        refuse(value & cr1::LSBFIRST != 0, "SPI_CR1: LSBFIRST")?;
        refuse(
            value & cr1::SPE != 0 && (value & must != must || value & !may != 0),
            "SPI: all but a transmitting master on one line with software NSS",
        )?;
        self.cr1 = value & 0xFFFF;
        Ok(())
    }

    fn write_data(&mut self, value: u32, at: Cycle) -> Modelled {
        refuse(self.cr1 & cr1::SPE == 0, "SPI_DR: written while SPE is off")?;
        let value = (value & 0xFFFF) as u16;
        if self.shifting.is_none() {
            self.begin(value, at);
        } else if self.buffer.is_none() {
            self.buffer = Some(value);
        } else {
            return Err(Unmodelled("SPI_DR: written while TXE is clear"));
        }
        Ok(())
    }
}

impl Peripheral for Spi {
    fn read(&mut self, offset: u32, size: Size, at: Cycle) -> Modelled<u32> {
        self.advance(at)?;
        let word = match offset & !3 {
            0x00 => self.cr1,
            0x04 | 0x1C => 0,
            0x08 => {
                let empty = if self.buffer.is_none() { TXE } else { 0 };
                let busy = if self.shifting.is_some() { BSY } else { 0 };
                empty | busy
            }
            0x0C => return Err(Unmodelled("SPI_DR: reception")),
            0x10 => 7,
            0x20 => I2SPR_RESET,
            _ => return Err(Unmodelled("SPI register")),
        };
        Ok(part(word, offset, size))
    }

    fn write(&mut self, offset: u32, size: Size, value: u32, at: Cycle) -> Modelled {
        self.advance(at)?;
        if size == Size::Byte {
            return Err(Unmodelled("SPI: byte writes")); // section 28.5
        }
        match offset {
            0x00 => self.write_cr1(value),
            0x04 if value == 0 => Ok(()),
            0x04 => Err(Unmodelled("SPI_CR2: DMA, interrupts, NSS output")),
            0x0C => self.write_data(value, at),
            0x1C if value == 0 => Ok(()),
            _ => Err(Unmodelled("SPI register")),
        }
    }

    fn advance(&mut self, to: Cycle) -> Modelled {
        while let Some(word) = self.shifting.filter(|word| word.end <= to) {
            self.sent.push(word);
            self.shifting = None;
            if let Some(next) = self.buffer.take() {
                self.begin(next, word.end);
            }
        }
        Ok(())
    }

    /// The end of the word under way.
    fn next_event(&self) -> Cycle {
        self.shifting.map_or(Cycle::MAX, |word| word.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::Driven;

    const CR1: u32 = 0;
    const SR: u32 = 8;
    const DR: u32 = 0xC;
    /// The board's: master, one line, transmit, 16 bits, clock / 2, CPHA.
    const BOARD: u32 = 0xCB45;

    fn spi(cr1: u32) -> Spi {
        let mut spi = Spi::default();
        spi.set_bus_divider(4);
        spi.set(CR1, cr1, 0);
        spi
    }

    #[test]
    fn two_words_follow_each_other_through_buffer_and_shift_register() {
        let mut spi = spi(BOARD);
        assert_eq!(spi.get(SR, 10), TXE);
        spi.set(DR, 0x0730, 100);
        assert_eq!(spi.get(SR, 101), TXE | BSY);
        spi.write(DR, Size::Half, 0xBEEF, 110).unwrap();
        assert_eq!(spi.get(SR, 111), BSY);
        // 21 MHz: 8 cycles a bit, 128 a word.
        assert_eq!(spi.get(SR, 227), BSY);
        assert_eq!(spi.get(SR, 228), TXE | BSY);
        assert_eq!(spi.next_event(), 356);
        assert_eq!(spi.get(SR, 355), TXE | BSY);
        assert_eq!(spi.get(SR, 356), TXE);
        assert!(!spi.is_shifting());
        let words: Vec<_> = spi.words().map(|w| (w.end, w.value, w.bits)).collect();
        assert_eq!(words, [(228, 0x0730, 16), (356, 0xBEEF, 16)]);
        assert_eq!(spi.words().count(), 0);
    }

    #[test]
    fn the_divider_and_the_frame_set_the_time() {
        for br in 0..8 {
            for (dff, bits) in [(0, 8), (1 << 11, 16)] {
                let mut spi = spi(BOARD & !(1 << 11) | br << 3 | dff);
                spi.write(DR, Size::Half, 0xFFFF, 0).unwrap();
                assert_eq!(spi.next_event(), (8 << br) * bits);
                spi.advance(1 << 20).unwrap();
                let word = spi.words().next().unwrap();
                assert_eq!(u32::from(word.value), (1 << bits) - 1);
            }
        }
    }

    #[test]
    fn reception_and_misuse_stop_the_run() {
        let mut spi = spi(BOARD);
        assert!(spi.read(DR, Size::Word, 0).is_err());
        assert!(spi.write(DR, Size::Byte, 0, 0).is_err());
        for _ in 0..2 {
            spi.write(DR, Size::Half, 0, 0).unwrap();
        }
        assert!(spi.write(DR, Size::Half, 0, 1).is_err(), "TXE is clear");
        assert!(spi.write(CR1, Size::Word, 0, 1).is_err(), "busy");
        let mut off = Spi::default();
        assert!(off.write(DR, Size::Half, 0, 0).is_err());
        for cr1 in [
            BOARD & !(1 << 15),
            BOARD & !4,
            BOARD & !(1 << 9),
            BOARD | 1 << 13,
        ] {
            assert!(off.write(CR1, Size::Word, cr1, 0).is_err(), "{cr1:#x}");
        }
    }
}
