//! Why an arm, a posture or a wrench is refused.

use super::{AXIS_NAMES, CHANNEL};
use crate::range::OutOfRange;
use core::fmt;

/// Why a [`super::LimbSpec`] is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LimbError {
    /// A bone.
    Way {
        /// 0 thorax to SC … 3 EL to hand.
        way: u8,
        /// Its field.
        range: OutOfRange,
    },
    /// The range of an axis.
    Axis {
        /// 0…8.
        axis: u8,
        /// Its field.
        range: OutOfRange,
    },
    /// How many lines there are.
    Lines(OutOfRange),
    /// A line of action.
    Line {
        /// Its place in the list.
        line: u8,
        /// Its field.
        range: OutOfRange,
    },
    /// A line names a channel that an earlier one has.
    ChannelTwice {
        /// The later line's place.
        line: u8,
        /// That channel.
        channel: u8,
    },
}

impl LimbError {
    /// The field, its value and what it may be.
    #[must_use]
    pub const fn out_of_range(self) -> OutOfRange {
        match self {
            Self::Way { range, .. } | Self::Axis { range, .. } | Self::Line { range, .. } => range,
            Self::Lines(range) => range,
            Self::ChannelTwice { channel, .. } => OutOfRange {
                field: CHANNEL.field,
                value: channel as i64,
                min: CHANNEL.min,
                max: CHANNEL.max,
            },
        }
    }
}

impl fmt::Display for LimbError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Way { way, range } => write!(f, "way {way}: {range}"),
            Self::Axis { axis, range } => write!(f, "axis {axis}: {range}"),
            Self::Lines(range) => range.fmt(f),
            Self::Line { line, range } => write!(f, "line {line}: {range}"),
            Self::ChannelTwice { line, channel } => {
                write!(f, "line {line}: channel {channel} has a line already")
            }
        }
    }
}

impl core::error::Error for LimbError {}

/// A posture outside the wearer's range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PostureError {
    /// The first axis, 0…8.
    pub axis: u8,
    /// Its angle, m°.
    pub mdeg: i32,
    /// Lowest allowed.
    pub low_mdeg: i32,
    /// Highest allowed.
    pub high_mdeg: i32,
}

impl PostureError {
    /// The axis by its name, m°, and what it may be.
    #[must_use]
    pub fn out_of_range(self) -> OutOfRange {
        let names = &AXIS_NAMES;
        OutOfRange {
            field: names
                .get(usize::from(self.axis))
                .copied()
                .unwrap_or_default(),
            value: self.mdeg.into(),
            min: self.low_mdeg,
            max: self.high_mdeg,
        }
    }
}

impl fmt::Display for PostureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            axis,
            mdeg,
            low_mdeg,
            high_mdeg,
        } = self;
        write!(
            f,
            "axis {axis} = {mdeg} is outside {low_mdeg}..={high_mdeg}"
        )
    }
}

impl core::error::Error for PostureError {}

/// A wrench that cannot be made.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum ReachError<N> {
    /// No line helps at any joint.
    NoMuscleHelps,
    /// A line would have to be stronger than its wearer's limit lets it be.
    TooStrong {
        /// The line that is asked for the most beyond its limit.
        line: u8,
        /// The share of the wrench that can be made: that much of it, in the same
        /// direction, is the nearest. 0…1.
        share: N,
    },
}
