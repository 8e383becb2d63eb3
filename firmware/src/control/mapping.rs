//! Conversion of a controller's effort into amplitudes of flexor and extensor.
//!
//! Implements equations (7) to (12) of Hamana 2022, with V_Eth in (10), where V_Bth is
//! printed.

use super::effort::Effort;
use super::refusal::{AMPLITUDE_MAX, CHANNEL, SpecError};
use crate::arithmetic::fixed_point::Q;
use crate::range::{OutOfRange, Range};
use crate::units::Amplitude;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Maximum number of channels that one joint drives: two flexor points and the extensor.
pub const CHANNELS: usize = 3;

/// A stimulation point: its channel and the wearer's range of amplitudes there.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct PointSpec {
    /// Channel number, 0…9.
    pub channel: u8,
    /// Motor threshold, mV or µA; at most `max`. The channel is driven with it at
    /// zero effort and while the antagonist is active.
    pub threshold: Amplitude,
    /// The wearer's maximum amplitude during control, mV or µA; at most 200 000.
    pub max: Amplitude,
}

impl PointSpec {
    /// Creates a point of a flexor pair, whose threshold is r_th·V_max (equations (11)
    /// and (12)).
    ///
    /// `r_th_milli` is r_th in thousandths; values above 1000 count as 1000.
    #[must_use]
    pub const fn of_pair(channel: u8, max: Amplitude, r_th_milli: u16) -> Self {
        let r_th_milli = if r_th_milli > 1000 {
            1000
        } else {
            r_th_milli as u64
        };
        // The result is at most `max`, so it fits into u32.
        let threshold = Amplitude::new((max.get() as u64 * r_th_milli / 1000) as u32);
        Self {
            channel,
            threshold,
            max,
        }
    }
}

/// The validated stimulation points of one joint.
#[derive(Clone, Debug)]
pub struct Mapping {
    flexors: Vec<PointSpec, 2>,
    extensor: PointSpec,
}

/// One amplitude per channel of a joint, as pairs of channel number (0…9) and amplitude.
pub type Amplitudes = Vec<(u8, Amplitude), CHANNELS>;

/// Bound of the effort's magnitude, as bits of a [`Q`], which keeps the products in range.
///
/// It clamps no effort that matters: 2^19 times a range of 1 µA, and 2^19 V, are both more
/// than the highest maximum, 200 000.
const EFFORT_MAX: i64 = 1 << (19 + Q::FRAC_NBITS);

impl Mapping {
    /// Number of flexor points of a joint.
    pub const FLEXORS: Range = Range::new("flexors", 1, 2);

    /// Validates the points: there must be one or two flexors, and all channels must differ.
    pub(super) fn new(flexors: &Vec<PointSpec, 2>, extensor: PointSpec) -> Result<Self, SpecError> {
        // The type holds at most 2.
        Self::FLEXORS.check(flexors.len() as u32)?;
        let mut used = 0_u16;
        for point in flexors.iter().chain([&extensor]) {
            point.check()?;
            // `check` has verified that the channel is at most 9.
            let bit = 1_u16 << point.channel;
            if used & bit != 0 {
                return Err(SpecError::ChannelTwice {
                    channel: point.channel,
                });
            }
            used |= bit;
        }
        Ok(Self {
            flexors: flexors.clone(),
            extensor,
        })
    }

    /// Returns the amplitudes for an effort, and whether any of them was clamped to the
    /// wearer's maximum.
    ///
    /// The inactive side stays at its threshold, which stiffens the joint.
    #[must_use]
    pub fn amplitudes(&self, effort: Effort) -> (Amplitudes, bool) {
        let (Effort::AboveThreshold(u) | Effort::Fraction(u)) = effort;
        let bits = u.to_bits().clamp(-EFFORT_MAX, EFFORT_MAX);
        let (flexion, extension) = (bits.max(0).cast_unsigned(), (-bits).max(0).cast_unsigned());
        let is_fraction = matches!(effort, Effort::Fraction(_));
        let mut amplitudes = Amplitudes::new();
        let mut is_clamped = false;
        // `Amplitudes` has room for two flexors and one extensor, so `push` cannot fail.
        for point in &self.flexors {
            let _ = amplitudes.push((
                point.channel,
                point.amplitude(flexion, is_fraction, &mut is_clamped),
            ));
        }
        let extensor = self
            .extensor
            .amplitude(extension, is_fraction, &mut is_clamped);
        let _ = amplitudes.push((self.extensor.channel, extensor));
        (amplitudes, is_clamped)
    }

    /// Returns whether `channel` drives a flexor (`true`) or the extensor (`false`), or `None`
    /// if this joint does not use the channel.
    pub(super) fn is_flexor(&self, channel: u8) -> Option<bool> {
        let is_flexor = self.flexors.iter().any(|point| point.channel == channel);
        (is_flexor || self.extensor.channel == channel).then_some(is_flexor)
    }

    /// Returns an amplitude of zero for every channel of the joint.
    pub(super) fn silence(&self) -> Amplitudes {
        let points = self.flexors.iter().chain([&self.extensor]);
        points.map(|p| (p.channel, Amplitude::ZERO)).collect()
    }
}

impl PointSpec {
    /// Range of [`Self::max`], mV or µA.
    pub const MAX: Range = Range::new("max", 0, AMPLITUDE_MAX);
    /// Range of [`Self::threshold`], mV or µA, for a point with the highest possible maximum.
    pub const THRESHOLD: Range = Range::new("threshold", 0, AMPLITUDE_MAX);

    /// Checks the channel and both amplitudes.
    fn check(&self) -> Result<(), OutOfRange> {
        CHANNEL.check(self.channel)?;
        Self::MAX.check(self.max.get())?;
        Self::THRESHOLD
            .with_max_at_most(self.max.get())
            .check(self.threshold.get())
    }

    /// Returns the threshold plus R(±u) of equations (7) and (8), in mV or µA, rounded down.
    ///
    /// `effort` holds the bits of a [`Q`] in 0…2^19. Its unit is the point's range if
    /// `is_fraction`, and V or mA otherwise. Sets `is_clamped` if the maximum clamps the
    /// amplitude.
    fn amplitude(&self, effort: u64, is_fraction: bool, is_clamped: &mut bool) -> Amplitude {
        if effort == 0 {
            return self.threshold; // this side is inactive
        }
        let range = self.max.get().saturating_sub(self.threshold.get());
        let scale = if is_fraction { range } else { 1000 };
        // The product is less than 2^43 · 2^18 = 2^61.
        let above_threshold = effort.wrapping_mul(u64::from(scale)) >> Q::FRAC_NBITS;
        *is_clamped |= above_threshold > u64::from(range);
        // Range and threshold add up to the maximum, so the sum does not exceed it.
        let above_threshold = above_threshold.min(u64::from(range)) as u32;
        Amplitude::new(self.threshold.get().saturating_add(above_threshold))
    }
}
