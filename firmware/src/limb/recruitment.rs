//! Conversion of a line's force into its channel's amplitude: f = g·(s + q), between the amplitude
//! at which force begins and the wearer's limit (Sierotowicz 2023, section 2.2).

use super::{Choice, JOINTS, LINES, LineSpec, Number, ReachError};
use crate::units::Amplitude;
use heapless::Vec;

/// Amplitudes of channels (0…9). Channels that are absent are not stimulated.
pub type Orders = Vec<(u8, Amplitude), LINES>;

/// Amplitudes that produce a given wrench.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct RecruitmentResult<N> {
    /// Channel and amplitude of each chosen line.
    pub orders: Orders,
    /// Choices at SC, GH and EL, including joints at which no muscle can contribute.
    pub joints: [Choice<N>; JOINTS],
}

/// Conversion from force to amplitude for one line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve<N> {
    channel: u8,
    threshold: N,
    limit: Amplitude,
    /// Amplitude per force, µA per N.
    per_newton: N,
    most: N,
}

impl<N: Number> Curve<N> {
    pub(super) fn new(spec: &LineSpec) -> Self {
        let integer = |number: u32| N::ratio(number.cast_signed(), 1); // at most 10^8
        let gain = integer(spec.gain_mn_per_ma);
        // Million µA per mN/mA, because N per µA has to be multiplied by a million.
        let million = N::ratio(1_000_000, 1);
        let (threshold, limit) = (spec.threshold.get(), spec.limit.get());
        Self {
            channel: spec.channel,
            threshold: integer(threshold),
            limit: spec.limit,
            per_newton: million / gain,
            most: integer(limit.saturating_sub(threshold)) * gain / million,
        }
    }

    /// Returns the force at the wearer's limit, N.
    pub(super) const fn max_force(&self) -> N {
        self.most
    }

    /// Returns the amplitude for a force above zero, N, at most the wearer's limit.
    fn amplitude(&self, force: N) -> Amplitude {
        let amplitude = (self.threshold + force * self.per_newton).to_nearest();
        Amplitude::new(amplitude).min(self.limit)
    }
}

/// Returns the amplitudes for forces, N, in the order of `curves`.
pub(super) fn orders<N: Number>(curves: &[Curve<N>], forces: &[N]) -> Orders {
    let pairs = curves.iter().zip(forces);
    let active = pairs.filter(|(_, force)| **force > N::ZERO);
    let order = |(curve, force): (&Curve<N>, &N)| (curve.channel, curve.amplitude(*force));
    active.map(order).collect()
}

/// Returns the amplitudes for the choices, if no line would exceed its largest force.
pub(super) fn recruit<N: Number>(
    curves: &[Curve<N>],
    joints: &[Choice<N>; JOINTS],
) -> Result<RecruitmentResult<N>, ReachError<N>> {
    let mut orders = Orders::new();
    let mut nearest: Option<(u8, N)> = None;
    let mut unhelped = false;
    for choice in joints {
        let &Choice::Line(line, force) = choice else {
            unhelped |= matches!(choice, Choice::Unhelped);
            continue;
        };
        let Some(curve) = curves.get(usize::from(line)) else {
            continue;
        };
        if force > curve.most {
            let share = curve.most / force;
            if nearest.is_none_or(|(_, least)| share < least) {
                nearest = Some((line, share));
            }
        }
        // Three joints, ten places.
        let _ = orders.push((curve.channel, curve.amplitude(force)));
    }
    if let Some((line, share)) = nearest {
        return Err(ReachError::TooStrong { line, share });
    }
    if orders.is_empty() && unhelped {
        return Err(ReachError::NoMuscleHelps);
    }
    Ok(RecruitmentResult {
        orders,
        joints: *joints,
    })
}
