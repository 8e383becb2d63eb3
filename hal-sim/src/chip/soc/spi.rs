//! Models SPI as a transmitting master on one data line (RM0090 chapter 28).
//!
//! Reception, DMA, CRC, a selected slave and I2S are not modelled. Assumed: the first bit begins in
//! the cycle of the write to an idle SPI, and a buffered word follows without a pause.

use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled, refuse_if};

mod cr1 {
    pub const CPHA: u32 = 1;
    pub const CPOL: u32 = 1 << 1;
    pub const MSTR: u32 = 1 << 2;
    pub const SPE: u32 = 1 << 6;
    pub const LSBFIRST: u32 = 1 << 7;
    pub const SSI: u32 = 1 << 8;
    pub const SSM: u32 = 1 << 9;
    pub const RXONLY: u32 = 1 << 10;
    pub const DFF: u32 = 1 << 11;
    pub const CRC: u32 = 0b11 << 12; // CRCEN and CRCNEXT
    pub const BIDIOE: u32 = 1 << 14;
    pub const BIDIMODE: u32 = 1 << 15;
}

const TXE: u32 = 1 << 1;
const BSY: u32 = 1 << 7;
const I2SPR_RESET: u32 = 2;
/// CR2 bits that have no effect here: requests to DMA1, which has no enabled stream, SSOE, and
/// interrupts, whose line is not connected.
const CR2_IDLE: u32 = 0xE7;
const SSOE: u32 = 1 << 2;

/// Times at which a word's bits change on the line (figure 248).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// With rising edges of the clock: a receiver that samples at falling edges gets each bit.
    Rising,
    /// With falling edges, each of which ends its bit.
    FallingAfter,
    /// With falling edges, each of which begins its bit.
    FallingBefore,
}

/// A word that left the shift register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// Cycle at which the last bit ends.
    pub end: Cycle,
    /// Bits of the word; the first one sent is the highest.
    pub value: u16,
    /// Number of bits, 8 or 16.
    pub bits: u8,
    /// Clock edges with which the bits change.
    pub change: Change,
}

/// One SPI block as a master that only sends.
#[derive(Clone, PartialEq, Debug)]
pub struct Spi {
    cr1: u32,
    /// CR2, which is only stored: no stream serves its DMA requests, NSS is on no pin, and the
    /// interrupts are not connected.
    cr2: u32,
    /// Core cycles per cycle of the APB on which the block is.
    bus_divider: u32,
    buffer: Option<u16>,
    shifting: Option<Word>,
    sent: Vec<Word>,
}

impl Default for Spi {
    /// Returns the reset state, with a bus as fast as the core.
    fn default() -> Self {
        Self {
            cr1: 0,
            cr2: 0,
            bus_divider: 1,
            buffer: None,
            shifting: None,
            sent: Vec::new(),
        }
    }
}

impl Spi {
    /// Resets the registers. A word in transmission is never delivered.
    pub fn reset(&mut self) {
        *self = Self {
            bus_divider: self.bus_divider,
            sent: std::mem::take(&mut self.sent),
            ..Self::default()
        };
    }

    /// Sets the core cycles per APB cycle, from the next word on.
    pub fn set_bus_divider(&mut self, divider: u32) {
        self.bus_divider = divider;
    }

    /// Returns the words that ended since the last call, oldest first.
    pub fn words(&mut self) -> impl Iterator<Item = Word> + '_ {
        self.sent.drain(..)
    }

    /// Returns whether a word is being sent, with a running clock line.
    pub const fn is_shifting(&self) -> bool {
        self.shifting.is_some()
    }

    /// Returns whether the SPI is enabled as a master: an unselected slave sends nothing.
    const fn sends(&self) -> bool {
        self.cr1 & cr1::SPE != 0 && self.cr1 & cr1::MSTR != 0
    }

    fn begin(&mut self, value: u16, at: Cycle) {
        let bits: u8 = if self.cr1 & cr1::DFF != 0 { 16 } else { 8 };
        let value = match (self.cr1 & cr1::LSBFIRST != 0, bits) {
            (false, _) => value,
            (true, 8) => (value as u8).reverse_bits().into(),
            (true, _) => value.reverse_bits(),
        };
        let divider = 2 << (self.cr1 >> 3 & 7);
        let cycles = u64::from(self.bus_divider) * divider * u64::from(bits);
        self.shifting = Some(Word {
            end: at.saturating_add(cycles),
            value: if bits == 8 { value & 0xFF } else { value },
            bits,
            change: match (self.cr1 & cr1::CPOL != 0, self.cr1 & cr1::CPHA != 0) {
                (false, true) | (true, false) => Change::Rising,
                (false, false) => Change::FallingAfter,
                (true, true) => Change::FallingBefore,
            },
        });
    }

    /// Writes CR1. Two lines (BIDIMODE 0) send like one, because nothing is received; RXONLY with
    /// one line, and CRCEN and CRCNEXT without each other, have no effect on sending. A low NSS is
    /// a mode fault of a master, which clears MSTR and SPE (section 28.3.10). With SSM, NSS is SSI;
    /// without SSM and SSOE it is a pin, and an unconnected one counts as low.
    fn write_cr1(&mut self, value: u32, at: Cycle) -> Modelled {
        refuse_if(
            self.shifting.is_some() && value != self.cr1,
            "SPI_CR1: changed while busy",
        )?;
        let (crc, one_line) = (value & cr1::CRC, value & cr1::BIDIMODE != 0);
        let receives = match one_line {
            true => value & cr1::BIDIOE == 0,
            false => value & cr1::RXONLY != 0,
        };
        refuse_if(
            value & cr1::SPE != 0 && (crc == cr1::CRC || receives),
            "SPI: a mode other than transmitting without CRC",
        )?;
        self.cr1 = value & 0xFFFF;
        let is_low = match value & cr1::SSM {
            0 => self.cr2 & SSOE == 0,
            _ => value & cr1::SSI == 0,
        };
        if self.sends() && is_low {
            self.cr1 &= !(cr1::MSTR | cr1::SPE);
        }
        if self.sends()
            && self.shifting.is_none()
            && let Some(waiting) = self.buffer.take()
        {
            self.begin(waiting, at);
        }
        Ok(())
    }

    /// Writes DR. A word that waits in the buffer (TXE clear) is overwritten (section 28.3.5).
    fn write_data(&mut self, value: u32, at: Cycle) {
        let value = (value & 0xFFFF) as u16;
        if self.sends() && self.shifting.is_none() {
            self.begin(value, at);
        } else {
            self.buffer = Some(value);
        }
    }
}

impl Peripheral for Spi {
    fn read(&mut self, offset: u32, at: Cycle) -> Modelled<u32> {
        self.advance(at)?;
        let word = match offset {
            0x00 => self.cr1,
            0x04 => self.cr2,
            0x1C => 0,
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
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        self.advance(at)?;
        match offset {
            0x00 => self.write_cr1(value, at),
            0x04 if value & !CR2_IDLE != 0 => Err(Unmodelled("SPI_CR2: TI mode")),
            0x04 => {
                self.cr2 = value;
                Ok(())
            }
            0x0C => {
                self.write_data(value, at);
                Ok(())
            }
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

    /// Returns the end of the word in transmission.
    fn next_event(&self) -> Cycle {
        self.shifting.map_or(Cycle::MAX, |word| word.end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    const CR1: u32 = 0;
    const SR: u32 = 8;
    const DR: u32 = 0xC;
    /// Settings of the board: master, one line, transmit, 16 bits, clock / 2, CPHA.
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
        spi.write(DR, 0xBEEF, 110).unwrap();
        assert_eq!(spi.get(SR, 111), BSY);
        // 21 MHz: 8 cycles per bit, 128 per word.
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
                spi.write(DR, 0xFFFF, 0).unwrap();
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
        assert!(spi.read(DR, 0).is_err());
        for _ in 0..2 {
            spi.write(DR, 0, 0).unwrap();
        }
        assert!(spi.write(CR1, 0, 1).is_err(), "busy");
        let mut off = Spi::default();
        // Reception on one line, and CRC.
        for cr1 in [BOARD & !(1 << 14), BOARD | 3 << 12] {
            assert!(off.write(CR1, cr1, 0).is_err(), "{cr1:#x}");
        }
    }

    /// Section 28.3.5: the buffer holds the word written last.
    #[test]
    fn a_word_that_waits_is_overwritten() {
        let mut spi = spi(BOARD);
        for word in [1, 2, 3] {
            spi.set(DR, word, 0);
        }
        spi.advance(1 << 20).unwrap();
        assert_eq!(
            spi.words().map(|word| word.value).collect::<Vec<_>>(),
            [1, 3]
        );
    }

    /// Figure 248: by CPOL and CPHA.
    #[test]
    fn bits_change_with_the_edge_that_polarity_and_phase_choose() {
        let changes = [0b00, 0b01, 0b10, 0b11].map(|mode| {
            let mut spi = spi(BOARD & !3 | mode);
            spi.set(DR, 1, 0);
            spi.advance(1 << 20).unwrap();
            spi.words().next().map(|word| word.change)
        });
        let [after, before] = [Change::FallingAfter, Change::FallingBefore];
        let expected = [after, Change::Rising, Change::Rising, before];
        assert_eq!(changes, expected.map(Some));
    }

    #[test]
    fn what_is_off_keeps_a_word_until_it_is_on() {
        // Off; a slave; a master with a low NSS, from SSI and from an unconnected pin.
        for cr1 in [
            BOARD & !(1 << 6),
            BOARD & !4,
            BOARD & !(1 << 8),
            BOARD & !(1 << 9),
        ] {
            let mut spi = spi(cr1);
            spi.set(DR, 0x1234, 0);
            assert_eq!(spi.get(SR, 1_000), 0, "{cr1:#x}");
            assert_eq!(spi.words().count(), 0);
            spi.set(CR1, BOARD, 1_000);
            assert_eq!(spi.get(SR, 1_001), TXE | BSY);
            assert_eq!(spi.get(SR, 1_128), TXE);
            assert_eq!(spi.words().next().map(|word| word.value), Some(0x1234));
        }
        assert_eq!(spi(BOARD & !(1 << 8)).get(CR1, 0) & 0x44, 0, "a mode fault");
        let mut reversed = spi(BOARD | 1 << 7);
        reversed.set(DR, 0x0001, 0);
        reversed.advance(1 << 20).unwrap();
        assert_eq!(reversed.words().next().map(|word| word.value), Some(0x8000));
    }
}
