//! Recruitment: the share of a muscle that an amplitude activates. It is exponential between motor
//! threshold and the wearer's limit (Lee, Kim & Jung 2020, eqs. 5–6), and zero below.

use fixed::types::{I16F16, U1F31};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::Gain;
use crate::arithmetic::exponential::{exp2_neg, log2_neg};
use crate::range::{OutOfRange, Range};
use crate::units::Amplitude;

/// Constant log2 e in 2^-60 per 10^9, which converts millionths per thousandth into octaves.
const OCTAVES_PER_NANO: u64 = 1_663_314_137;
/// Constant 10^9·ln 2 in 2^-16.
const NANO_PER_OCTAVE: u64 = 45_426_093_625_177;

/// Largest amplitude, one ampere or one kilovolt: far above the limits of `safety`, and low enough
/// for the arithmetic here.
const AMPLITUDE_MAX: i32 = 1_000_000;

/// Largest distance of the threshold from the reference, octaves: the force at threshold is at
/// least 1/65,536 of the force at the reference, where a gain still has four digits.
const OCTAVES_MAX: u64 = 16;

/// Recruitment of one muscle under one electrode pair.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct RecruitmentSpec {
    /// Motor threshold I_MT, the smallest amplitude that moves the joint: 1 µA (mV) or more.
    pub motor_threshold: Amplitude,
    /// Largest amplitude to which this wearer agreed; above `motor_threshold`.
    pub limit: Amplitude,
    /// Amplitude I_0 of eq. 6, at which A was measured: `limit` or above, at most 1 A (1 kV). The
    /// exponential is the foot of a sigmoid (figure 3) and is not extrapolated; an A that was
    /// measured at a lower amplitude is first converted to the limit by eq. 6.
    pub reference: Amplitude,
    /// Slope b of eq. 5, millionths per mA (per V): 10,000…5,000,000, and at most 16 octaves
    /// (factor 65,536) from threshold to reference. Lee's subjects have 180,000…510,000.
    pub slope_micro: u32,
}

impl RecruitmentSpec {
    /// Range of [`Self::motor_threshold`].
    pub const MOTOR_THRESHOLD: Range = Range::new("motor_threshold", 1, AMPLITUDE_MAX - 1);
    /// Range of [`Self::limit`], for the lowest threshold.
    pub const LIMIT: Range = Range::new("limit", 2, AMPLITUDE_MAX);
    /// Range of [`Self::reference`], for the lowest limit.
    pub const REFERENCE: Range = Range::new("reference", 2, AMPLITUDE_MAX);
    /// Range of [`Self::slope_micro`].
    pub const SLOPE_MICRO: Range = Range::new("slope_micro", 10_000, 5_000_000);
}

/// A validated recruitment curve: gain(I) = e^(b·(I − I_0)) for threshold ≤ I ≤ limit, 0 below.
///
/// ```
/// use firmware::muscle::{Gain, Recruitment, RecruitmentSpec};
/// use firmware::units::Amplitude;
///
/// let curve = Recruitment::new(RecruitmentSpec {
///     motor_threshold: Amplitude::new(6_000), // 6 mA
///     limit: Amplitude::new(20_000),
///     reference: Amplitude::new(20_000),
///     slope_micro: 250_000,
/// })?;
/// assert_eq!(curve.gain(Amplitude::new(5_999)), Gain::ZERO);
/// assert_eq!(curve.gain(Amplitude::new(20_000)), Gain::FULL);
/// // A quarter of the force needs ln 4 / 0.25 = 5.545 mA less.
/// let quarter = Gain::new(fixed::types::U1F31::from_num(0.25));
/// assert_eq!(curve.amplitude_for_gain(quarter), Amplitude::new(14_455));
/// # Ok::<(), firmware::range::OutOfRange>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Recruitment {
    spec: RecruitmentSpec,
    /// Slope b in octaves per thousandth, 2^-48; below 2^41.
    octaves_per_step: u64,
    /// Inverse 1/b in thousandths per octave, 2^-16; below 2^33.
    steps_per_octave: u64,
    gain_at_threshold: Gain,
    gain_at_limit: Gain,
}

impl Recruitment {
    /// Derives the constants of a curve.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] for the first of motor threshold, limit, reference and slope that is
    /// outside its range; each range also depends on the values before it.
    pub fn new(spec: RecruitmentSpec) -> Result<Self, OutOfRange> {
        let RecruitmentSpec { slope_micro, .. } = spec;
        let [threshold, limit, reference] =
            [spec.motor_threshold, spec.limit, spec.reference].map(Amplitude::get);
        RecruitmentSpec::MOTOR_THRESHOLD.check(threshold)?;
        // threshold < AMPLITUDE_MAX
        RecruitmentSpec::LIMIT
            .with_min_at_least(threshold + 1)
            .check(limit)?;
        RecruitmentSpec::REFERENCE
            .with_min_at_least(limit)
            .check(reference)?;
        // reference > threshold; 2^4 · 4.6e13 fits 64 bits, and the relevant part of the quotient
        // fits 32.
        let span = u64::from(reference - threshold);
        let steepest = ((OCTAVES_MAX * NANO_PER_OCTAVE) >> 16) / span;
        let steepest = u32::try_from(steepest).unwrap_or(u32::MAX);
        RecruitmentSpec::SLOPE_MICRO
            .with_max_at_most(steepest)
            .check(slope_micro)?;
        let mut curve = Self {
            spec,
            // 5·10^6 · 1.7·10^9 = 8.3·10^15.
            octaves_per_step: (u64::from(slope_micro) * OCTAVES_PER_NANO) >> 12,
            steps_per_octave: NANO_PER_OCTAVE / u64::from(slope_micro),
            gain_at_threshold: Gain::ZERO,
            gain_at_limit: Gain::ZERO,
        };
        curve.gain_at_threshold = curve.exponential(threshold);
        curve.gain_at_limit = curve.exponential(limit);
        Ok(curve)
    }

    /// Returns the specification from which the curve was derived.
    #[must_use]
    pub const fn spec(&self) -> &RecruitmentSpec {
        &self.spec
    }

    /// Returns the gain of a pulse of `amplitude`, for [`super::CalciumForce::pulse`]: zero below
    /// motor threshold, and never more than the gain at the limit. The relative error is below
    /// 9.2e-9 plus 2^-31 of 1.
    #[must_use]
    pub fn gain(&self, amplitude: Amplitude) -> Gain {
        if amplitude < self.spec.motor_threshold {
            Gain::ZERO
        } else if amplitude >= self.spec.limit {
            self.gain_at_limit
        } else {
            self.exponential(amplitude.get())
        }
    }

    /// Returns the amplitude that gives `gain`: zero if the gain at motor threshold is larger, the
    /// wearer's limit if the gain at the limit is smaller, and otherwise within 0.6 µA (mV) of the
    /// exact inverse.
    #[must_use]
    pub fn amplitude_for_gain(&self, gain: Gain) -> Amplitude {
        if gain < self.gain_at_threshold {
            return Amplitude::ZERO;
        }
        if gain >= self.gain_at_limit {
            return self.spec.limit;
        }
        // Octaves in Q24 are at most 16 · 2^24, as the gain is above that at threshold; times 2^33
        // plus the rounding half fits.
        let octaves = log2_neg(gain.get().to_bits()) >> 8;
        let below = (octaves * self.steps_per_octave + (1 << 39)) >> 40;
        // At most 2^21; saturating in case the reference is near zero.
        let amplitude = self.spec.reference.get().saturating_sub(below as u32);
        Amplitude::new(amplitude).clamp(self.spec.motor_threshold, self.spec.limit)
    }

    /// Returns the amplitude for an effort between 0 (no stimulation) and 1 (the wearer's limit).
    /// Above 0, the force rises in proportion to the effort, from the force at motor threshold.
    /// Efforts outside 0…1 saturate.
    #[must_use]
    pub fn amplitude_for_effort(&self, effort: I16F16) -> Amplitude {
        if effort <= I16F16::ZERO {
            return Amplitude::ZERO;
        }
        let bits = u64::from(effort.min(I16F16::ONE).to_bits().cast_unsigned());
        let (low, high) = (self.gain_at_threshold.get(), self.gain_at_limit.get());
        // high > low, because limit > threshold and the smallest slope changes the gain by 1e-5 per
        // step. 2^31 · 2^16 fits; the sum is at most high.
        let range = u64::from(high.to_bits().saturating_sub(low.to_bits()));
        let above = ((range * bits) >> 16) as u32;
        let gain = U1F31::from_bits(low.to_bits().saturating_add(above));
        self.amplitude_for_gain(Gain::new(gain))
    }

    /// Computes e^(b·(I − I_0)) for threshold ≤ I ≤ reference.
    fn exponential(&self, amplitude: u32) -> Gain {
        let below = u64::from(self.spec.reference.get().saturating_sub(amplitude));
        // 10^6 · 2^41 < 2^61.
        let octaves = (below * self.octaves_per_step) >> 16;
        Gain::new(U1F31::from_bits(exp2_neg(octaves)))
    }
}
