//! What a host says about a wall, and the checks it must pass once.

use crate::control::SensorSource;
use crate::control::differentiator::Differentiator;
use crate::control::refusal::{AMPLITUDE_MAX, ANGLE_MIN_MDEG, CHANNEL, check_angles};
use crate::range::{OutOfRange, Range};
use crate::units::Amplitude;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A virtual wall as it travels on the wire, unvalidated. Integers only.
///
/// Harris et al. (ASME DSCC 2017): the muscle that pulls the limb back out is
/// stimulated with an amplitude proportional to penetration (equation 1), after
/// a ramp over a pre-wall in front of the wall, while its antagonist is held at
/// a constant amplitude inside the wall (equation 2).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct WallSpec {
    /// Where the wall stands, m°; within `angle_min_mdeg`…`angle_max_mdeg`.
    pub at_mdeg: i32,
    /// On which side of it the limb is inside.
    pub side: Side,
    /// Channel of the muscle that pulls out of the wall, 0…9.
    pub channel: u8,
    /// Highest amplitude on that channel, µA or mV; 1…200 000 and at most the
    /// channel's limit.
    pub max: Amplitude,
    /// Amplitude per degree of penetration, µA or mV per degree; 1…200 000.
    pub stiffness: u32,
    /// Amplitude per rate of penetration, µA·s or mV·s per degree; 0…20 000.
    /// The paper has none (0). It adds while the limb goes in and takes away
    /// while it comes out, never below zero; docs/maps/wall.txt shows what it
    /// does for stability.
    pub damping: u32,
    /// Cutoff of the differentiator behind `damping`, mHz; 500…20 000.
    pub cutoff_mhz: u32,
    /// The ramp in front of the wall, if there is one.
    pub pre_wall: Option<PreWall>,
    /// What the antagonist does inside the wall, if it does anything.
    pub co_contraction: Option<CoContraction>,
    /// Lowest angle of the joint, m°; −180 000…179 999.
    pub angle_min_mdeg: i32,
    /// Highest angle of the joint, m°; above the lowest, to 180 000.
    pub angle_max_mdeg: i32,
    /// Where the angle is measured.
    pub sensor: SensorSource,
    /// Age at which the last measurement is stale, ms; 2…500.
    pub stale_after_ms: u16,
}

/// On which side of a wall's angle the limb is inside it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Side {
    /// At larger angles: the wall stops flexion, an extensor pulls out.
    Flexion,
    /// At smaller angles: the wall stops extension, a flexor pulls out.
    Extension,
}

/// A ramp of amplitude in front of a wall, which primes the muscle.
///
/// The amplitude rises linearly from `begin` to `end` over the pre-wall, and
/// from `end` on with the wall's stiffness. In the paper `begin` is noticeable
/// but hardly moves the limb and `end` is the wall's maximum: everything is
/// reached at the wall itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct PreWall {
    /// How far in front of the wall it begins, m°; 100…45 000. The paper's: 9000.
    pub depth_mdeg: u32,
    /// Amplitude where it begins, µA or mV; 0…`end`.
    pub begin: Amplitude,
    /// Amplitude at the wall, µA or mV; 0…the wall's `max`.
    pub end: Amplitude,
}

impl PreWall {
    /// Of [`Self::depth_mdeg`]: at most half a right angle, five times the paper's.
    pub const DEPTH_MDEG: Range = Range::new("depth_mdeg", 100, 45_000);
    /// Of [`Self::begin`], before the highest end.
    pub const BEGIN: Range = Range::new("begin", 0, AMPLITUDE_MAX);
    /// Of [`Self::end`], in the strongest wall.
    pub const END: Range = Range::new("end", 0, AMPLITUDE_MAX);
}

/// A constant amplitude of the antagonist inside the wall.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct CoContraction {
    /// The antagonist's channel, 0…9; not the wall's own.
    pub channel: u8,
    /// Its amplitude, µA or mV; 1…200 000 and at most the channel's limit.
    pub amplitude: Amplitude,
}

impl CoContraction {
    /// Of [`Self::amplitude`].
    pub const AMPLITUDE: Range = Range::new("amplitude", 1, AMPLITUDE_MAX);
}

/// Why a [`WallSpec`] was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WallError {
    /// A field is outside what is allowed, given the fields before it.
    Range(OutOfRange),
    /// Wall and co-contraction name the same channel.
    ChannelTwice {
        /// That channel.
        channel: u8,
    },
}

impl From<OutOfRange> for WallError {
    fn from(e: OutOfRange) -> Self {
        Self::Range(e)
    }
}

impl WallSpec {
    /// Of [`Self::at_mdeg`], within the widest angles.
    pub const AT_MDEG: Range = Range::new("at_mdeg", ANGLE_MIN_MDEG.min, ANGLE_MIN_MDEG.max);
    /// Of [`Self::channel`] and of [`CoContraction::channel`].
    pub const CHANNEL: Range = CHANNEL;
    /// Of [`Self::max`].
    pub const MAX: Range = Range::new("max", 1, AMPLITUDE_MAX);
    /// Of [`Self::stiffness`]: at most the whole of an amplitude in a degree.
    pub const STIFFNESS: Range = Range::new("stiffness", 1, AMPLITUDE_MAX);
    /// Of [`Self::damping`]: at most all of an amplitude at 10 °/s, slower than any
    /// approach worth damping.
    pub const DAMPING: Range = Range::new("damping", 0, 20_000);
    /// Of [`Self::cutoff_mhz`].
    pub const CUTOFF_MHZ: Range = Differentiator::CUTOFF_MHZ;

    /// Checks everything but the sensor.
    pub(super) fn check(&self) -> Result<(), WallError> {
        check_angles(self.angle_min_mdeg, self.angle_max_mdeg)?;
        let within_angles = Range {
            min: self.angle_min_mdeg,
            max: self.angle_max_mdeg,
            ..Self::AT_MDEG
        };
        within_angles.check(self.at_mdeg)?;
        Self::CHANNEL.check(self.channel)?;
        Self::MAX.check(self.max.get())?;
        Self::STIFFNESS.check(self.stiffness)?;
        Self::DAMPING.check(self.damping)?;
        Self::CUTOFF_MHZ.check(self.cutoff_mhz)?;
        if let Some(pre) = self.pre_wall {
            PreWall::DEPTH_MDEG.check(pre.depth_mdeg)?;
            PreWall::END.up_to(self.max.get()).check(pre.end.get())?;
            PreWall::BEGIN.up_to(pre.end.get()).check(pre.begin.get())?;
        }
        if let Some(other) = self.co_contraction {
            Self::CHANNEL.check(other.channel)?;
            CoContraction::AMPLITUDE.check(other.amplitude.get())?;
            if other.channel == self.channel {
                let channel = other.channel;
                return Err(WallError::ChannelTwice { channel });
            }
        }
        Ok(())
    }

    /// What it may ask for, by channel: the wall's own and its antagonist's.
    pub fn demands(&self) -> impl Iterator<Item = (u8, Amplitude, &'static str)> {
        let own = (self.channel, self.max, "max");
        let other = self
            .co_contraction
            .map(|c| (c.channel, c.amplitude, "amplitude"));
        core::iter::once(own).chain(other)
    }
}
