//! What a host says about a joint, and the checks it must pass once.

use super::differentiator::{
    CUTOFF_MAX_MHZ, CUTOFF_MIN_MHZ, Differentiator, STEP_MAX_MS, STEP_MIN_MS,
};
use super::feed_forward::WearerModel;
use super::law::{Law, LawKind, LawSpec};
use super::mapping::{Mapping, PointSpec};
use super::pid::Pid;
use super::response::ResponseSpec;
use super::sensor::SensorSource;
use super::setpoint::HoldPolicy;
use super::super_twisting::{Paper, Recommended, Twist};
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Highest amplitude a spec may name, mV or µA. Only bounds arithmetic; what a
/// wearer may get is `safety`'s to say.
pub const AMPLITUDE_MAX: u32 = 200_000;
/// Highest channel number.
pub const CHANNEL_MAX: u8 = 9;

/// A joint as it travels on the wire, unvalidated. Integers only.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct JointSpec {
    /// The control law and its gains.
    pub law: LawSpec,
    /// Period of the law, ms; 1…20. The paper's glove gives 90 Hz, so 11.
    pub law_period_ms: u8,
    /// Cutoff of the pseudo-differentiation, mHz; 500…20 000. The paper's: 3000.
    pub cutoff_mhz: u32,
    /// One or two flexor points.
    pub flexors: Vec<PointSpec, 2>,
    /// The extensor's point.
    pub extensor: PointSpec,
    /// What to do between and after setpoints.
    pub hold: HoldPolicy,
    /// Lowest angle a setpoint may ask for, m°; −180 000…180 000.
    pub angle_min_mdeg: i32,
    /// Highest angle a setpoint may ask for, m°; above the lowest, to 180 000.
    pub angle_max_mdeg: i32,
    /// Where measurements come from.
    pub sensor: SensorSource,
    /// Age at which the last measurement is stale, ms; 2…500.
    pub stale_after_ms: u16,
    /// The nominal wearer, for feed-forward; without one there is none.
    pub wearer: Option<WearerModel>,
    /// How the nominal wearer answers in time and how that is corrected, for a
    /// predictor and a learning feed-forward; `None` for neither. The paper's law
    /// uses neither this nor the wearer.
    pub response: Option<ResponseSpec>,
}

/// A field of a [`JointSpec`], with a stable number for the wire.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
#[repr(u8)]
pub enum SpecField {
    /// λ of a sliding law.
    Lambda = 0,
    /// W of the paper's law.
    W = 1,
    /// k1 of the recommended law.
    K1 = 2,
    /// k2 of the recommended law.
    K2 = 3,
    /// b of the recommended law.
    B = 4,
    /// A PID's kp.
    Kp = 5,
    /// ki of a PID or of the recommended law.
    Ki = 6,
    /// A PID's kd.
    Kd = 7,
    /// `law_period_ms`.
    LawPeriod = 8,
    /// `cutoff_mhz`.
    Cutoff = 9,
    /// How many `flexors` there are.
    FlexorCount = 10,
    /// A point's `channel`.
    Channel = 11,
    /// A point's `threshold`.
    Threshold = 12,
    /// A point's `max`.
    Maximum = 13,
    /// `max_ms` of the extrapolation.
    Extrapolation = 14,
    /// `angle_min_mdeg`.
    AngleMin = 15,
    /// `angle_max_mdeg`.
    AngleMax = 16,
    /// `code_at_0`.
    CodeAt0 = 17,
    /// `code_at_100`.
    CodeAt100 = 18,
    /// How far `code_at_0` and `code_at_100` are apart.
    CodeSpan = 19,
    /// `stale_after_ms`.
    StaleAfter = 20,
    /// [`WearerModel::rest_mdeg`].
    Rest = 21,
    /// [`WearerModel::stiffness_unm_per_rad`].
    Stiffness = 22,
    /// [`WearerModel::damping_unm_s_per_rad`].
    Damping = 23,
    /// [`WearerModel::flexion_unm`].
    Flexion = 24,
    /// [`WearerModel::extension_unm`].
    Extension = 25,
    /// [`WearerModel::torque_loss_milli`].
    TorqueLoss = 26,
    /// [`WearerModel::curvature_milli`].
    Curvature = 27,
    /// [`WearerModel::lead_ms`].
    Lead = 28,
    /// k3 of the recommended law.
    K3 = 29,
    /// [`ResponseSpec::gain_mrad`].
    ResponseGain = 30,
    /// [`ResponseSpec::muscle_ms`].
    MuscleLag = 31,
    /// [`ResponseSpec::joint_ms`].
    JointLag = 32,
    /// [`ResponseSpec::delay_ms`].
    Delay = 33,
    /// [`ResponseSpec::scale_milli`].
    ScaleLearning = 34,
    /// [`ResponseSpec::damping_milli`].
    DampingLearning = 35,
}

/// Why a [`JointSpec`] was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SpecError {
    /// A field is outside what is allowed, given the fields before it.
    OutOfRange {
        /// Which field.
        field: SpecField,
        /// Lowest value allowed, in the field's own unit.
        min: i32,
        /// Highest value allowed, in the field's own unit.
        max: i32,
    },
    /// Two points name the same channel.
    ChannelTwice {
        /// That channel.
        channel: u8,
    },
}

/// Passes if `min <= value <= max`. Every bound of a caller fits i32.
pub(super) fn within(field: SpecField, value: u32, min: u32, max: u32) -> Result<(), SpecError> {
    if (min..=max).contains(&value) {
        return Ok(());
    }
    Err(SpecError::OutOfRange {
        field,
        min: min.cast_signed(),
        max: max.cast_signed(),
    })
}

/// Checks the lowest and the highest angle of a joint, m°.
pub(crate) fn check_angles(min: i32, max: i32) -> Result<(), SpecError> {
    const FULL: i32 = 180_000;
    if !(-FULL..FULL).contains(&min) {
        let field = SpecField::AngleMin;
        return Err(SpecError::OutOfRange {
            field,
            min: -FULL,
            max: FULL - 1,
        });
    }
    if max <= min || max > FULL {
        let field = SpecField::AngleMax;
        // min < FULL, so min + 1 cannot overflow.
        return Err(SpecError::OutOfRange {
            field,
            min: min + 1,
            max: FULL,
        });
    }
    Ok(())
}

impl JointSpec {
    /// Checks everything but the law, which [`JointSpec::law`] checks.
    pub(super) fn check(&self) -> Result<(), SpecError> {
        if let HoldPolicy::Extrapolate { max_ms } = self.hold {
            within(SpecField::Extrapolation, max_ms.into(), 1, 1000)?;
        }
        check_angles(self.angle_min_mdeg, self.angle_max_mdeg)
    }

    /// The validated law.
    pub(crate) fn law(&self) -> Result<Law, SpecError> {
        let (step_min, step_max) = (STEP_MIN_MS.into(), STEP_MAX_MS.into());
        within(
            SpecField::LawPeriod,
            self.law_period_ms.into(),
            step_min,
            step_max,
        )?;
        let cutoff = SpecError::OutOfRange {
            field: SpecField::Cutoff,
            min: CUTOFF_MIN_MHZ.cast_signed(),
            max: CUTOFF_MAX_MHZ.cast_signed(),
        };
        // The period is valid, so only the cutoff can be at fault.
        let differentiator =
            Differentiator::new(self.cutoff_mhz, self.law_period_ms).ok_or(cutoff)?;
        let response = self.response.map(|r| r.response(self.law_period_ms));
        Ok(Law {
            kind: self.law_kind()?,
            differentiator,
            response: response.transpose()?,
        })
    }

    fn law_kind(&self) -> Result<LawKind, SpecError> {
        use SpecField as F;
        /// 100 in thousandths: the highest gain of any law but b.
        const TOP: u32 = 100_000;
        let h = self.law_period_ms;
        match self.law {
            LawSpec::Paper {
                lambda_milli,
                w_milli,
            } => {
                within(F::Lambda, lambda_milli, 1, TOP)?;
                within(F::W, w_milli, 0, TOP)?;
                Ok(LawKind::Paper(Paper::new(lambda_milli, w_milli, h)))
            }
            LawSpec::Recommended {
                lambda_milli,
                k1_milli,
                k2_milli,
                b_milli,
                k3_milli,
                ki_milli,
            } => {
                within(F::Lambda, lambda_milli, 100, TOP)?;
                within(F::B, b_milli, 1000, 1_000_000)?;
                let k1_max = Twist::k1_max_milli(b_milli, h);
                within(F::K1, k1_milli, 1, k1_max)?;
                within(F::K2, k2_milli, 10, TOP)?;
                within(F::K3, k3_milli, 0, Twist::k3_max_milli(b_milli, h))?;
                within(F::Ki, ki_milli, 0, TOP)?;
                // All are in range, so there is a twist.
                let none = SpecError::OutOfRange {
                    field: F::K1,
                    min: 1,
                    max: k1_max.cast_signed(),
                };
                let twist = Twist::new(k1_milli, k2_milli, b_milli, k3_milli, h).ok_or(none)?;
                let law = Recommended::new(lambda_milli, ki_milli, twist, h);
                Ok(LawKind::Recommended(law))
            }
            LawSpec::Pid {
                kp_milli,
                ki_milli,
                kd_milli,
            } => {
                within(F::Kp, kp_milli, 0, TOP)?;
                within(F::Ki, ki_milli, 0, TOP)?;
                within(F::Kd, kd_milli, 0, TOP)?;
                Ok(LawKind::Pid(Pid::new(kp_milli, ki_milli, kd_milli, h)))
            }
        }
    }

    /// The validated points: effort to amplitudes.
    ///
    /// # Errors
    /// [`SpecError`] names the first offending field and what it allows.
    pub fn mapping(&self) -> Result<Mapping, SpecError> {
        // At most 2 by the type.
        within(SpecField::FlexorCount, self.flexors.len() as u32, 1, 2)?;
        let mut used = 0_u16;
        for point in self.flexors.iter().chain([&self.extensor]) {
            within(
                SpecField::Channel,
                point.channel.into(),
                0,
                CHANNEL_MAX.into(),
            )?;
            within(SpecField::Maximum, point.max.0, 0, AMPLITUDE_MAX)?;
            within(SpecField::Threshold, point.threshold.0, 0, point.max.0)?;
            // channel <= 9.
            let bit = 1_u16 << point.channel;
            if used & bit != 0 {
                return Err(SpecError::ChannelTwice {
                    channel: point.channel,
                });
            }
            used |= bit;
        }
        Ok(Mapping {
            flexors: self.flexors.clone(),
            extensor: self.extensor,
        })
    }
}
