//! Conversion of the errors of controllers, walls, force control, arms and modulated joints into
//! refusals.

use super::{Code, Refusal, bound};
use crate::control::{
    Endpoint, ForceError, ForceImpossible, MeasurementError, SetpointError, SpecError, WrenchError,
};
use crate::haptics::{HoldError, ModulationError, QuarticSpec, WallError};
use crate::limb::AXIS_NAMES;

impl From<crate::muscle::MuscleModelError> for Refusal<'static> {
    fn from(e: crate::muscle::MuscleModelError) -> Self {
        match e {
            crate::muscle::MuscleModelError::Range(e) => e.into(),
            crate::muscle::MuscleModelError::NoFatigue => Self::new(Code::NoFatigue, "fatigue"),
        }
    }
}

impl From<SpecError> for Refusal<'static> {
    fn from(e: SpecError) -> Self {
        match e {
            SpecError::Range(e) => e.into(),
            SpecError::ChannelTwice { channel } => {
                Self::new(Code::ChannelTwice, "joint").with_channel(channel)
            }
        }
    }
}

impl From<WallError> for Refusal<'static> {
    fn from(e: WallError) -> Self {
        match e {
            WallError::Range(e) => e.into(),
            WallError::ChannelTwice { channel } => {
                Self::new(Code::ChannelTwice, "wall").with_channel(channel)
            }
        }
    }
}

impl From<ModulationError> for Refusal<'static> {
    fn from(e: ModulationError) -> Self {
        match e {
            ModulationError::Range(e) => e.into(),
            ModulationError::ChannelTwice { channel } => {
                Self::new(Code::ChannelTwice, "modulation").with_channel(channel)
            }
            ModulationError::Share {
                channel,
                phase,
                extreme,
            } => {
                let reached = extreme.millionths();
                let max_share = QuarticSpec::SHARE.max;
                let bound = if reached < 0 { 0 } else { max_share };
                let refusal = Self::new(Code::ShareLimit, phase.field()).with_channel(channel);
                refusal.with_range(reached, bound)
            }
        }
    }
}

impl From<HoldError> for Refusal<'static> {
    fn from(e: HoldError) -> Self {
        match e {
            HoldError::NoAngle { joint } => {
                let joint = i32::from(joint);
                Self::new(Code::NoAngle, "joint").with_range(joint, joint)
            }
            HoldError::Expired => Self::new(Code::HoldExpired, "held"),
        }
    }
}

impl From<SetpointError> for Refusal<'static> {
    fn from(e: SetpointError) -> Self {
        match e {
            SetpointError::OutOfRange { min_mdeg, max_mdeg } => {
                // The hundredths of a degree inside the range; |m°| <= 180 000.
                let (min, max) = ((min_mdeg + 9).div_euclid(10), max_mdeg.div_euclid(10));
                Self::new(Code::OutOfRange, "centideg").with_range(min, max)
            }
            SetpointError::TooFarAhead
            | SetpointError::TooOld
            | SetpointError::OutOfOrder
            | SetpointError::TooManyWaiting => Self::new(Code::SetpointTime, "at"),
        }
    }
}

impl From<ForceError> for Refusal<'static> {
    fn from(e: ForceError) -> Self {
        match e {
            // Besides this range, zero is always possible.
            ForceError::OutOfReach { min_mn, max_mn } => {
                let refusal = Self::new(Code::ForceOutOfReach, "millinewton");
                refusal.with_range(bound(min_mn), bound(max_mn))
            }
            ForceError::Setpoint(e) => e.into(),
        }
    }
}

impl From<WrenchError> for Refusal<'static> {
    fn from(e: WrenchError) -> Self {
        let field = Endpoint::FORCE_MN.field;
        match e {
            WrenchError::Setpoint(e) => e.into(),
            WrenchError::Unmade(ForceImpossible::Posture(range)) => range.into(),
            WrenchError::Unmade(ForceImpossible::NoPosture { axis }) => {
                let name = AXIS_NAMES.get(usize::from(axis)).copied();
                Self::new(Code::NoPosture, name.unwrap_or_default())
            }
            WrenchError::Unmade(ForceImpossible::NoMuscleHelps) => {
                Self::new(Code::NoMuscleHelps, field)
            }
            WrenchError::Unmade(ForceImpossible::TooStrong { channel, permille }) => {
                let refusal = Self::new(Code::WrenchOutOfReach, field).with_channel(channel);
                refusal.with_range(0, permille.into())
            }
        }
    }
}

impl From<MeasurementError> for Refusal<'static> {
    fn from(e: MeasurementError) -> Self {
        match e {
            MeasurementError::NotFromHost => Self::new(Code::SensorNotHost, "sensor"),
            MeasurementError::InTheFuture | MeasurementError::OutOfOrder => {
                Self::new(Code::MeasurementTime, "at")
            }
        }
    }
}
