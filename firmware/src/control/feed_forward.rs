//! Feed-forward: the effort that a nominal wearer's joint needs to follow the reference. It is the
//! inverse of the muscle and joint model, and a controller adds it to its own effort.

use crate::arithmetic::exponential::{exp2_neg, log2_neg_coarse, mul_high};
use crate::arithmetic::fixed_point::{Q, ratio};
use crate::range::{OutOfRange, Range};
use crate::units::{Angle, AngularRate};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Nominal model of a wearer for the feed-forward. No wearer matches it exactly: the controller
/// corrects the remaining error.
///
/// ```text
/// torque = stiffness·(θ − rest) + damping·θ'
///        = flexion·share·(1 − loss·p)           if positive
///        = −extension·share·(1 − loss·(1 − p))  if negative
/// ```
///
/// p is 0 at the joint's lowest angle and 1 at its highest. `share` is the fraction of the torque,
/// (e^(c·effort) − 1)/(e^c − 1) for an effort between threshold (0) and maximum (1), where c is the
/// curvature: Lee 2020, eq. 5, with zero torque at threshold. Inertia is left out: at 40° and 0.2
/// Hz, a finger's inertia needs 1 % of the torque that holds the finger.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct WearerModel {
    /// Angle of the relaxed joint, m°; −180 000…180 000.
    pub rest_mdeg: i32,
    /// Stiffness towards the rest angle, µN·m/rad; 0…50 000 000.
    pub stiffness_unm_per_rad: u32,
    /// Viscous friction, µN·m·s/rad; 0…5 000 000.
    pub damping_unm_s_per_rad: u32,
    /// Torque of all flexors at their maxima, with the joint at its lowest angle, µN·m;
    /// 1000…200 000 000.
    pub flexion_unm: u32,
    /// Torque of the extensor at its maximum, with the joint at its highest angle, µN·m;
    /// 1000…200 000 000.
    pub extension_unm: u32,
    /// Share of its torque that a muscle loses as it shortens over the joint's range, thousandths;
    /// 0…900.
    pub torque_loss_milli: u16,
    /// Curvature c of the force between threshold and maximum, thousandths; 100 (almost
    /// straight)…11 000. The mean of Lee 2020, table 2, is 1.2.
    pub curvature_milli: u16,
    /// Lead with which the feed-forward follows the reference, ms; 0…500. It compensates the
    /// response time of the muscle and the electromechanical delay.
    pub lead_ms: u16,
}

/// A validated [`WearerModel`] for one joint.
#[derive(Clone, Copy, Debug)]
pub struct FeedForward {
    /// Rest angle as bits of [`Angle`], like all angles here.
    rest: i32,
    low: i32,
    span: i32,
    flexion: Side,
    extension: Side,
    /// Share of its torque that a muscle loses over the joint's whole range, 2^-31.
    loss: u32,
    /// Number of leading zeros of `span`.
    span_shift: u32,
    /// Loss per `span` shifted left by `span_shift`, 2^-63.
    loss_slope: u32,
    /// Lead in seconds, 2^-31: at most 2^30.
    lead: i32,
    /// Constant e^−c, 2^-31, where c is the curvature.
    floor: u32,
    /// Constant 1 − e^−c, 2^-31.
    rise: u32,
    /// Change of the effort that doubles e^(c·effort): ln 2 / c, 2^-24, below 2^27.
    per_octave: u32,
}

/// Coefficients of the joint's torque as shares of one side's full torque, 2^-24. They saturate at
/// 128, the full torque within 0.01° or °/s.
#[derive(Clone, Copy, Debug)]
struct Side {
    /// Elastic torque per degree.
    stiffness: i32,
    /// Viscous torque per °/s.
    damping: i32,
}

/// Largest magnitude of a reference angle: 1024° as bits of [`Angle`].
const FAR: i32 = 1 << 26;

impl FeedForward {
    /// Validates a wearer's model for a joint that moves between `low_mdeg` and `high_mdeg` (within
    /// ±180 000 m°, low before high).
    ///
    /// # Errors
    /// Returns [`OutOfRange`] with the first offending field and its range.
    pub fn new(model: &WearerModel, low_mdeg: i32, high_mdeg: i32) -> Result<Self, OutOfRange> {
        model.check()?;
        // |m°| <= 180 000, so the bits stay below 2^24.
        let bits = |mdeg: i32| (i64::from(mdeg) * 65_536 / 1000) as i32;
        let (rest, low) = (bits(model.rest_mdeg), bits(low_mdeg));
        let span = bits(high_mdeg).saturating_sub(low).max(1);
        let span_shift = span.leading_zeros();
        // The loss is at most 0.9, so below 2^31; the divisor is 2^31 or more.
        let loss = (u64::from(model.torque_loss_milli) << 31) / 1000;
        let loss_slope = (loss << 32) / (u64::from(span.cast_unsigned()) << span_shift);
        // log2 e · 11 < 16 octaves, 2^-32.
        let floor = exp2_neg(u64::from(model.curvature_milli) * 6_196_328_019 / 1000);
        Ok(Self {
            rest,
            low,
            span,
            flexion: Side::new(model, model.flexion_unm),
            extension: Side::new(model, model.extension_unm),
            loss: loss as u32,
            span_shift,
            loss_slope: loss_slope as u32, // at most 0.9 · 2^32
            lead: ((i64::from(model.lead_ms) << 31) / 1000) as i32,
            floor,
            rise: (1u32 << 31).saturating_sub(floor), // e^−c <= 1
            // The quotient is 2^24 · 1000 · ln 2 over c in thousandths, which is 100 or more.
            per_octave: (11_629_079_550 / u64::from(model.curvature_milli)) as u32,
        })
    }

    /// Returns the effort in −1…1 (as [`super::Effort::Fraction`]) that moves the nominal wearer's
    /// joint along a reference `target` that changes at `rate`; ±1 if more would be needed. Add the
    /// result to a controller's own effort before the clamp that its anti-windup watches; without a
    /// wearer's model add nothing.
    ///
    /// The result agrees with the floating-point model within 5e-5
    /// (`firmware/tests/control_feed_forward.rs`).
    #[must_use]
    pub fn effort(&self, target: Angle, rate: AngularRate) -> Q {
        let rate = rate.get().to_bits();
        // 2^31 · 2^30 in 2^-47 leaves 2^30 in 2^-16.
        let lead = ((i64::from(rate) * i64::from(self.lead)) >> 31) as i32;
        let angle = target.get().to_bits().saturating_add(lead).clamp(-FAR, FAR);
        let way = angle.wrapping_sub(self.rest); // below 2^27
        // Lies in 0…span; the shifted value stays below 2^32.
        let moved = angle.wrapping_sub(self.low).max(0).min(self.span);
        let moved = moved.cast_unsigned().wrapping_shl(self.span_shift);
        let lost = mul_high(moved, self.loss_slope);

        let torque = self.flexion.torque_share(way, rate);
        Q::from_bits(if torque >= 0 {
            self.effort_for_share(torque.cast_unsigned(), lost)
        } else {
            let torque = self.extension.torque_share(way, rate).unsigned_abs();
            // At most 0…1.
            self.effort_for_share(torque, self.loss.saturating_sub(lost))
                .wrapping_neg()
        })
    }

    /// Returns the effort (2^-24) in 0…1 with which a muscle that has lost `lost` (2^-31) of its
    /// torque produces `share` (2^-40) of its full torque.
    #[inline(always)]
    fn effort_for_share(&self, share: u64, lost: u32) -> i64 {
        let left = (1u32 << 31).wrapping_sub(lost); // lost <= 0.9
        let share = share >> 9;
        if share >= u64::from(left) {
            return 1 << 24;
        }
        // The share is now below 2^31, and `left` is at least 0.1 of 2^31, rounded to 2^-16.
        let left = left.wrapping_add(1 << 15) >> 16;
        let part = (share as u32).checked_div(left).unwrap_or(0).min(1 << 16);
        // 2^31 · 2^16; floor + rise is 2^31.
        let above = mul_high(self.rise << 1, part << 15);
        let octaves = log2_neg_coarse(self.floor.wrapping_add(above)); // at most 16
        // 16 in 2^-27, and 2^31 in 2^-24.
        let below = mul_high(octaves, self.per_octave) << 5;
        i64::from((1u32 << 24).saturating_sub(below))
    }
}

impl Side {
    fn new(model: &WearerModel, torque_unm: u32) -> Self {
        let per_degree = |quantity: u32| {
            // π/180 = 174 532 925 · 10^-10: 5·10^7 · 1.7·10^8 < 2^53.
            let numerator = u64::from(quantity) * 174_532_925;
            let bits = ratio(numerator, u64::from(torque_unm) * 10_000_000_000).to_bits();
            bits.min(i32::MAX.into()) as i32
        };
        Self {
            stiffness: per_degree(model.stiffness_unm_per_rad),
            damping: per_degree(model.damping_unm_s_per_rad),
        }
    }

    /// Returns the torque at a distance of `way` from the rest angle and at `rate`, as a share of
    /// this side's torque, 2^-40.
    fn torque_share(&self, way: i32, rate: i32) -> i64 {
        // 2^27 · 2^31 + 2^31 · 2^31 < 2^63.
        let elastic = i64::from(way) * i64::from(self.stiffness);
        elastic.wrapping_add(i64::from(rate) * i64::from(self.damping))
    }
}

impl WearerModel {
    /// Range of [`Self::rest_mdeg`].
    pub const REST_MDEG: Range = Range::new("rest_mdeg", -180_000, 180_000);
    /// Range of [`Self::stiffness_unm_per_rad`].
    pub const STIFFNESS_UNM_PER_RAD: Range = Range::new("stiffness_unm_per_rad", 0, 50_000_000);
    /// Range of [`Self::damping_unm_s_per_rad`].
    pub const DAMPING_UNM_S_PER_RAD: Range = Range::new("damping_unm_s_per_rad", 0, 5_000_000);
    /// Range of [`Self::flexion_unm`].
    pub const FLEXION_UNM: Range = Range::new("flexion_unm", 1_000, 200_000_000);
    /// Range of [`Self::extension_unm`].
    pub const EXTENSION_UNM: Range = Range::new("extension_unm", 1_000, 200_000_000);
    /// Range of [`Self::torque_loss_milli`].
    pub const TORQUE_LOSS_MILLI: Range = Range::new("torque_loss_milli", 0, 900);
    /// Range of [`Self::curvature_milli`].
    pub const CURVATURE_MILLI: Range = Range::new("curvature_milli", 100, 11_000);
    /// Range of [`Self::lead_ms`].
    pub const LEAD_MS: Range = Range::new("lead_ms", 0, 500);

    /// Returns the wearer's strength: the angle from rest at which the stiffness balances the full
    /// flexion torque, mrad. It measures how far a unit of effort moves the joint, and gains are
    /// scaled with it. The result is clamped to a quarter to four times
    /// [`WearerModel::REFERENCE_MRAD`].
    #[must_use]
    pub const fn strength_mrad(&self) -> u32 {
        let stiffness = match self.stiffness_unm_per_rad {
            0 => 1,
            some => some,
        };
        // 2^32 · 1000 fits.
        let strength = self.flexion_unm as u64 * 1000 / stiffness as u64;
        let (low, high) = (Self::REFERENCE_MRAD / 4, Self::REFERENCE_MRAD * 4);
        if strength < low as u64 {
            low
        } else if strength > high as u64 {
            high
        } else {
            strength as u32
        }
    }

    /// Strength, mrad, for which [`super::LawSpec::RECOMMENDED`] and
    /// [`super::ResponseSpec::RECOMMENDED`] were found: participant P's finger, two-point (0.484
    /// N·m over 0.12 N·m/rad).
    pub const REFERENCE_MRAD: u32 = 4033;

    /// Smallest and largest strength, mrad, at which the controllers were tested, each with an
    /// exact wearer file: a quarter and four times the reference (docs/evidence/control.md).
    pub const STRENGTH_MRAD: (u32, u32) = (Self::REFERENCE_MRAD / 4, Self::REFERENCE_MRAD * 4);

    /// Returns the range of [`Self::stiffness_unm_per_rad`] that keeps the strength within
    /// [`Self::STRENGTH_MRAD`], for a controller that uses this wearer's model.
    #[must_use]
    pub fn stiffness_range(&self) -> Range {
        let (weakest, strongest) = Self::STRENGTH_MRAD;
        let torque = u64::from(self.flexion_unm) * 1000;
        let bound = |stiffness: u64| u32::try_from(stiffness).unwrap_or(u32::MAX);
        Self::STIFFNESS_UNM_PER_RAD
            .with_min_at_least(bound(torque.div_ceil(strongest.into())))
            .with_max_at_most(bound(torque / u64::from(weakest)))
    }

    fn check(&self) -> Result<(), OutOfRange> {
        Self::REST_MDEG.check(self.rest_mdeg)?;
        Self::STIFFNESS_UNM_PER_RAD.check(self.stiffness_unm_per_rad)?;
        Self::DAMPING_UNM_S_PER_RAD.check(self.damping_unm_s_per_rad)?;
        Self::FLEXION_UNM.check(self.flexion_unm)?;
        Self::EXTENSION_UNM.check(self.extension_unm)?;
        Self::TORQUE_LOSS_MILLI.check(self.torque_loss_milli)?;
        Self::CURVATURE_MILLI.check(self.curvature_milli)?;
        Self::LEAD_MS.check(self.lead_ms)
    }
}
