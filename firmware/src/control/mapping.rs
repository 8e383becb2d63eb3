//! From a law's effort to amplitudes of flexor and extensor
//! (Hamana 2022 (7)–(12), with V_Eth in (10) where V_Bth is printed).

use super::law::{Effort, Q};
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
        // At most max.0, so it fits u32.
        let threshold = Amplitude((max.0 as u64 * share / 1000) as u32);
        Self {
            channel,
            threshold,
            max,
        }
    }
}

/// Validated points of one joint.
#[derive(Clone, Debug)]
pub(super) struct Mapping {
    pub(super) flexors: Vec<PointSpec, 2>,
    pub(super) extensor: PointSpec,
}

/// One amplitude per channel of the joint.
pub type Amplitudes = Vec<(u8, Amplitude), CHANNELS>;

impl Mapping {
    /// Amplitudes for an effort, and whether any met the wearer's maximum and
    /// had to be clamped. The side that does not work stays at its threshold,
    /// which stiffens the joint.
    pub(super) fn amplitudes(&self, effort: Effort) -> (Amplitudes, bool) {
        let mut all = Amplitudes::new();
        let mut limiting = false;
        let points = self.flexors.iter().map(|p| (p, false));
        for (point, extends) in points.chain([(&self.extensor, true)]) {
            let wanted = above_threshold(point, effort, extends)
                .saturating_add(i64::from(point.threshold.0));
            let max = i64::from(point.max.0);
            limiting |= wanted > max;
            // threshold <= wanted: the clamp leaves threshold..=max, which fit
            // u32. Two flexors and one extensor fit `Amplitudes`, so push
            // cannot fail.
            let _ = all.push((point.channel, Amplitude(wanted.min(max) as u32)));
        }
        (all, limiting)
    }

    /// Every channel at zero.
    pub(super) fn silence(&self) -> Amplitudes {
        let points = self.flexors.iter().chain([&self.extensor]);
        points.map(|p| (p.channel, Amplitude::ZERO)).collect()
    }
}

/// R(±u) of (7), (8) in mV or µA, rounded down, 0 for the resting side.
fn above_threshold(point: &PointSpec, effort: Effort, extends: bool) -> i64 {
    let (u, scale) = match effort {
        Effort::AboveThreshold(u) => (u, 1000),
        // threshold <= max by validation.
        Effort::Fraction(u) => (u, i64::from(point.max.0.saturating_sub(point.threshold.0))),
    };
    let pull = if extends { u.saturating_neg() } else { u }.max(Q::ZERO);
    // Saturates: i64 times at most 2^32, shifted back.
    let thousandths = (i128::from(pull.to_bits()) * i128::from(scale)) >> Q::FRAC_NBITS;
    thousandths.min(i128::from(i64::MAX)) as i64
}
