//! Which output stages a board has: its own word, kept in its memory, against which
//! what a host declares is held.
//!
//! A host that declares 60 V on a stage of 100 mA would arm, and drive three times
//! the current it asked for: no measurement below the first pulse can tell. So a
//! board says what it is, and a setup that says otherwise is refused by name.

use super::StageSpec;
use crate::crc::CRC;
use crate::pulse::CHANNELS;
use crate::range::OutOfRange;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// An output stage as the board has it; a host adds the load that it assumes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum StageKind {
    /// Sets currents.
    Current {
        /// At DAC code 65 535, 1000–100 000 µA.
        full_scale_ua: u32,
    },
    /// Sets voltages.
    Voltage {
        /// At DAC code 65 535, 1000–150 000 mV.
        full_scale_mv: u32,
    },
}

/// What drives the stages' currents through the wearer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum StageSupply {
    /// One high-voltage supply and one return for all: no two channels may drive in
    /// opposite directions at the same time.
    Common,
    /// Each stage drives either direction whatever the others do: a supply of its own, or
    /// two rails with the return between them.
    Separate,
}

/// Who says what stages there are.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Origin {
    /// Whoever put the board into service.
    Owner,
    /// The session to be played: a simulator's board, made to fit it.
    Session,
}

/// The stages of one board, by channel; `None` where it has none.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct StageTable {
    /// Who says so.
    pub origin: Origin,
    /// How they are supplied. `None` in a table from before this was asked: taken as common.
    pub supply: Option<StageSupply>,
    /// One per channel.
    pub stages: [Option<StageKind>; CHANNELS],
}

/// What a device knows of its stages.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Stages {
    /// A simulator without stages of its own: they are what a setup declares.
    AsDeclared,
    /// What its memory holds.
    Stored(StageTable),
    /// Nothing that can be relied on: nothing can be armed.
    Unknown(StagesFault),
}

/// Why a board does not know its stages. Each is mended by storing the table again.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum StagesFault {
    /// Never written.
    Erased,
    /// The two copies differ, or one is damaged: a writing was cut off.
    HalfWritten,
    /// Both copies are damaged.
    Damaged,
    /// Written by another version of the firmware.
    Version,
    /// Written for a chip with another number.
    OtherBoard,
}

/// Why a declared stage does not fit the board's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum StageMismatch {
    /// The board does not know its stages.
    Unknown(StagesFault),
    /// The board has no stage on this channel.
    NoStage,
    /// A current stage is declared a voltage stage, or the other way round.
    Kind,
    /// The kind is right, its full scale is another.
    FullScale {
        /// The field that says so.
        field: &'static str,
        /// What the board has, µA or mV.
        has: u32,
    },
}

impl StageSpec {
    /// What of it is the board's.
    #[must_use]
    pub const fn kind(&self) -> StageKind {
        match *self {
            Self::Current { full_scale_ua } => StageKind::Current { full_scale_ua },
            Self::Voltage { full_scale_mv, .. } => StageKind::Voltage { full_scale_mv },
        }
    }
}

impl Stages {
    /// Whether channels may drive in opposite directions at the same time: those of a
    /// simulator may, as if each had a supply of its own.
    #[must_use]
    pub const fn may_oppose(&self) -> bool {
        match self {
            Self::AsDeclared | Self::Unknown(_) => true, // nothing is armed of the unknown
            Self::Stored(table) => matches!(table.supply, Some(StageSupply::Separate)),
        }
    }

    /// Holds what is declared for `channel` against what the board has.
    ///
    /// # Errors
    /// How they differ.
    pub fn check(&self, channel: u8, declared: &StageSpec) -> Result<(), StageMismatch> {
        let table = match self {
            Self::AsDeclared => return Ok(()),
            Self::Stored(table) => table,
            Self::Unknown(fault) => return Err(StageMismatch::Unknown(*fault)),
        };
        let stage = table.stages.get(usize::from(channel)).copied().flatten();
        match (stage, declared.kind()) {
            (None, _) => Err(StageMismatch::NoStage),
            (Some(has), declared) if has == declared => Ok(()),
            (Some(StageKind::Current { full_scale_ua: has }), StageKind::Current { .. }) => {
                let field = StageSpec::FULL_SCALE_UA.field;
                Err(StageMismatch::FullScale { field, has })
            }
            (Some(StageKind::Voltage { full_scale_mv: has }), StageKind::Voltage { .. }) => {
                let field = StageSpec::FULL_SCALE_MV.field;
                Err(StageMismatch::FullScale { field, has })
            }
            (Some(_), _) => Err(StageMismatch::Kind),
        }
    }
}

/// A table as it lies in a board's memory, little-endian words: "FXST"; version (upper
/// half), supply (bits 8 to 15) and origin; the chip's number; ten stages; CRC-32 of all
/// before it.
pub type StageWords = [u32; WORDS];

const MAGIC: u32 = u32::from_le_bytes(*b"FXST");
/// Without a supply.
const UNDECLARED_VERSION: u32 = 1;
const VERSION: u32 = 2;
/// Magic, version, three of the chip's number.
const HEAD: usize = 5;
const WORDS: usize = HEAD + CHANNELS + 1;
/// Bits of a stage's word below its kind.
const KIND_SHIFT: u32 = 24;
const ERASED: u32 = u32::MAX;

impl StageTable {
    /// Checks each stage's range.
    ///
    /// # Errors
    /// The first field outside of its range.
    pub fn validate(&self) -> Result<(), OutOfRange> {
        for stage in self.stages.iter().flatten() {
            match *stage {
                StageKind::Current { full_scale_ua } => {
                    StageSpec::FULL_SCALE_UA.check(full_scale_ua)?;
                }
                StageKind::Voltage { full_scale_mv } => {
                    StageSpec::FULL_SCALE_MV.check(full_scale_mv)?;
                }
            }
        }
        Ok(())
    }

    /// As it lies in the memory of the chip with this number.
    #[must_use]
    pub fn words(&self, unique_id: [u32; 3]) -> StageWords {
        let origin = match self.origin {
            Origin::Owner => 0,
            Origin::Session => 1,
        };
        let version = match self.supply {
            None => UNDECLARED_VERSION << 16,
            Some(StageSupply::Common) => VERSION << 16 | 1 << 8,
            Some(StageSupply::Separate) => VERSION << 16 | 2 << 8,
        };
        let [a, b, c] = unique_id;
        let head = [MAGIC, version | origin, a, b, c];
        let stages = self.stages.iter().map(|stage| match *stage {
            None => 0,
            // Full scales are below 2^24.
            Some(StageKind::Current { full_scale_ua }) => 1 << KIND_SHIFT | full_scale_ua,
            Some(StageKind::Voltage { full_scale_mv }) => 2 << KIND_SHIFT | full_scale_mv,
        });
        let mut words = [0; WORDS];
        for (word, value) in words.iter_mut().zip(head.into_iter().chain(stages)) {
            *word = value;
        }
        if let Some((last, rest)) = words.split_last_mut() {
            *last = checksum(rest);
        }
        words
    }

    /// The table in one copy of such words.
    #[inline(never)]
    fn read(words: &StageWords, unique_id: [u32; 3]) -> Result<Self, StagesFault> {
        if words.iter().all(|&word| word == ERASED) {
            return Err(StagesFault::Erased);
        }
        let [magic, version, a, b, c, stages @ .., crc] = words;
        let (_, rest) = words.split_last().ok_or(StagesFault::Damaged)?;
        if *magic != MAGIC || *crc != checksum(rest) {
            return Err(StagesFault::Damaged);
        }
        let supply = match (version >> 16, version >> 8 & 0xFF) {
            (UNDECLARED_VERSION, 0) => None,
            (VERSION, 1) => Some(StageSupply::Common),
            (VERSION, 2) => Some(StageSupply::Separate),
            _ => return Err(StagesFault::Version),
        };
        let origin = match version & 0xFF {
            0 => Origin::Owner,
            1 => Origin::Session,
            _ => return Err(StagesFault::Version),
        };
        if [*a, *b, *c] != unique_id {
            return Err(StagesFault::OtherBoard);
        }
        let mut table = Self {
            origin,
            supply,
            stages: [None; CHANNELS],
        };
        for (stage, word) in table.stages.iter_mut().zip(stages) {
            let full_scale = word & ((1 << KIND_SHIFT) - 1);
            *stage = match word >> KIND_SHIFT {
                0 if *word == 0 => None,
                1 => Some(StageKind::Current {
                    full_scale_ua: full_scale,
                }),
                2 => Some(StageKind::Voltage {
                    full_scale_mv: full_scale,
                }),
                _ => return Err(StagesFault::Damaged),
            };
        }
        table.validate().map_err(|_| StagesFault::Damaged)?;
        Ok(table)
    }
}

impl Stages {
    /// What two copies say. The second is written after the first and means that the
    /// first is whole; so one without the other is a writing that was cut off, after
    /// which nobody knows what stages the board has now.
    #[must_use]
    pub fn stored(copies: [&StageWords; 2], unique_id: [u32; 3]) -> Self {
        match copies.map(|words| StageTable::read(words, unique_id)) {
            [Ok(first), Ok(second)] if first == second => Self::Stored(first),
            [Err(first), Err(second)] if first == second => Self::Unknown(first),
            _ => Self::Unknown(StagesFault::HalfWritten),
        }
    }
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

    const UID: [u32; 3] = [1, 2, 3];
    const AMPS: StageKind = StageKind::Current {
        full_scale_ua: 100_000,
    };
    const VOLTS: StageKind = StageKind::Voltage {
        full_scale_mv: 60_000,
    };

    fn table() -> StageTable {
        let mut stages = [Some(AMPS); CHANNELS];
        (stages[3], stages[9]) = (Some(VOLTS), None);
        StageTable {
            origin: Origin::Owner,
            supply: Some(StageSupply::Common),
            stages,
        }
    }

    fn stored(words: &StageWords) -> Stages {
        Stages::stored([words, words], UID)
    }

    #[test]
    fn a_table_comes_back_from_its_words() {
        for origin in [Origin::Owner, Origin::Session] {
            for supply in [None, Some(StageSupply::Common), Some(StageSupply::Separate)] {
                let table = StageTable {
                    origin,
                    supply,
                    ..table()
                };
                let stages = stored(&table.words(UID));
                assert_eq!(stages, Stages::Stored(table));
                assert_eq!(stages.may_oppose(), supply == Some(StageSupply::Separate));
            }
        }
    }

    /// As firmware wrote it that knew of no supply.
    #[test]
    fn a_table_from_before_declares_no_supply() {
        let mut words = table().words(UID);
        words[1] = 1 << 16 | 1;
        words[WORDS - 1] = checksum(&words[..WORDS - 1]);
        let before = StageTable {
            origin: Origin::Session,
            supply: None,
            ..table()
        };
        assert_eq!(stored(&words), Stages::Stored(before));
        assert!(!stored(&words).may_oppose());
    }

    #[test]
    fn every_flipped_bit_makes_the_stages_unknown() {
        let whole = table().words(UID);
        for bit in 0..32 * WORDS {
            let mut flipped = whole;
            flipped[bit / 32] ^= 1 << (bit % 32);
            let half = Stages::Unknown(StagesFault::HalfWritten);
            assert_eq!(Stages::stored([&flipped, &whole], UID), half, "bit {bit}");
            assert_eq!(Stages::stored([&whole, &flipped], UID), half, "bit {bit}");
            let damaged = Stages::Unknown(StagesFault::Damaged);
            assert_eq!(stored(&flipped), damaged, "bit {bit}");
        }
    }

    #[test]
    fn what_is_no_table_of_this_board_is_told_apart() {
        let (whole, erased) = (table().words(UID), [ERASED; WORDS]);
        let unknown = |fault| Stages::Unknown(fault);
        assert_eq!(stored(&erased), unknown(StagesFault::Erased));
        let half = unknown(StagesFault::HalfWritten);
        assert_eq!(Stages::stored([&whole, &erased], UID), half);
        assert_eq!(Stages::stored([&erased, &whole], UID), half);
        let mut other = table();
        other.stages[0] = Some(VOLTS);
        assert_eq!(Stages::stored([&whole, &other.words(UID)], UID), half);
        assert_eq!(
            Stages::stored([&whole, &whole], [1, 2, 4]),
            unknown(StagesFault::OtherBoard)
        );
        for version in [
            3 << 16 | 1 << 8,
            2 << 16,
            2 << 16 | 3 << 8,
            1 << 16 | 1 << 8,
        ] {
            let mut later = whole;
            later[1] = version;
            later[WORDS - 1] = checksum(&later[..WORDS - 1]);
            let found = stored(&later);
            assert_eq!(found, unknown(StagesFault::Version), "{version:#x}");
        }
        // A right sum over a stage that cannot be.
        let mut wild = whole;
        wild[HEAD] = 1 << KIND_SHIFT | 999;
        wild[WORDS - 1] = checksum(&wild[..WORDS - 1]);
        assert_eq!(stored(&wild), unknown(StagesFault::Damaged));
    }

    /// Another table is stored over this one as the board does it, copy after copy, erased
    /// and then word by word, and the power fails at each step and within it: a sector
    /// half erased has ones for zeros, a word half programmed has not all its zeros.
    #[test]
    fn power_that_fails_at_any_step_of_a_writing_leaves_no_third_table() {
        let mut other = table();
        other.stages[0] = Some(VOLTS);
        let (old, new) = (table().words(UID), other.words(UID));
        let mut random = 2_020u32;
        let mut some_ones = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            random.rotate_left(16)
        };
        let (mut copies, mut steps) = ([old; 2], 0);
        let mut fails = |copies: [&StageWords; 2]| {
            steps += 1;
            match Stages::stored(copies, UID) {
                Stages::Unknown(_) => {}
                Stages::Stored(it) if it == table() => assert_eq!(copies, [&old; 2]),
                Stages::Stored(it) if it == other => assert_eq!(copies, [&new; 2]),
                third => panic!("{third:?} of {copies:x?}"),
            }
        };
        for copy in 0..2 {
            let mut within = |copies: &[StageWords; 2], words: StageWords| {
                let mut copies = *copies;
                copies[copy] = words;
                fails(copies.each_ref());
            };
            for _ in 0..500 {
                let ones = some_ones();
                within(&copies, copies[copy].map(|word| word | ones));
            }
            copies[copy] = [ERASED; WORDS];
            within(&copies, copies[copy]);
            for (at, word) in new.into_iter().enumerate() {
                for _ in 0..100 {
                    let mut words = copies[copy];
                    words[at] = word | some_ones();
                    within(&copies, words);
                }
                copies[copy][at] = word;
                within(&copies, copies[copy]);
            }
        }
        assert_eq!(copies, [new; 2]);
        assert_eq!(steps, 2 * (500 + 1 + 101 * WORDS));
    }

    #[test]
    fn a_false_declaration_is_named() {
        let stages = Stages::Stored(table());
        let amps = |full_scale_ua| StageSpec::Current { full_scale_ua };
        let volts = |full_scale_mv| StageSpec::Voltage {
            full_scale_mv,
            load_ohm: 2_000,
        };
        assert_eq!(stages.check(0, &amps(100_000)), Ok(()));
        assert_eq!(stages.check(3, &volts(60_000)), Ok(()));
        assert_eq!(stages.check(0, &volts(60_000)), Err(StageMismatch::Kind));
        assert_eq!(stages.check(3, &amps(100_000)), Err(StageMismatch::Kind));
        let (field, has) = ("full_scale_ua", 100_000);
        assert_eq!(
            stages.check(0, &amps(50_000)),
            Err(StageMismatch::FullScale { field, has })
        );
        assert_eq!(stages.check(9, &amps(1_000)), Err(StageMismatch::NoStage));
        assert_eq!(Stages::AsDeclared.check(9, &amps(1_000)), Ok(()));
        let unknown = Stages::Unknown(StagesFault::Erased);
        let refused = StageMismatch::Unknown(StagesFault::Erased);
        assert_eq!(unknown.check(0, &amps(100_000)), Err(refused));
    }
}
