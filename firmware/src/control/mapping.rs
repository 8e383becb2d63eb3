//! From a law's effort to amplitudes of flexor and extensor
//! (Hamana 2022 (7)–(12), with V_Eth in (10) where V_Bth is printed).

use super::effort::Effort;
use super::refusal::{AMPLITUDE_MAX, CHANNEL, SpecError};
use crate::arithmetic::fixed_point::Q;
use crate::range::{OutOfRange, Range};
use crate::units::Amplitude;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Most channels one joint drives: two flexor points and the extensor.
pub const CHANNELS: usize = 3;

/// A stimulation point: its channel and the wearer's range on it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct PointSpec {
    /// Channel number, 0…9.
    pub channel: u8,
    /// Motor threshold: the amplitude at no effort, and while the antagonist
    /// works. mV or µA, at most `max`.
    pub threshold: Amplitude,
    /// The wearer's maximum during control. mV or µA, at most 200 000.
    pub max: Amplitude,
}

impl PointSpec {
    /// A point of a pair, whose threshold is a share r_th (thousandths) of its
    /// maximum: r_th·V_max of (11), (12). Saturates at `max`.
    #[must_use]
    pub const fn of_pair(channel: u8, max: Amplitude, r_th_milli: u16) -> Self {
        let share = if r_th_milli > 1000 {
            1000
        } else {
            r_th_milli as u64
        };
        // At most max, so it fits u32.
        let threshold = Amplitude::new((max.get() as u64 * share / 1000) as u32);
        Self {
            channel,
            threshold,
            max,
        }
    }
}

/// Validated points of one joint.
#[derive(Clone, Debug)]
pub struct Mapping {
    flexors: Vec<PointSpec, 2>,
    extensor: PointSpec,
}

/// One amplitude per channel of the joint.
pub type Amplitudes = Vec<(u8, Amplitude), CHANNELS>;

/// More than any point's range holds, in units of either effort: 2^19 ranges
/// of 1 µA or 2^19 V are beyond every maximum of at most 200 000.
const PULL_MAX: i64 = 1 << (19 + Q::FRAC_NBITS);

impl Mapping {
    /// How many flexor points there are.
    pub const FLEXORS: Range = Range::new("flexors", 1, 2);

    /// Validates the points: one or two flexors, no channel twice.
    pub(super) fn new(flexors: &Vec<PointSpec, 2>, extensor: PointSpec) -> Result<Self, SpecError> {
        // At most 2 by the type.
        Self::FLEXORS.check(flexors.len() as u32)?;
        let mut used = 0_u16;
        for point in flexors.iter().chain([&extensor]) {
            point.check()?;
            // channel <= 9.
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

    /// Amplitudes for an effort, and whether any met the wearer's maximum and
    /// had to be clamped. The side that does not work stays at its threshold,
    /// which stiffens the joint.
    #[must_use]
    pub fn amplitudes(&self, effort: Effort) -> (Amplitudes, bool) {
        let (Effort::AboveThreshold(u) | Effort::Fraction(u)) = effort;
        let u = u.to_bits().clamp(-PULL_MAX, PULL_MAX);
        let (flexion, extension) = (u.max(0).cast_unsigned(), (-u).max(0).cast_unsigned());
        let fraction = matches!(effort, Effort::Fraction(_));
        let mut all = Amplitudes::new();
        let mut limiting = false;
        // Two flexors and one extensor fit `Amplitudes`: push cannot fail.
        for point in &self.flexors {
            let _ = all.push((
                point.channel,
                point.pulled(flexion, fraction, &mut limiting),
            ));
        }
        let extensor = self.extensor.pulled(extension, fraction, &mut limiting);
        let _ = all.push((self.extensor.channel, extensor));
        (all, limiting)
    }

    /// Whether `channel` drives a flexor or, if not, the extensor; none if neither.
    pub(super) fn is_flexor(&self, channel: u8) -> Option<bool> {
        let is_flexor = self.flexors.iter().any(|point| point.channel == channel);
        (is_flexor || self.extensor.channel == channel).then_some(is_flexor)
    }

    /// Every channel at zero.
    pub(super) fn silence(&self) -> Amplitudes {
        let points = self.flexors.iter().chain([&self.extensor]);
        points.map(|p| (p.channel, Amplitude::ZERO)).collect()
    }
}

impl PointSpec {
    /// Of [`Self::max`].
    pub const MAX: Range = Range::new("max", 0, AMPLITUDE_MAX);
    /// Of [`Self::threshold`], under the highest maximum.
    pub const THRESHOLD: Range = Range::new("threshold", 0, AMPLITUDE_MAX);

    fn check(&self) -> Result<(), OutOfRange> {
        CHANNEL.check(self.channel)?;
        Self::MAX.check(self.max.get())?;
        Self::THRESHOLD
            .up_to(self.max.get())
            .check(self.threshold.get())
    }

    /// R(±u) of (7), (8) on top of the threshold, in mV or µA, rounded down;
    /// `limiting` is set if the maximum clamps it. `pull` is a [`Q`] in 0…2^19, a
    /// `fraction` of the point's range or volts.
    fn pulled(&self, pull: u64, fraction: bool, limiting: &mut bool) -> Amplitude {
        if pull == 0 {
            return self.threshold; // the side that rests
        }
        let range = self.max.get().saturating_sub(self.threshold.get());
        let scale = if fraction { range } else { 1000 };
        // 2^43 · 2^18 = 2^61.
        let above = pull.wrapping_mul(u64::from(scale)) >> Q::FRAC_NBITS;
        *limiting |= above > u64::from(range);
        // Range and threshold add up to the maximum.
        let above = above.min(u64::from(range)) as u32;
        Amplitude::new(self.threshold.get().saturating_add(above))
    }
}
