//! Models SPI words that never arrive at the DACs.

use crate::chip::ad5668::Ad5668;

/// Selection of the SPI words that are lost on the way to the DACs; by default none.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Loss {
    /// Number of DAC writes still to be lost, wholly or in part. A write consists of two words.
    writes: u32,
    /// Which word of each write is lost; `None` for both words.
    half: Option<Half>,
    /// DAC output of a channel, 0 to 9, whose writes are lost; `None` for all outputs.
    only: Option<u8>,
    /// Set if the next word is the second of a write: whether that write is to be lost.
    second: Option<bool>,
}

/// One of the two words of a write.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Half {
    /// Command, output, and the upper bits of the code.
    First,
    /// Lower bits of the code.
    Second,
}

/// Number of outputs of each DAC that set the amplitude of a channel.
const PER_DAC: u8 = 5;

impl Loss {
    /// Selects the next `writes` DAC writes, of two words each. If `half` is given, only that word
    /// of each write is lost. If `only`, a channel's output from 0 to 9, is given, only writes to
    /// it are lost.
    #[must_use]
    pub const fn new(writes: u32, half: Option<Half>, only: Option<u8>) -> Self {
        Self {
            writes,
            half,
            only,
            second: None,
        }
    }

    /// Notes an edge of /SYNC, after which the next word begins a write.
    pub(super) fn begin(&mut self) {
        self.second = None;
    }

    /// Returns whether `word`, clocked out to `dacs`, is lost.
    pub(super) fn is_lost(&mut self, word: u16, dacs: &[Ad5668; 2]) -> bool {
        if let Some(lost) = self.second.take() {
            return lost && self.half != Some(Half::First);
        }
        let chip = dacs.iter().position(Ad5668::is_selected);
        let output = chip.map(|chip| chip as u8 * PER_DAC + (word >> 4 & 0xF) as u8); // 0 or 1
        let lost = self.writes > 0 && (self.only.is_none() || self.only == output);
        self.writes -= u32::from(lost);
        self.second = Some(lost);
        lost && self.half != Some(Half::Second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns which of six words to DAC 2 are lost: writes to its outputs 0, 1 and 0.
    fn lost(mut loss: Loss) -> [bool; 6] {
        let mut dacs = [Ad5668::default(), Ad5668::default()];
        dacs[1].select(true);
        let words = [0x0300, 0x1111, 0x0310, 0x2222, 0x0300, 0x3333];
        words.map(|word| loss.is_lost(word, &dacs))
    }

    #[test]
    fn writes_are_lost_whole_by_half_or_of_one_output() {
        let (no, yes) = (false, true);
        assert_eq!(lost(Loss::default()), [no; 6]);
        assert_eq!(lost(Loss::new(1, None, None)), [yes, yes, no, no, no, no]);
        assert_eq!(lost(Loss::new(2, None, None)), [yes, yes, yes, yes, no, no]);
        assert_eq!(
            lost(Loss::new(1, None, Some(6))),
            [no, no, yes, yes, no, no]
        );
        let first = lost(Loss::new(1, Some(Half::First), None));
        assert_eq!(first, [yes, no, no, no, no, no]);
        let second = lost(Loss::new(1, Some(Half::Second), None));
        assert_eq!(second, [no, yes, no, no, no, no]);
    }
}
