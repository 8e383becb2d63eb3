//! Which output stages a board has: its own word, kept in its memory, against which
//! what a host declares is held.
//!
//! A host that declares 60 V on a stage of 100 mA would arm, and drive three times
//! the current it asked for: no measurement below the first pulse can tell. So a
//! board says what it is, and a setup that says otherwise is refused by name.

#[cfg(test)]
mod tests;

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
