//! The output stages that a board has. The board keeps this table in its own memory, and a host's
//! configuration is compared with it.
//!
//! A host that configures 60 V on a stage of 100 mA would arm, and drive three times the current
//! it asked for: no measurement before the first pulse can reveal this. So the board identifies
//! its stages, and a setup that differs is refused with the differing field.

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
    /// Current-controlled stage.
    Current {
        /// Current at DAC code 65 535, 1000–100 000 µA.
        full_scale_ua: u32,
    },
    /// Voltage-controlled stage.
    Voltage {
        /// Voltage at DAC code 65 535, 1000–150 000 mV.
        full_scale_mv: u32,
    },
}

/// The supply that drives the stages' currents through the wearer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum StageSupply {
    /// One high-voltage supply and one return for all stages: no two channels may drive in
    /// opposite directions at the same time.
    Common,
    /// Each stage drives either direction independently of the others: it has its own supply, or
    /// two rails with the return between them.
    Separate,
}

/// Source of a stage table.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Origin {
    /// The person who put the board into service.
    Owner,
    /// The session that will be played: a simulated board is made to fit it.
    Session,
}

/// The stages of one board, by channel.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct StageTable {
    /// Whether the owner or a session determined the stages.
    pub origin: Origin,
    /// Supply of the stages. `None` in a table from before this field existed, which counts as
    /// common.
    pub supply: Option<StageSupply>,
    /// Stage of each channel; `None` where the board has none.
    pub stages: [Option<StageKind>; CHANNELS],
}

/// A device's knowledge of its output stages.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Stages {
    /// A simulator without stages of its own: it accepts the stages that a setup configures.
    AsConfigured,
    /// The table in the board's memory.
    Stored(StageTable),
    /// No reliable table, so that nothing can be armed.
    Unknown(StagesFault),
    /// Simulated stages of a breadboard, on the channels whose lines the board has: they accept
    /// kind and full scale that a setup configures.
    Simulated {
        /// Bit i is set if the board has the lines of channel i, counted from 0.
        channels: u16,
    },
}

/// The reason why a board does not know its stages. Storing the table again solves each of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum StagesFault {
    /// The table was never written.
    Erased,
    /// The two copies differ, or one is damaged: a write was interrupted.
    Incomplete,
    /// Both copies are damaged.
    Damaged,
    /// Another version of the firmware wrote the table.
    Version,
    /// The table was written for a chip with another unique number.
    OtherBoard,
}

/// The reason why a configured stage does not fit the board's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum StageMismatch {
    /// The board does not know its stages.
    Unknown(StagesFault),
    /// The board has no stage on this channel.
    NoStage,
    /// A current stage is configured as a voltage stage, or the other way round.
    Kind,
    /// The kind is right, but the full scale differs.
    FullScale {
        /// Name of the field with the full scale.
        field: &'static str,
        /// Full scale of the board's stage, µA or mV.
        has: u32,
    },
}

impl StageSpec {
    /// Returns kind and full scale, without the load, which is not a property of the board.
    #[must_use]
    pub const fn kind(&self) -> StageKind {
        match *self {
            Self::Current { full_scale_ua } => StageKind::Current { full_scale_ua },
            Self::Voltage { full_scale_mv, .. } => StageKind::Voltage { full_scale_mv },
        }
    }
}

impl Stages {
    /// Returns whether channels may drive in opposite directions at the same time. Channels of a
    /// simulator that accepts any stage may, as if each had its own supply.
    #[must_use]
    pub const fn may_oppose(&self) -> bool {
        match self {
            // Nothing is armed of the unknown.
            Self::AsConfigured | Self::Unknown(_) | Self::Simulated { .. } => true,
            Self::Stored(table) => matches!(table.supply, Some(StageSupply::Separate)),
        }
    }

    /// Compares the configured stage of `channel` with the board's.
    ///
    /// # Errors
    /// Returns how the two differ.
    pub fn check(&self, channel: u8, declared: &StageSpec) -> Result<(), StageMismatch> {
        let table = match self {
            Self::AsConfigured => return Ok(()),
            Self::Simulated { channels } => {
                let bit = 1_u16.checked_shl(channel.into()).unwrap_or(0);
                let has = channels & bit != 0;
                return if has {
                    Ok(())
                } else {
                    Err(StageMismatch::NoStage)
                };
            }
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

/// A table as stored in a board's memory, in little-endian words: "FXST"; version (upper half),
/// supply (bits 8 to 15) and origin; the chip's unique number; ten stages; CRC-32 of all words
/// before it.
pub type StageWords = [u32; WORDS];

const MAGIC: u32 = u32::from_le_bytes(*b"FXST");
/// Version of a table without a supply.
const UNDECLARED_VERSION: u32 = 1;
const VERSION: u32 = 2;
/// Number of words before the stages: magic, version, three of the chip's unique number.
const HEAD: usize = 5;
const WORDS: usize = HEAD + CHANNELS + 1;
/// Position of the kind in a stage's word; the bits below hold the full scale.
const KIND_SHIFT: u32 = 24;
const ERASED: u32 = u32::MAX;

impl StageTable {
    /// Checks that the full scale of each stage is within its range.
    ///
    /// # Errors
    /// Returns the first field outside its range.
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

    /// Encodes the table for the memory of the chip with this unique number.
    #[must_use]
    pub fn to_words(&self, unique_id: [u32; 3]) -> StageWords {
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

    /// Decodes one copy of the table.
    #[inline(never)]
    fn from_words(words: &StageWords, unique_id: [u32; 3]) -> Result<Self, StagesFault> {
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
    /// Returns the stages that two copies store. The second copy is written after the first and
    /// means that the first is complete. One copy without the other is an interrupted write, after
    /// which the board's present stages are unknown.
    #[must_use]
    pub fn from_copies(copies: [&StageWords; 2], unique_id: [u32; 3]) -> Self {
        match copies.map(|words| StageTable::from_words(words, unique_id)) {
            [Ok(first), Ok(second)] if first == second => Self::Stored(first),
            [Err(first), Err(second)] if first == second => Self::Unknown(first),
            _ => Self::Unknown(StagesFault::Incomplete),
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
