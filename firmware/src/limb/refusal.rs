//! Reasons why an arm, a posture or a wrench is refused.

use super::{AXIS_NAMES, CHANNEL};
use crate::range::OutOfRange;
use core::fmt;

/// Reason why a [`super::LimbSpec`] is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LimbError {
    /// A segment vector is out of range or too short.
    Way {
        /// Index of the vector, from 0 (thorax to SC) to 3 (EL to hand).
        way: u8,
        /// Field, value and allowed range.
        range: OutOfRange,
    },
    /// The range of an axis's angle is not allowed.
    Axis {
        /// Number of the axis, 0…8.
        axis: u8,
        /// Field, value and allowed range.
        range: OutOfRange,
    },
    /// The number of lines is out of range.
    Lines(OutOfRange),
    /// A field of a line of action is out of range.
    Line {
        /// Index of the line in the list.
        line: u8,
        /// Field, value and allowed range.
        range: OutOfRange,
    },
    /// A line uses the channel of an earlier line.
    ChannelTwice {
        /// Index of the later line.
        line: u8,
        /// Number of the channel, 0…9.
        channel: u8,
    },
}

impl LimbError {
    /// Returns the offending field, its value and its range.
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
                write!(f, "line {line}: channel {channel} already has a line")
            }
        }
    }
}

impl core::error::Error for LimbError {}

/// A posture outside the wearer's range.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PostureError {
    /// Number of the first offending axis, 0…8.
    pub axis: u8,
    /// Angle of the axis, m°.
    pub mdeg: i32,
    /// Lowest angle allowed, m°.
    pub low_mdeg: i32,
    /// Highest angle allowed, m°.
    pub high_mdeg: i32,
}

impl PostureError {
    /// Returns the name of the axis, its angle in m°, and its range.
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
            "axis {axis} is at {mdeg} m°; allowed: {low_mdeg} to {high_mdeg} m°"
        )
    }
}

impl core::error::Error for PostureError {}

/// Reason why a wrench is not possible.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum ReachError<N> {
    /// No line can contribute at any joint.
    NoMuscleHelps,
    /// A line would have to exceed its wearer's limit.
    TooStrong {
        /// Index of the line that would exceed its limit by most.
        line: u8,
        /// Share of the wrench that is possible, 0…1. That share, in the same direction, is the
        /// nearest possible wrench.
        share: N,
    },
}
