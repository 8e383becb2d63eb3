//! Everything a session configures, checked as a whole before arming.

mod channel;
#[cfg(test)]
pub(super) mod tests;

pub use channel::{Channel, ChannelSpec};

use super::{StageMismatch, SumError, Sums, Wearer};
use crate::pulse::{
    CHANNELS, Group, GroupError, GroupSpec, MAX_GROUPS, Partner, Train, TrainError,
};
use crate::range::OutOfRange;
use crate::units::MicroAmps;
use heapless::Vec;

/// Why a setup cannot be armed. `channel` is counted from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SetupError {
    /// A field outside its range.
    Range(OutOfRange),
    /// The train cannot be played.
    Train(TrainError),
    /// The groups cannot be kept.
    Group(GroupError),
    /// The board has another stage than is declared.
    Stage(StageMismatch),
    /// At its limit the channel would exceed a current limit; the largest
    /// allowed current is `max`.
    Current {
        /// That current.
        max: MicroAmps,
    },
    /// At its limit one phase would exceed the charge limit.
    Charge {
        /// nC.
        max_nc: u32,
    },
    /// At its limit the channel would exceed the rms limit; every pulse of a
    /// burst counts.
    Rms {
        /// That limit.
        max: MicroAmps,
    },
    /// At its limit the channel would exceed the rms current density under its
    /// electrode.
    Density {
        /// Largest rms current at that area.
        max: MicroAmps,
    },
    /// With all channels at their limits, the common return would carry too much.
    Sum(SumError),
    /// Two channels can drive in opposite directions at the same time, and the board's
    /// stages have one supply, or do not say which.
    Opposed {
        /// One.
        channel: u8,
        /// The other.
        other: u8,
    },
}

impl From<StageMismatch> for SetupError {
    fn from(e: StageMismatch) -> Self {
        Self::Stage(e)
    }
}

impl From<OutOfRange> for SetupError {
    fn from(e: OutOfRange) -> Self {
        Self::Range(e)
    }
}

/// A complete setup that keeps every limit and rule.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The wearer's limits.
    pub wearer: Wearer,
    /// Configured channels.
    pub channels: [Option<Channel>; CHANNELS],
    /// What they come to at the common return, each at its limit.
    pub sums: Sums,
    /// Groups of channels.
    pub groups: Vec<Group, MAX_GROUPS>,
    /// The channel that drives sync out.
    pub sync: Option<u8>,
    /// Channels that a joint, a wall or force control drives; a host may not.
    pub controlled: u16,
}

impl Setup {
    /// A configured channel.
    #[must_use]
    pub fn channel(&self, channel: u8) -> Option<&Channel> {
        self.channels.get(usize::from(channel))?.as_ref()
    }

    /// The trains, by channel.
    #[must_use]
    pub fn trains(&self) -> [Option<Train>; CHANNELS] {
        self.channels.map(|c| c.map(|c| c.train))
    }
}

/// Checks a group against the channels it joins and their trains.
///
/// # Errors
/// The first rule between them that it breaks: its trains', or that the rate of an
/// isolated group's member may change.
pub fn check_group(
    spec: &GroupSpec,
    channels: &[Option<Channel>; CHANNELS],
    trains: &[Option<Train>; CHANNELS],
) -> Result<Group, GroupError> {
    let group = spec.check(trains)?;
    let changes = |c: &Channel| c.min_period_us != c.max_period_us || c.train.spec().lists;
    let mut members = (0u8..)
        .zip(channels)
        .filter(|(c, _)| spec.members & 1 << c != 0); // c <= 9
    let changing = members.find(|(_, channel)| channel.as_ref().is_some_and(changes));
    match (spec.partner, changing) {
        (Partner::Isolated, Some((channel, _))) => Err(GroupError::RateChanges { channel }),
        _ => Ok(group),
    }
}
