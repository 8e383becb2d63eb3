//! A session's configuration, checked as a whole before arming.

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

/// The reason why a setup cannot be armed. Channels count from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SetupError {
    /// A field is outside its range.
    Range(OutOfRange),
    /// The train cannot be played.
    Train(TrainError),
    /// The groups contradict their channels or trains.
    Group(GroupError),
    /// The board has another output stage than the configured one.
    Stage(StageMismatch),
    /// At its limit the channel would exceed a current limit.
    Current {
        /// The largest allowed current.
        max: MicroAmps,
    },
    /// At its limit one phase would exceed the charge limit.
    Charge {
        /// The largest allowed charge of one phase, nC.
        max_nc: u32,
    },
    /// At its limit the channel would exceed the rms limit; every pulse of a burst counts.
    Rms {
        /// The largest allowed rms current.
        max: MicroAmps,
    },
    /// At its limit the channel would exceed the limit of rms current density under its electrode.
    Density {
        /// The largest allowed rms current for the electrode's area.
        max: MicroAmps,
    },
    /// With all channels at their limits, the common return would carry too much current.
    Sum(SumError),
    /// Two channels can drive in opposite directions at the same time, but the board's stages
    /// share one supply, or the stage table does not say which supply they have.
    Opposed {
        /// The lower of the two channels, from 0.
        channel: u8,
        /// The other channel, from 0.
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

/// A complete setup that satisfies every limit and rule.
#[derive(Clone, Debug)]
pub struct Setup {
    /// The wearer's limits.
    pub wearer: Wearer,
    /// Configured channels; `None` for unused ones.
    pub channels: [Option<Channel>; CHANNELS],
    /// Largest currents through the common return, with each channel at its limit.
    pub sums: Sums,
    /// Groups of channels that share a muscle.
    pub groups: Vec<Group, MAX_GROUPS>,
    /// The channel that drives the sync output, from 0; `None` leaves the output low.
    pub sync: Option<u8>,
    /// Channels that a joint, a wall or another controller drives, bit i for channel i; a host may
    /// not set their amplitudes.
    pub controlled: u16,
}

impl Setup {
    /// Returns a configured channel; `None` if `channel` is unused.
    #[must_use]
    pub fn channel(&self, channel: u8) -> Option<&Channel> {
        self.channels.get(usize::from(channel))?.as_ref()
    }

    /// Returns the validated train of each channel; `None` for unused channels.
    #[must_use]
    pub fn trains(&self) -> [Option<Train>; CHANNELS] {
        self.channels.map(|c| c.map(|c| c.train))
    }
}

/// Checks a group against the channels it joins and their trains.
///
/// # Errors
/// Returns the first rule that the group breaks: one of its trains', or that the rate of an
/// isolated group's member must be fixed.
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
