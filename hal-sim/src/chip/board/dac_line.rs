//! Derives the bits that the DACs receive from a word that the SPI sends. They sample at falling
//! edges of the clock (AD5668 data sheet, figure 2).

use super::wiring::{DAC_CLOCK, DAC_DATA, Pin};
use crate::chip::soc::gpio::Gpio;
use crate::chip::soc::spi::{Change, Word};
use crate::random;

/// Number of the alternate function that connects a pin to SPI3 (DS8626 table 9).
const SPI3: u32 = 6;

/// Returns the bits of `word` as the DACs sample them, with the first bit highest; `None` if the
/// clock pin is not connected to SPI3. If the data pin is not connected to SPI3, every bit has the
/// level of that pin.
///
/// If a bit changes at the clock edge at which the DAC samples it, the DAC may get the old or the
/// new bit: the data sheets promise nothing (AD5668, t6; DS8626, data output hold time). The choice
/// is pseudo-random and depends on the time of the word.
pub(super) fn received_bits(word: &Word, pins: &Gpio) -> Option<u16> {
    let is_spi = |(port, pin): Pin| pins.has_function(port.index(), pin.into(), SPI3);
    if !is_spi(DAC_CLOCK) {
        return None;
    }
    let mask = u16::MAX >> (16 - word.bits);
    if !is_spi(DAC_DATA) {
        let high = pins.level(DAC_DATA.0.index(), DAC_DATA.1.into());
        return Some(if high { mask } else { 0 });
    }
    let (first, last) = (word.value & (mask >> 1 ^ mask), word.value & 1);
    let other = match word.change {
        Change::Rising => return Some(word.value),
        Change::FallingAfter => word.value << 1 | last,
        Change::FallingBefore => word.value >> 1 | first,
    };
    let drawn = random::word(word.end, word.value.into()) as u16;
    Some((word.value & drawn | other & !drawn) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chip::soc::Lanes;
    use crate::chip::soc::gpio::offset;

    fn word(value: u16, change: Change) -> Word {
        Word {
            end: 1_000,
            value,
            bits: 16,
            change,
        }
    }

    /// Returns port C as on the board, except for the modes of pins 10 and 12, which `moder` sets.
    fn pins(moder: u32) -> Gpio {
        let mut pins = Gpio::default();
        for (offset, value) in [(offset::MODER, moder), (offset::AFRH, 0x0006_0600)] {
            pins.write(2, offset, Lanes::whole(value), 0).unwrap();
        }
        pins
    }

    #[test]
    fn a_bit_sampled_as_it_changes_is_its_own_or_its_neighbours() {
        let pins = pins(0x0220_0000);
        assert_eq!(
            received_bits(&word(0xA5F0, Change::Rising), &pins),
            Some(0xA5F0)
        );
        for change in [Change::FallingAfter, Change::FallingBefore] {
            for same in [0, 0xFFFF] {
                assert_eq!(received_bits(&word(same, change), &pins), Some(same));
            }
            let heard: Vec<_> = (0..64)
                .filter_map(|end| {
                    let word = Word {
                        end,
                        ..word(0x0F00, change)
                    };
                    received_bits(&word, &pins)
                })
                .collect();
            let [all, any] = [
                heard.iter().fold(0xFFFF, |a, b| a & b),
                heard.iter().fold(0, |a, b| a | b),
            ];
            let expected = match change {
                Change::FallingAfter => (0x0E00, 0x1F00),
                _ => (0x0700, 0x0F80),
            };
            assert_eq!((all, any), expected, "{change:?}");
        }
    }

    #[test]
    fn a_pin_that_is_not_the_spis_carries_nothing() {
        let word = word(0x1234, Change::Rising);
        assert_eq!(received_bits(&word, &pins(0x0200_0000)), None, "no clock");
        assert_eq!(received_bits(&word, &pins(0x0020_0000)), Some(0), "no data");
    }
}
