//! The effort that a nominal wearer's joint needs to be where it is wanted:
//! the muscle and joint model run backwards, for a law to add to its own.

use super::law::{Q, ratio};
use super::spec::{SpecError, SpecField};
use crate::muscle::exponential::{exp2_neg, log2_neg};
use crate::units::{Angle, AngularRate};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// What is known of a wearer beforehand, for the feed-forward. Nobody is this
/// wearer: the law corrects what is left.
///
/// ```text
/// torque = stiffness·(θ − rest) + damping·θ'
///        = flexion·share·(1 − loss·p)           if positive
///        = −extension·share·(1 − loss·(1 − p))  if negative
/// ```
///
/// p is 0 at the joint's lowest angle and 1 at its highest; `share` of the
/// torque is (e^(c·effort) − 1)/(e^c − 1) for an effort between threshold (0)
/// and maximum (1), c the curvature: Lee 2020, eq. 5, with nothing at
/// threshold. Inertia is left out: at 40° and 0.2 Hz a finger's is 1 % of
/// what holds it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct WearerModel {
    /// Angle of the relaxed joint, m°; −180 000…180 000.
    pub rest_mdeg: i32,
    /// Stiffness towards it, µN·m/rad; 0…50 000 000.
    pub stiffness_unm_per_rad: u32,
    /// Viscous friction, µN·m·s/rad; 0…5 000 000.
    pub damping_unm_s_per_rad: u32,
    /// Torque of all flexors at their maxima, joint at its lowest angle, µN·m;
    /// 1000…200 000 000.
    pub flexion_unm: u32,
    /// Torque of the extensor at its maximum, joint at its highest angle,
    /// µN·m; 1000…200 000 000.
    pub extension_unm: u32,
    /// Part of its torque that a muscle loses as it shortens over the joint's
    /// range, thousandths; 0…900.
    pub torque_loss_milli: u16,
    /// c, how force curves upwards between threshold and maximum, thousandths;
    /// 10 (as good as straight)…11 000. Mean of Lee 2020, table 2: 1.2.
    pub curvature_milli: u16,
    /// How far ahead the target is taken, ms; 0…500: the time that muscle and
    /// electromechanical delay need to answer.
    pub lead_ms: u16,
}

/// A validated [`WearerModel`] for one joint.
#[derive(Clone, Copy, Debug)]
pub struct FeedForward {
    /// Bits of [`Angle`].
    rest: i32,
    low: i32,
    span: i32,
    flexion: Side,
    extension: Side,
    /// Loss over the whole range, 2^-31, and per bit of angle, 2^-47.
    loss: u32,
    loss_per_bit: u64,
    /// Seconds, 2^-32: at most 2^31.
    lead: i64,
    /// e^−c and 1 − e^−c, 2^-31.
    floor: u32,
    rise: u32,
    /// Efforts per octave, 2^-24: below 2^31.
    per_octave: u64,
}

/// What the joint asks of one side, as a share of its torque.
#[derive(Clone, Copy, Debug)]
struct Side {
    /// Per degree, 2^-24: at most 5·10^4 · π/180, below 2^34.
    stiffness: i64,
    /// Per °/s, 2^-24: below 2^31.
    damping: i64,
}

/// No target is further away: 1024° in bits of [`Angle`].
const FAR: i64 = 1 << 26;

impl FeedForward {
    /// Validates a wearer's model for a joint that moves between `low_mdeg`
    /// and `high_mdeg` (within ±180 000 m°, low to high).
    ///
    /// # Errors
    /// [`SpecError`] names the first offending field and what it allows.
    pub fn new(model: &WearerModel, low_mdeg: i32, high_mdeg: i32) -> Result<Self, SpecError> {
        model.check()?;
        // |m°| <= 180 000: below 2^24.
        let bits = |mdeg: i32| (i64::from(mdeg) * 65_536 / 1000) as i32;
        let (rest, low) = (bits(model.rest_mdeg), bits(low_mdeg));
        let span = bits(high_mdeg).saturating_sub(low).max(1);
        // Below 2^31, as the loss is at most 0.9.
        let loss = (u64::from(model.torque_loss_milli) << 31) / 1000;
        // log2 e · 11 < 16 octaves, 2^-32.
        let floor = exp2_neg(u64::from(model.curvature_milli) * 6_196_328_019 / 1000);
        Ok(Self {
            rest,
            low,
            span,
            flexion: Side::new(model, model.flexion_unm),
            extension: Side::new(model, model.extension_unm),
            loss: loss as u32,
            loss_per_bit: (loss << 16) / u64::from(span.cast_unsigned()), // span >= 1
            lead: (i64::from(model.lead_ms) << 32) / 1000,
            floor,
            rise: (1u32 << 31).saturating_sub(floor), // e^−c <= 1
            // 2^24 · 1000 · ln 2 over c in thousandths, which is 10 or more.
            per_octave: 11_629_079_550 / u64::from(model.curvature_milli),
        })
    }

    /// The effort in −1…1 (as [`super::Effort::Fraction`]) that moves the
    /// nominal wearer's joint along a `target` that changes at `rate`; ±1 where
    /// more would be needed. Add it to a law's own effort before the clamp that
    /// its anti-windup watches; without a wearer's model add nothing.
    ///
    /// Within 2e-4 of the model in floating point
    /// (`firmware/tests/control_feed_forward.rs`).
    #[must_use]
    pub fn effort(&self, target: Angle, rate: AngularRate) -> Q {
        let rate = i64::from(rate.0.to_bits());
        // |rate| <= 2^31 and lead <= 2^31; target below 2^32 then.
        let lead = rate.wrapping_mul(self.lead) >> 32;
        let angle = i64::from(target.0.to_bits()).wrapping_add(lead);
        let angle = angle.clamp(-FAR, FAR);
        let way = angle.wrapping_sub(self.rest.into()); // below 2^27
        // 0…span, below 2^25; times loss/span at most 2^47.
        let moved = angle.wrapping_sub(self.low.into());
        let moved = moved.clamp(0, self.span.into()).cast_unsigned();
        let lost = (moved.wrapping_mul(self.loss_per_bit) >> 16) as u32;

        let torque = self.flexion.share(way, rate);
        if torque >= 0 {
            return self.for_share(torque.cast_unsigned(), lost);
        }
        let torque = self.extension.share(way, rate).unsigned_abs();
        -self.for_share(torque, self.loss.saturating_sub(lost))
    }

    /// The effort for `share` (2^-40) of the torque of a muscle that has lost
    /// `lost` (2^-31) of it: 0…1.
    fn for_share(&self, share: u64, lost: u32) -> Q {
        let left = (1u32 << 31).wrapping_sub(lost); // lost <= 0.9
        let share = share >> 9;
        if share >= u64::from(left) {
            return Q::ONE;
        }
        // Below 2^31 now, and left 2^-15 of its 2^31 or more: 2^-16, rounded.
        let left = left.wrapping_add(1 << 15) >> 16;
        let part = (share as u32).checked_div(left).unwrap_or(0).min(1 << 16);
        // 2^31 · 2^16; floor + rise is 2^31.
        let above = (u64::from(self.rise).wrapping_mul(u64::from(part)) >> 16) as u32;
        let octaves = log2_neg(self.floor.wrapping_add(above)); // at most 31 · 2^32
        // 2^29 · 2^31.
        let below = (octaves >> 8).wrapping_mul(self.per_octave) >> 24;
        Q::from_bits(Q::ONE.to_bits().saturating_sub(below.cast_signed()).max(0))
    }
}

impl Side {
    fn new(model: &WearerModel, torque_unm: u32) -> Self {
        let per_degree = |quantity: u32| {
            // π/180 = 174 532 925 · 10^-10: 5·10^7 · 1.7·10^8 < 2^53.
            let numerator = u64::from(quantity) * 174_532_925;
            ratio(numerator, u64::from(torque_unm) * 10_000_000_000).to_bits()
        };
        Self {
            stiffness: per_degree(model.stiffness_unm_per_rad),
            damping: per_degree(model.damping_unm_s_per_rad),
        }
    }

    /// The torque at `way` from rest and `rate`, 2^-40 of this side's.
    fn share(&self, way: i64, rate: i64) -> i64 {
        // 2^27 · 2^34 + 2^31 · 2^31 < 2^63.
        let elastic = way.wrapping_mul(self.stiffness);
        elastic.wrapping_add(rate.wrapping_mul(self.damping))
    }
}

impl WearerModel {
    fn check(&self) -> Result<(), SpecError> {
        use SpecField as F;
        let within = |field, value: i64, min: i32, max: i32| {
            if (i64::from(min)..=i64::from(max)).contains(&value) {
                Ok(())
            } else {
                Err(SpecError::OutOfRange { field, min, max })
            }
        };
        within(F::Rest, self.rest_mdeg.into(), -180_000, 180_000)?;
        within(
            F::Stiffness,
            self.stiffness_unm_per_rad.into(),
            0,
            50_000_000,
        )?;
        within(F::Damping, self.damping_unm_s_per_rad.into(), 0, 5_000_000)?;
        within(F::Flexion, self.flexion_unm.into(), 1_000, 200_000_000)?;
        within(F::Extension, self.extension_unm.into(), 1_000, 200_000_000)?;
        within(F::TorqueLoss, self.torque_loss_milli.into(), 0, 900)?;
        within(F::Curvature, self.curvature_milli.into(), 10, 11_000)?;
        within(F::Lead, self.lead_ms.into(), 0, 500)
    }
}
