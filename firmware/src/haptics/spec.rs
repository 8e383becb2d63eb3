//! The specification of a virtual wall that a host sends, and its validation.

use crate::control::SensorSource;
use crate::control::differentiator::Differentiator;
use crate::control::refusal::{AMPLITUDE_MAX, ANGLE_MIN_MDEG, CHANNEL, check_angles};
use crate::range::{OutOfRange, Range};
use crate::units::Amplitude;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A virtual wall as encoded in messages, not yet validated. All fields are integers.
///
/// Harris et al. (ASME DSCC 2017): the muscle that pulls the limb back out is stimulated with an
/// amplitude proportional to penetration (equation 1), after a ramp over a pre-wall in front of the
/// wall. Inside the wall, its antagonist is stimulated with a constant amplitude (equation 2).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct WallSpec {
    /// Angle of the wall, m°; within `angle_min_mdeg`…`angle_max_mdeg`.
    pub at_mdeg: i32,
    /// Side of the wall's angle on which the limb is inside the wall.
    pub side: Side,
    /// Channel of the muscle that pulls the limb out of the wall, 0…9.
    pub channel: u8,
    /// Highest amplitude on that channel, µA or mV; 1…200 000 and at most the
    /// channel's limit.
    pub max: Amplitude,
    /// Amplitude per degree of penetration, µA or mV per degree; 1…200 000.
    pub stiffness: u32,
    /// Amplitude per rate of penetration, µA·s or mV·s per degree; 0…20 000.
    ///
    /// Damping raises the amplitude while the limb moves in and lowers it, to zero at
    /// least, while the limb moves out. The paper uses no damping (0).
    /// docs/maps/wall.txt shows the effect on stability.
    pub damping: u32,
    /// Cutoff frequency of the differentiator that computes the rate for `damping`, mHz;
    /// 500…20 000.
    pub cutoff_mhz: u32,
    /// Optional ramp of the amplitude in front of the wall.
    pub pre_wall: Option<PreWall>,
    /// Optional stimulation of the antagonist inside the wall.
    pub co_contraction: Option<CoContraction>,
    /// Lowest angle of the joint, m°; −180 000…179 999.
    pub angle_min_mdeg: i32,
    /// Highest angle of the joint, m°; greater than the lowest, at most 180 000.
    pub angle_max_mdeg: i32,
    /// Source of the angle measurements.
    pub sensor: SensorSource,
    /// Age beyond which the latest measurement is stale, ms; 2…500.
    pub stale_after_ms: u16,
}

/// The side of a wall's angle on which the limb is inside the wall.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum Side {
    /// Inside at larger angles: the wall stops flexion, and an extensor pulls the limb out.
    Flexion,
    /// Inside at smaller angles: the wall stops extension, and a flexor pulls the limb out.
    Extension,
}

/// A ramp of amplitude in front of a wall, which primes the muscle.
///
/// The amplitude rises linearly from `begin` to `end` over the pre-wall. Inside the wall
/// it rises further from `end` with the wall's stiffness. In the paper, `begin` is noticeable
/// but hardly moves the limb, and `end` is the wall's maximum, so the full amplitude is
/// reached at the wall itself.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct PreWall {
    /// Distance from the wall at which the ramp begins, m°; 100…45 000. The paper uses 9000.
    pub depth_mdeg: u32,
    /// Amplitude at the beginning of the ramp, µA or mV; 0…`end`.
    pub begin: Amplitude,
    /// Amplitude at the wall, µA or mV; 0…the wall's `max`.
    pub end: Amplitude,
}

impl PreWall {
    /// Range of [`Self::depth_mdeg`]: up to half a right angle, five times the paper's value.
    pub const DEPTH_MDEG: Range = Range::new("depth_mdeg", 100, 45_000);
    /// Range of [`Self::begin`], µA or mV, for a ramp with the highest possible end.
    pub const BEGIN: Range = Range::new("begin", 0, AMPLITUDE_MAX);
    /// Range of [`Self::end`], µA or mV, for a wall with the highest possible maximum.
    pub const END: Range = Range::new("end", 0, AMPLITUDE_MAX);
}

/// Stimulation of the antagonist with a constant amplitude while the limb is inside the wall.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct CoContraction {
    /// Channel of the antagonist, 0…9; it must differ from the wall's channel.
    pub channel: u8,
    /// Amplitude of the antagonist, µA or mV; 1…200 000 and at most the channel's limit.
    pub amplitude: Amplitude,
}

impl CoContraction {
    /// Range of [`Self::amplitude`], µA or mV.
    pub const AMPLITUDE: Range = Range::new("amplitude", 1, AMPLITUDE_MAX);
}

/// Reason why a [`WallSpec`] was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WallError {
    /// A field is outside its range, which may depend on fields that are checked before it.
    Range(OutOfRange),
    /// The wall and its co-contraction use the same channel.
    ChannelTwice {
        /// The channel that both use, 0…9.
        channel: u8,
    },
}

impl From<OutOfRange> for WallError {
    fn from(error: OutOfRange) -> Self {
        Self::Range(error)
    }
}

impl WallSpec {
    /// Range of [`Self::at_mdeg`], m°, for a joint with the widest possible range of angles.
    pub const AT_MDEG: Range = Range::new("at_mdeg", ANGLE_MIN_MDEG.min, ANGLE_MIN_MDEG.max);
    /// Range of [`Self::channel`] and of [`CoContraction::channel`].
    pub const CHANNEL: Range = CHANNEL;
    /// Range of [`Self::max`], µA or mV.
    pub const MAX: Range = Range::new("max", 1, AMPLITUDE_MAX);
    /// Range of [`Self::stiffness`]: up to the highest amplitude within one degree.
    pub const STIFFNESS: Range = Range::new("stiffness", 1, AMPLITUDE_MAX);
    /// Range of [`Self::damping`]: up to the highest amplitude at 10 °/s, which is slower than
    /// any approach that needs damping.
    pub const DAMPING: Range = Range::new("damping", 0, 20_000);
    /// Range of [`Self::cutoff_mhz`], mHz.
    pub const CUTOFF_MHZ: Range = Differentiator::CUTOFF_MHZ;

    /// Checks all fields except those of the sensor.
    pub(super) fn check(&self) -> Result<(), WallError> {
        check_angles(self.angle_min_mdeg, self.angle_max_mdeg)?;
        let at_range = Range {
            min: self.angle_min_mdeg,
            max: self.angle_max_mdeg,
            ..Self::AT_MDEG
        };
        at_range.check(self.at_mdeg)?;
        Self::CHANNEL.check(self.channel)?;
        Self::MAX.check(self.max.get())?;
        Self::STIFFNESS.check(self.stiffness)?;
        Self::DAMPING.check(self.damping)?;
        Self::CUTOFF_MHZ.check(self.cutoff_mhz)?;
        if let Some(pre_wall) = self.pre_wall {
            PreWall::DEPTH_MDEG.check(pre_wall.depth_mdeg)?;
            PreWall::END
                .with_max_at_most(self.max.get())
                .check(pre_wall.end.get())?;
            PreWall::BEGIN
                .with_max_at_most(pre_wall.end.get())
                .check(pre_wall.begin.get())?;
        }
        if let Some(antagonist) = self.co_contraction {
            Self::CHANNEL.check(antagonist.channel)?;
            CoContraction::AMPLITUDE.check(antagonist.amplitude.get())?;
            if antagonist.channel == self.channel {
                let channel = antagonist.channel;
                return Err(WallError::ChannelTwice { channel });
            }
        }
        Ok(())
    }

    /// Returns the highest amplitude that the wall may request on each of its channels: its
    /// own and, with co-contraction, the antagonist's.
    ///
    /// Each item is the channel (0…9), the amplitude, and the name of the field that sets it.
    pub fn demands(&self) -> impl Iterator<Item = (u8, Amplitude, &'static str)> {
        let own = (self.channel, self.max, "max");
        let antagonist = self
            .co_contraction
            .map(|antagonist| (antagonist.channel, antagonist.amplitude, "amplitude"));
        core::iter::once(own).chain(antagonist)
    }
}
