//! Stimulation time and charge spent of a wearer's allowance, stored so that they survive a reset:
//! two copies in memory that a reset does not clear, each with a checksum. Not here: counting
//! (`guard::allowance`) and writing (the board's thread; `lockstep` in simulators).

use crate::crc::CRC;
use crate::pulse::CHANNELS;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Stimulation time that a boot adds if the copy it reads is open ([`Entry::is_open`]), µs. Copies
/// are written more often than this, so no more time can be missing from one.
pub const OPEN_US: u32 = 250_000;

/// Number of charge units (256ths of a pC) in 1 nC.
const PER_NC: u64 = 256_000;

/// Marks a copy as an allowance and identifies its format.
const MAGIC: u32 = 0x464C_0100;
const IS_OPEN: u32 = 1;
/// Number of words before the channels: magic, entry number, and two words of time.
const HEAD: usize = 4;
const WORDS: usize = HEAD + 3 * CHANNELS + 1;

/// Encoded words of one copy, with their checksum at the end.
pub type AllowanceWords = [u32; WORDS];

/// Stimulation time and charge spent since power came up.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Hash)]
pub struct Usage {
    /// Stimulation time, µs.
    pub time_us: u64,
    /// Charge of each channel, in 256ths of a pC. One of the two phases of a pulse counts.
    pub charge: [u64; CHANNELS],
}

/// Time and charge as one copy stores them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Entry {
    /// Time and charge spent up to the moment at which the entry was made.
    pub spent: Usage,
    /// Whether stimulation could continue after the entry was made. If it could, the boot after a
    /// reset adds [`OPEN_US`] and `most_nc` to `spent`, which is then at least what was output.
    pub is_open: bool,
    /// Largest charge that each channel can output within [`OPEN_US`], nC.
    pub most_nc: [u32; CHANNELS],
}

/// Time and charge left of the wearer's allowance.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct RemainingAllowance {
    /// Stimulation time left, ms.
    pub time_ms: u32,
    /// The channel that has the least charge left, from 0.
    pub channel: u8,
    /// Charge left on that channel, µC; [`u32::MAX`] stands for this or any larger charge.
    pub dose_uc: u32,
}

/// The time and charge spent before a boot, as far as the boot can know them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum UsageAtBoot {
    /// The amount spent: read from an undamaged copy, or zero because power was lost.
    Spent(Usage),
    /// Unknown, because no copy is undamaged although power was not lost. Nothing may be armed.
    Lost,
}

impl Default for UsageAtBoot {
    /// Returns that no time and no charge is spent, as after power-on.
    fn default() -> Self {
        Self::Spent(Usage::default())
    }
}

impl Entry {
    /// Returns the time and charge that count as spent after a reset: those of the entry, and if it
    /// is open, the most that may be missing from it.
    fn usage_after_reset(&self) -> Usage {
        let mut spent = self.spent;
        if self.is_open {
            spent.time_us = spent.time_us.saturating_add(OPEN_US.into());
            for (charge, most_nc) in spent.charge.iter_mut().zip(self.most_nc) {
                *charge = charge.saturating_add(u64::from(most_nc) * PER_NC);
            }
        }
        spent
    }

    fn encode(&self, number: u32) -> AllowanceWords {
        let [low, high] = halves(self.spent.time_us);
        let flags = if self.is_open { IS_OPEN } else { 0 };
        let head = [MAGIC | flags, number, low, high];
        let charges = self.spent.charge.into_iter().flat_map(halves);
        let mut words = [0; WORDS];
        let content = head.into_iter().chain(charges).chain(self.most_nc);
        for (slot, word) in words.iter_mut().zip(content) {
            *slot = word;
        }
        let [content @ .., check] = &mut words;
        *check = checksum(content);
        words
    }

    /// Decodes a copy into its entry number and entry; `None` if the copy is damaged.
    #[inline(never)]
    fn from_words(words: &AllowanceWords) -> Option<(u32, Self)> {
        let [content @ .., check] = words;
        let [flags, number, low, high, channels @ ..] = content;
        if *check != checksum(content) || flags & !IS_OPEN != MAGIC {
            return None;
        }
        let (charges, most) = channels.split_at_checked(2 * CHANNELS)?;
        let mut entry = Self {
            spent: Usage {
                time_us: join_halves([*low, *high]),
                charge: [0; CHANNELS],
            },
            is_open: flags & IS_OPEN != 0,
            most_nc: [0; CHANNELS],
        };
        for (charge, halves) in entry.spent.charge.iter_mut().zip(charges.as_chunks().0) {
            *charge = join_halves(*halves);
        }
        for (slot, word) in entry.most_nc.iter_mut().zip(most) {
            *slot = *word;
        }
        Some((*number, entry))
    }
}

/// Writer of the two copies. It knows which copy to write first, so that one copy is undamaged at
/// every moment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Ledger {
    /// Number of the latest entry; it wraps.
    number: u32,
    /// Index of the copy that is written first, because the other may be the only undamaged one.
    first: usize,
}

impl Ledger {
    /// Reads the two copies after a boot. `is_power_on` states that power was lost before: then
    /// both copies are ignored, even undamaged ones, and the caller must write an empty entry with
    /// [`Self::write`] before anything else.
    #[must_use]
    pub fn open(copies: [&AllowanceWords; 2], is_power_on: bool) -> (Self, UsageAtBoot) {
        if is_power_on {
            return (Self::default(), UsageAtBoot::default());
        }
        let [a, b] = copies.map(Entry::from_words);
        let newest = match (a, b) {
            // Numbers wrap; the two copies are at most one number apart.
            (Some((a, _)), Some((b, _))) => usize::from(b.wrapping_sub(a) as i32 > 0),
            (None, Some(_)) => 1,
            (_, None) => 0,
        };
        let entry = if newest == 0 { a } else { b };
        let ledger = Self {
            number: entry.map_or(0, |(number, _)| number),
            first: 1 - newest,
        };
        let found = entry.map_or(UsageAtBoot::Lost, |(_, entry)| {
            UsageAtBoot::Spent(entry.usage_after_reset())
        });
        (ledger, found)
    }

    /// Returns the indices of the two copies, in the sequence in which they must be written, and
    /// the words of `entry` to write to each.
    pub fn write(&mut self, entry: &Entry) -> ([usize; 2], AllowanceWords) {
        self.number = self.number.wrapping_add(1);
        ([self.first, 1 - self.first], entry.encode(self.number))
    }
}

const fn halves(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}

const fn join_halves([low, high]: [u32; 2]) -> u64 {
    low as u64 | (high as u64) << 32
}

#[inline(never)]
fn checksum(words: &[u32]) -> u32 {
    let mut digest = CRC.digest();
    for word in words {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOTHING: AllowanceWords = [0; WORDS];

    fn entry(time_us: u64, is_open: bool) -> Entry {
        let mut entry = Entry {
            is_open,
            ..Entry::default()
        };
        entry.spent.time_us = time_us;
        for (n, charge) in entry.spent.charge.iter_mut().enumerate() {
            *charge = (n as u64 + 1) << 33 | 5;
        }
        entry.most_nc = core::array::from_fn(|n| 1_000 + n as u32);
        entry
    }

    fn found(copies: &[AllowanceWords; 2]) -> UsageAtBoot {
        Ledger::open(copies.each_ref(), false).1
    }

    fn store(ledger: &mut Ledger, copies: &mut [AllowanceWords; 2], entry: &Entry) {
        let (order, words) = ledger.write(entry);
        for copy in order {
            copies[copy] = words;
        }
    }

    #[test]
    fn a_closed_entry_comes_back_and_an_open_one_with_a_quarter_second_more() {
        let mut copies = [NOTHING; 2];
        let mut ledger = Ledger::default();
        let closed = entry(7_000_000_000, false);
        store(&mut ledger, &mut copies, &closed);
        assert_eq!(found(&copies), UsageAtBoot::Spent(closed.spent));
        let open = entry(7_000_000_001, true);
        store(&mut ledger, &mut copies, &open);
        let mut more = open.spent;
        more.time_us += 250_000;
        for (n, charge) in more.charge.iter_mut().enumerate() {
            *charge += (1_000 + n as u64) * 256_000;
        }
        // The result is the same however often the copies are read: a boot that resets again adds
        // no more.
        assert_eq!(found(&copies), UsageAtBoot::Spent(more));
        assert_eq!(found(&copies), UsageAtBoot::Spent(more));
    }

    #[test]
    fn power_that_came_up_clears_and_two_bad_copies_are_lost() {
        let mut copies = [NOTHING; 2];
        assert_eq!(found(&copies), UsageAtBoot::Lost);
        let (_, after) = Ledger::open(copies.each_ref(), true);
        assert_eq!(after, UsageAtBoot::default());
        store(&mut Ledger::default(), &mut copies, &entry(9, false));
        let (mut ledger, after) = Ledger::open(copies.each_ref(), true);
        assert_eq!(after, UsageAtBoot::default());
        store(&mut ledger, &mut copies, &Entry::default());
        assert_eq!(found(&copies), UsageAtBoot::default());
    }

    #[test]
    fn one_flipped_bit_leaves_the_other_copy_and_two_nothing() {
        let mut copies = [NOTHING; 2];
        let entry = entry(123_456, true);
        store(&mut Ledger::default(), &mut copies, &entry);
        let usage = found(&copies);
        for bit in 0..32 * WORDS {
            let flip = |words: &mut AllowanceWords| words[bit / 32] ^= 1 << (bit % 32);
            for copy in 0..2 {
                let mut half_damaged = copies;
                flip(&mut half_damaged[copy]);
                assert_eq!(found(&half_damaged), usage, "bit {bit}");
            }
            let mut fully_damaged = copies;
            fully_damaged.iter_mut().for_each(flip);
            assert_eq!(found(&fully_damaged), UsageAtBoot::Lost, "bit {bit}");
        }
    }

    /// Resets the device at each step of a write, after damage to neither or one of the copies.
    #[test]
    fn a_reset_within_a_writing_finds_the_old_entry_or_the_new() {
        for damaged in [None, Some(0), Some(1)] {
            let mut copies = [NOTHING; 2];
            let mut ledger = Ledger {
                number: u32::MAX - 1,
                first: 0,
            };
            let old = entry(1_000, true);
            store(&mut ledger, &mut copies, &old);
            if let Some(copy) = damaged {
                copies[copy][9] ^= 4;
            }
            let (mut ledger, before) = Ledger::open(copies.each_ref(), false);
            let new = entry(201_000, true);
            let after = UsageAtBoot::Spent(new.usage_after_reset());
            let (order, words) = ledger.write(&new);
            for copy in order {
                for at in 0..WORDS {
                    copies[copy][at] = words[at];
                    let now = found(&copies);
                    assert!(now == before || now == after, "{damaged:?}, word {at}");
                }
            }
            assert_eq!(found(&copies), after);
        }
    }
}
