//! Refusals of the link. Every refusal has a number, a name, the offending field and the allowed
//! range. Numbers are stable; this file is the only list of them.

mod control;

use super::frame::FrameError;
use crate::pulse::{GroupError, TrainError, TrainSpec};
use crate::range::OutOfRange;
use crate::safety::{Denial, ListedPulse, MAX_TIMED, SetupError, StageMismatch, SumError, limits};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Reason for a refusal. docs/protocol.md explains how to respond to each.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[repr(u16)]
#[expect(missing_docs, reason = "docs/protocol.md explains each by its number")]
pub enum Code {
    BadCrc = 101,
    MalformedFrame = 102,
    FrameTooLong = 103,
    UnknownMessage = 104,
    SchemaMismatch = 110,
    NoSession = 111,
    SessionTaken = 112,
    DeviceBusy = 113,
    SimulatorOnly = 114,
    OutOfRange = 200,
    BurstOverlaps = 201,
    BurstTooLong = 202,
    CurrentLimit = 203,
    ChargeLimit = 204,
    RmsLimit = 205,
    AboveWearerLimit = 206,
    NoTrain = 210,
    TwoGroups = 211,
    IsolationOverlaps = 212,
    NoTimeToGround = 213,
    ChannelTwice = 214,
    Controlled = 215,
    AmplitudeCount = 216,
    NothingToArm = 217,
    JointAndWall = 218,
    RateChanges = 219,
    NoMuscle = 220,
    NoFatigue = 221,
    StagesUnknown = 222,
    OtherStage = 223,
    NoStageMemory = 224,
    OtherSetup = 225,
    HandStopOpen = 226,
    LoadTooLow = 229,
    PhaseLost = 230,
    DensityLimit = 232,
    SumLimit = 233,
    SumRmsLimit = 234,
    TimeOver = 235,
    DoseReached = 236,
    TooLargeStep = 237,
    ChargeAtWidth = 238,
    WidthChanges = 239,
    NoLists = 240,
    ListPlays = 241,
    NotRisen = 242,
    JointAndLimb = 243,
    JointAndModulation = 244,
    ShareLimit = 245,
    NoPhaseJoint = 246,
    OppositePhases = 248,
    AboveStart = 250,
    ListTooSteep = 251,
    CountedControlled = 252,
    WrongState = 300,
    NotArmed = 301,
    ArmInputOpen = 302,
    ElectrodeOff = 303,
    ElectrodeShort = 304,
    Cancelled = 305,
    FaultLatched = 306,
    Stopped = 307,
    AllowanceLost = 308,
    NoJoint = 310,
    SetpointTime = 311,
    MeasurementTime = 312,
    SensorNotHost = 313,
    NoForceControl = 314,
    ForceOutOfReach = 315,
    NoLimb = 316,
    WrenchOutOfReach = 317,
    NoMuscleHelps = 318,
    NoPosture = 319,
    NoModulation = 320,
    NoAngle = 321,
    HoldExpired = 322,
    TooFarAhead = 323,
    TooManyWaiting = 324,
    TimeGoesBack = 325,
    NoBootLoader = 326,
    InputsClosed = 327,
}

impl Code {
    /// All codes, for documentation and tests.
    pub const ALL: [Self; 81] = [
        Self::BadCrc,
        Self::MalformedFrame,
        Self::FrameTooLong,
        Self::UnknownMessage,
        Self::SchemaMismatch,
        Self::NoSession,
        Self::SessionTaken,
        Self::DeviceBusy,
        Self::SimulatorOnly,
        Self::OutOfRange,
        Self::BurstOverlaps,
        Self::BurstTooLong,
        Self::CurrentLimit,
        Self::ChargeLimit,
        Self::RmsLimit,
        Self::AboveWearerLimit,
        Self::NoTrain,
        Self::TwoGroups,
        Self::IsolationOverlaps,
        Self::NoTimeToGround,
        Self::ChannelTwice,
        Self::Controlled,
        Self::AmplitudeCount,
        Self::NothingToArm,
        Self::JointAndWall,
        Self::RateChanges,
        Self::NoMuscle,
        Self::NoFatigue,
        Self::StagesUnknown,
        Self::OtherStage,
        Self::NoStageMemory,
        Self::OtherSetup,
        Self::HandStopOpen,
        Self::LoadTooLow,
        Self::PhaseLost,
        Self::DensityLimit,
        Self::SumLimit,
        Self::SumRmsLimit,
        Self::TimeOver,
        Self::DoseReached,
        Self::TooLargeStep,
        Self::ChargeAtWidth,
        Self::WidthChanges,
        Self::NoLists,
        Self::ListPlays,
        Self::NotRisen,
        Self::JointAndLimb,
        Self::JointAndModulation,
        Self::ShareLimit,
        Self::NoPhaseJoint,
        Self::OppositePhases,
        Self::AboveStart,
        Self::ListTooSteep,
        Self::CountedControlled,
        Self::WrongState,
        Self::NotArmed,
        Self::ArmInputOpen,
        Self::ElectrodeOff,
        Self::ElectrodeShort,
        Self::Cancelled,
        Self::FaultLatched,
        Self::Stopped,
        Self::AllowanceLost,
        Self::NoJoint,
        Self::SetpointTime,
        Self::MeasurementTime,
        Self::SensorNotHost,
        Self::NoForceControl,
        Self::ForceOutOfReach,
        Self::NoLimb,
        Self::WrenchOutOfReach,
        Self::NoMuscleHelps,
        Self::NoPosture,
        Self::NoModulation,
        Self::NoAngle,
        Self::HoldExpired,
        Self::TooFarAhead,
        Self::TooManyWaiting,
        Self::TimeGoesBack,
        Self::NoBootLoader,
        Self::InputsClosed,
    ];

    /// Returns the code with this number, if there is one.
    #[must_use]
    pub fn from_number(number: u16) -> Option<Self> {
        Self::ALL.into_iter().find(|&code| code as u16 == number)
    }
}

/// A refusal on the link: number, field and allowed range.
///
/// ```
/// use firmware::link::{Code, Refusal};
/// use firmware::pulse::TrainSpec;
///
/// let too_wide = TrainSpec::WIDTH_US.check(501_u16).unwrap_err();
/// let refusal = Refusal::from(too_wide).with_channel(2);
/// assert_eq!(Code::from_number(refusal.code), Some(Code::OutOfRange));
/// assert_eq!((refusal.field, refusal.channel), ("width_us", Some(2)));
/// assert_eq!((refusal.min, refusal.max), (10, 500));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct Refusal<'a> {
    /// Number of the reason, from [`Code`].
    pub code: u16,
    /// Name on the link of the offending field or item.
    pub field: &'a str,
    /// Number of the affected channel, from 0; `None` if no single channel is concerned.
    pub channel: Option<u8>,
    /// Smallest allowed value; 0 if there is no range.
    pub min: i32,
    /// Largest allowed value; 0 if there is no range.
    pub max: i32,
}

impl Refusal<'static> {
    /// Creates a refusal without channel or range.
    #[must_use]
    pub const fn new(code: Code, field: &'static str) -> Self {
        Self {
            code: code as u16,
            field,
            channel: None,
            min: 0,
            max: 0,
        }
    }

    /// Returns the refusal with `channel`, counted from 0, as the affected channel.
    #[must_use]
    pub const fn with_channel(mut self, channel: u8) -> Self {
        self.channel = Some(channel);
        self
    }

    /// Returns the refusal with the smallest and the largest allowed value of the field.
    #[must_use]
    pub const fn with_range(mut self, min: i32, max: i32) -> Self {
        (self.min, self.max) = (min, max);
        self
    }
}

/// Converts a bound for the link, saturating: bounds are for information only.
fn bound(value: u32) -> i32 {
    i32::try_from(value).unwrap_or(i32::MAX)
}

impl From<FrameError> for Refusal<'static> {
    fn from(e: FrameError) -> Self {
        Self::new(
            match e {
                FrameError::Crc => Code::BadCrc,
                FrameError::Malformed => Code::MalformedFrame,
                FrameError::TooLong => Code::FrameTooLong,
            },
            "frame",
        )
    }
}

impl From<OutOfRange> for Refusal<'static> {
    fn from(e: OutOfRange) -> Self {
        Self::new(Code::OutOfRange, e.field).with_range(e.min, e.max)
    }
}

impl From<TrainError> for Refusal<'static> {
    fn from(e: TrainError) -> Self {
        match e {
            TrainError::Range(e) => e.into(),
            TrainError::BurstOverlaps { min_interval_us } => {
                Self::new(Code::BurstOverlaps, "burst_interval_us")
                    .with_range(bound(min_interval_us), TrainSpec::BURST_INTERVAL_US.max)
            }
            TrainError::BurstTooLong { min_period_us } => {
                Self::new(Code::BurstTooLong, "period_us")
                    .with_range(bound(min_period_us), TrainSpec::PERIOD_US.max)
            }
        }
    }
}

impl From<GroupError> for Refusal<'static> {
    fn from(e: GroupError) -> Self {
        let groups = |code, channel| Self::new(code, "groups").with_channel(channel);
        match e {
            GroupError::Members(e) => e.into(),
            GroupError::NoTrain { channel } => groups(Code::NoTrain, channel),
            GroupError::TwoGroups { channel } => groups(Code::TwoGroups, channel),
            GroupError::IsolationOverlaps { channel, .. } => {
                groups(Code::IsolationOverlaps, channel)
            }
            GroupError::NoTimeToGround { channel } => groups(Code::NoTimeToGround, channel),
            GroupError::RateChanges { channel } => groups(Code::RateChanges, channel),
        }
    }
}

impl From<StageMismatch> for Refusal<'static> {
    fn from(e: StageMismatch) -> Self {
        match e {
            StageMismatch::Unknown(_) => Self::new(Code::StagesUnknown, "stages"),
            StageMismatch::NoStage | StageMismatch::Kind => Self::new(Code::OtherStage, "stage"),
            StageMismatch::FullScale { field, has } => {
                Self::new(Code::OtherStage, field).with_range(bound(has), bound(has))
            }
        }
    }
}

impl From<SetupError> for Refusal<'static> {
    fn from(e: SetupError) -> Self {
        match e {
            SetupError::Range(e) => e.into(),
            SetupError::Train(e) => e.into(),
            SetupError::Group(e) => e.into(),
            SetupError::Stage(e) => e.into(),
            SetupError::Current { max } => {
                Self::new(Code::CurrentLimit, "limit").with_range(0, bound(max.get()))
            }
            SetupError::Charge { max_nc } => {
                Self::new(Code::ChargeLimit, "limit").with_range(0, bound(max_nc))
            }
            SetupError::Rms { max } => {
                Self::new(Code::RmsLimit, "limit").with_range(0, bound(max.get()))
            }
            SetupError::Density { max } => {
                Self::new(Code::DensityLimit, "area_mm2").with_range(0, bound(max.get()))
            }
            SetupError::Sum(e) => e.into(),
            SetupError::Opposed { channel, other } => Self::new(Code::OppositePhases, "supply")
                .with_channel(channel)
                .with_range(other.into(), other.into()),
        }
    }
}

impl From<SumError> for Refusal<'static> {
    fn from(e: SumError) -> Self {
        let (code, sum, max) = match e {
            SumError::Peak { sum, max } => (Code::SumLimit, sum, max),
            SumError::Rms { sum, max } => (Code::SumRmsLimit, sum, max),
        };
        Self::new(code, "limit").with_range(bound(sum.get()), bound(max.get()))
    }
}

impl From<Denial> for Refusal<'static> {
    fn from(e: Denial) -> Self {
        match e {
            Denial::WrongState(_) => Self::new(Code::WrongState, "state"),
            Denial::FaultLatched(fault) => {
                let number = i32::from(fault.number());
                Self::new(Code::FaultLatched, "fault").with_range(number, number)
            }
            Denial::ArmInputOpen => Self::new(Code::ArmInputOpen, "arm input"),
            Denial::HandStopOpen => Self::new(Code::HandStopOpen, "hand_stop_required"),
            Denial::ElectrodeOff { channel } => {
                Self::new(Code::ElectrodeOff, "electrode").with_channel(channel)
            }
            Denial::ElectrodeShort { channel } => {
                Self::new(Code::ElectrodeShort, "electrode").with_channel(channel)
            }
            Denial::PhaseLost { channel } => {
                Self::new(Code::PhaseLost, "electrode").with_channel(channel)
            }
            Denial::Together(e) => e.into(),
            Denial::LoadTooLow { channel, ohm } => Self::new(Code::LoadTooLow, "load_ohm")
                .with_channel(channel)
                .with_range(bound(ohm), bound(ohm)),
            Denial::Cancelled => Self::new(Code::Cancelled, "arm"),
            Denial::Stopped => Self::new(Code::Stopped, "stop"),
            Denial::Busy => Self::new(Code::DeviceBusy, "device"),
            Denial::NotArmed => Self::new(Code::NotArmed, "state"),
            Denial::NoChannel { channel } => {
                Self::new(Code::NoTrain, "channel").with_channel(channel)
            }
            Denial::Controlled { channel } => {
                Self::new(Code::Controlled, "channel").with_channel(channel)
            }
            Denial::TimeOver { max_s } => {
                Self::new(Code::TimeOver, "max_session_s").with_range(0, bound(max_s))
            }
            Denial::DoseReached { channel, max_mc } => {
                let refusal = Self::new(Code::DoseReached, "max_dose_mc").with_channel(channel);
                refusal.with_range(0, bound(max_mc))
            }
            Denial::AllowanceLost => Self::new(Code::AllowanceLost, "max_session_s"),
            Denial::TooFarAhead => {
                Self::new(Code::TooFarAhead, "at").with_range(0, bound(limits::AHEAD_US))
            }
            Denial::TooManyWaiting => {
                Self::new(Code::TooManyWaiting, "at").with_range(0, MAX_TIMED as i32) // 16
            }
            Denial::TimeGoesBack { least_us } => Self::new(Code::TimeGoesBack, "at")
                .with_range(bound(least_us), bound(limits::AHEAD_US)),
            Denial::TooLargeStep { channel, highest } => Self::new(Code::TooLargeStep, "values")
                .with_channel(channel)
                .with_range(0, bound(highest.get())),
            Denial::Width {
                channel,
                min_us,
                max_us,
            } => Self::new(Code::OutOfRange, "widths")
                .with_channel(channel)
                .with_range(min_us.into(), max_us.into()),
            Denial::ListedWidth {
                channel,
                min_us,
                max_us,
            } => Self::new(Code::OutOfRange, "width_us")
                .with_channel(channel)
                .with_range(min_us.into(), max_us.into()),
            Denial::Listed { channel, least_us } => {
                let range = ListedPulse::AFTER_US.with_min_at_least(least_us);
                Self::new(Code::OutOfRange, range.field)
                    .with_channel(channel)
                    .with_range(range.min, range.max)
            }
            Denial::NoLists { channel } => Self::new(Code::NoLists, "lists").with_channel(channel),
            Denial::ListPlays => Self::new(Code::ListPlays, "pulses"),
            Denial::NotRisen { channel } => {
                Self::new(Code::NotRisen, "pulses").with_channel(channel)
            }
            Denial::Charge { channel, highest } => Self::new(Code::ChargeAtWidth, "max_charge_nc")
                .with_channel(channel)
                .with_range(0, bound(highest.get())),
            // The number of pulses that would be below the start, and the amplitude that would be
            // allowed.
            Denial::AboveStart {
                channel,
                pulses,
                start,
            } => Self::new(Code::AboveStart, "start")
                .with_channel(channel)
                .with_range(bound(pulses), bound(start.get())),
            Denial::ListedSlope { channel, highest } => Self::new(Code::ListTooSteep, "amplitude")
                .with_channel(channel)
                .with_range(0, bound(highest.get())),
            Denial::AboveLimit { channel, limit } => Self::new(Code::AboveWearerLimit, "values")
                .with_channel(channel)
                .with_range(0, bound(limit.get())),
        }
    }
}
