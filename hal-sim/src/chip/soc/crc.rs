//! Models the CRC calculation unit (RM0090 chapter 4): CRC-32 of whole words, polynomial 0x4C11DB7,
//! most significant bit first, neither reflected nor inverted.
//!
//! A word takes four AHB cycles, in which further accesses wait (section 4.3). Assumed: accesses to
//! IDR and CR wait too.

use super::peripheral::{Cycle, Modelled, Peripheral, Unmodelled};

const POLYNOMIAL: u32 = 0x04C1_1DB7;
/// AHB cycles for one word.
const WORD_CYCLES: Cycle = 4;

/// CRC calculation unit.
#[derive(Clone, PartialEq, Debug)]
pub struct Crc {
    sum: u32,
    /// IDR: eight bits for free use by the program.
    independent: u8,
    busy_until: Cycle,
}

impl Default for Crc {
    fn default() -> Self {
        Self {
            sum: u32::MAX,
            independent: 0,
            busy_until: 0,
        }
    }
}

impl Crc {
    /// Returns the additional wait states of an access that would be complete from `done` on.
    pub fn wait(&self, done: Cycle) -> u32 {
        // At most four.
        self.busy_until.saturating_sub(done) as u32
    }
}

impl Peripheral for Crc {
    fn read(&mut self, offset: u32, _at: Cycle) -> Modelled<u32> {
        let word = match offset {
            0x0 => self.sum,
            0x4 => self.independent.into(),
            0x8 => 0,
            _ => return Err(Unmodelled("CRC register")),
        };
        Ok(word)
    }

    fn write(&mut self, offset: u32, value: u32, at: Cycle) -> Modelled {
        match offset {
            0x0 => {
                self.sum = (0..32).fold(self.sum ^ value, |sum, _| {
                    let out = sum >> 31;
                    (sum << 1) ^ (out * POLYNOMIAL)
                });
                self.busy_until = at + WORD_CYCLES;
            }
            0x4 => self.independent = value as u8,
            0x8 if value & 1 != 0 => self.sum = u32::MAX,
            0x8 => {}
            _ => return Err(Unmodelled("CRC register")),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::peripheral::WordAccess;

    #[test]
    fn sums_are_those_of_crc_32_mpeg_2() {
        let mut crc = Crc::default();
        assert_eq!(crc.get(0, 0), u32::MAX);
        // The published check value is that of "123456789", which is two words and one byte.
        for word in [u32::from_be_bytes(*b"1234"), u32::from_be_bytes(*b"5678")] {
            crc.set(0, word, 0);
        }
        let bytewise = b"12345678".iter().fold(u32::MAX, |sum, &byte| {
            (0..8).fold(sum ^ u32::from(byte) << 24, |sum, _| {
                let carry = sum >> 31 != 0;
                (sum << 1) ^ if carry { 0x04C1_1DB7 } else { 0 }
            })
        });
        assert_eq!(crc.get(0, 0), bytewise);
        let ninth = (0..8).fold(bytewise ^ u32::from(b'9') << 24, |sum, _| {
            (sum << 1) ^ ((sum >> 31) * 0x04C1_1DB7)
        });
        assert_eq!(ninth, 0x0376_E6E7);
        crc.set(8, 1, 0);
        assert_eq!(crc.get(0, 0), u32::MAX);
    }

    #[test]
    fn a_word_takes_four_cycles_and_idr_is_the_programs() {
        let mut crc = Crc::default();
        crc.set(4, 0x1A5, 0);
        crc.set(0, 1, 10);
        assert_eq!([10, 12, 14, 20].map(|done| crc.wait(done)), [4, 2, 0, 0]);
        crc.set(8, 1, 20);
        assert_eq!(crc.get(4, 20), 0xA5, "CR leaves IDR alone");
    }
}
