//! What is wrong with a setup, by part and rule; and its number on the wire.

use crate::control::SpecError;
use crate::haptics::{ModulationError, WallError};
use crate::link::{Code, Refusal};
use crate::muscle::LadderError;
use crate::range::OutOfRange;
use crate::safety::SetupError;
use crate::units::Amplitude;

/// A rule that a part of a setup breaks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mistake {
    /// Which part is at fault.
    pub part: Part,
    /// What it breaks.
    pub rule: Rule,
}

/// A part of a setup. Channels count from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Part {
    /// The whole.
    Setup,
    /// The wearer's limits.
    Wearer,
    /// A channel's train, stage or limit; with force control its highest and lowest
    /// rate as well.
    Channel(u8),
    /// A channel's muscle.
    Muscle(u8),
    /// A channel's force control.
    Force(u8),
    /// The groups; the rule names the channel.
    Groups,
    /// Sync out.
    Sync,
    /// The joint; the rule names the point by its channel.
    Joint,
    /// The wall; the same.
    Wall,
    /// The arm.
    Limb,
    /// The line of action of a channel's muscle.
    Line(u8),
    /// A joint whose stimulation follows its angle, by its number; the rule names the
    /// channel.
    Modulation(u8),
}

/// What a part of a setup can break.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Rule {
    /// A field is out of its range.
    Range(OutOfRange),
    /// A channel or a group breaks a limit.
    Setup(SetupError),
    /// A muscle cannot be modelled.
    Muscle(LadderError),
    /// A joint cannot be controlled.
    Joint(SpecError),
    /// A wall cannot be made felt.
    Wall(WallError),
    /// A joint's stimulation cannot follow its angle.
    Modulation(ModulationError),
    /// No channel is configured.
    NothingToArm,
    /// It uses a channel without a train.
    NoTrain {
        /// That channel.
        channel: u8,
    },
    /// It may ask for more than its channel's limit.
    AboveLimit {
        /// That channel.
        channel: u8,
        /// Which of the part's fields asks.
        field: &'static str,
        /// The channel's limit.
        limit: Amplitude,
    },
    /// There is a joint already, and the device measures one angle.
    JointAndWall {
        /// A channel of both, if any.
        shared: Option<u8>,
    },
    /// A muscle under pulses whose width may change: how amplitude recruits it holds at
    /// one width.
    WidthChanges,
    /// Force control without a muscle.
    NoMuscle,
    /// Force control or a line of a channel that something else drives.
    Controlled,
    /// A train of a fixed number of pulses on a channel that something drives whose
    /// amplitudes rise.
    CountedControlled,
    /// Lines without an arm.
    NoLimb,
    /// There is a joint or a wall, and a measurement would be of both.
    JointAndLimb,
    /// There is a joint, a wall or an arm, and a measurement would be of both.
    JointAndModulation,
    /// The joint that is to tell the phase is none of the setup's.
    NoPhaseJoint {
        /// Its number.
        joint: u8,
    },
}

impl Mistake {
    /// Makes a part's errors its mistakes.
    pub(super) fn of<R: Into<Rule>>(part: Part) -> impl FnOnce(R) -> Self {
        move |rule| Self {
            part,
            rule: rule.into(),
        }
    }
}

impl From<OutOfRange> for Rule {
    fn from(e: OutOfRange) -> Self {
        Self::Range(e)
    }
}

impl From<SetupError> for Rule {
    fn from(e: SetupError) -> Self {
        Self::Setup(e)
    }
}

impl From<LadderError> for Rule {
    fn from(e: LadderError) -> Self {
        Self::Muscle(e)
    }
}

impl From<SpecError> for Rule {
    fn from(e: SpecError) -> Self {
        Self::Joint(e)
    }
}

impl From<ModulationError> for Rule {
    fn from(e: ModulationError) -> Self {
        Self::Modulation(e)
    }
}

impl From<WallError> for Rule {
    fn from(e: WallError) -> Self {
        Self::Wall(e)
    }
}

impl Part {
    /// Its name where a refusal has no field to name.
    const fn name(self) -> &'static str {
        match self {
            Self::Force(_) => "force",
            Self::Sync => "sync",
            Self::Joint => "joint",
            Self::Wall => "wall",
            Self::Limb => "limb",
            Self::Line(_) => "line",
            Self::Modulation(_) => "modulation",
            _ => "channels",
        }
    }
}

impl From<Mistake> for Refusal<'static> {
    fn from(Mistake { part, rule }: Mistake) -> Self {
        let named = |code| Self::new(code, part.name());
        let refusal: Self = match rule {
            Rule::Range(e) => e.into(),
            Rule::Setup(e) => e.into(),
            Rule::Muscle(e) => e.into(),
            Rule::Joint(e) => e.into(),
            Rule::Wall(e) => e.into(),
            Rule::Modulation(e) => e.into(),
            Rule::NothingToArm => named(Code::NothingToArm),
            Rule::NoTrain { channel } => named(Code::NoTrain).on(channel),
            Rule::AboveLimit {
                channel,
                field,
                limit,
            } => {
                let max = i32::try_from(limit.get()).unwrap_or(i32::MAX);
                let refusal = Self::new(Code::AboveWearerLimit, field);
                refusal.on(channel).allowed(0, max)
            }
            Rule::JointAndWall { shared } => {
                let refusal = named(Code::JointAndWall);
                shared.map_or(refusal, |channel| refusal.on(channel))
            }
            Rule::WidthChanges => Self::new(Code::WidthChanges, "max_width_us"),
            Rule::NoMuscle => Self::new(Code::NoMuscle, "muscle"),
            Rule::Controlled => named(Code::Controlled),
            Rule::CountedControlled => Self::new(Code::CountedControlled, "repeats"),
            Rule::NoLimb => named(Code::NoLimb),
            Rule::JointAndLimb => named(Code::JointAndLimb),
            Rule::JointAndModulation => named(Code::JointAndModulation),
            Rule::NoPhaseJoint { joint } => {
                Self::new(Code::NoPhaseJoint, "phase_joint").allowed(joint.into(), joint.into())
            }
        };
        match part {
            Part::Channel(channel)
            | Part::Muscle(channel)
            | Part::Force(channel)
            | Part::Line(channel) => refusal.on(channel),
            _ => refusal,
        }
    }
}
