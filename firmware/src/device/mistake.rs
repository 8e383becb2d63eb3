//! Mistakes in a setup, by part and rule, and their error codes in the protocol.

use crate::control::SpecError;
use crate::haptics::{ModulationError, WallError};
use crate::link::{Code, Refusal};
use crate::muscle::MuscleModelError;
use crate::range::OutOfRange;
use crate::safety::SetupError;
use crate::units::Amplitude;

/// A rule that a part of a setup breaks, with the part.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mistake {
    /// The part at fault.
    pub part: Part,
    /// The rule that the part breaks.
    pub rule: Rule,
}

/// A part of a setup, named in a [`Mistake`]. Channels count from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Part {
    /// The setup as a whole.
    Setup,
    /// The wearer's limits.
    Wearer,
    /// A channel's train, stage or limit; with force control also its highest and lowest pulse
    /// rate.
    Channel(u8),
    /// A channel's muscle.
    Muscle(u8),
    /// A channel's force control.
    Force(u8),
    /// The groups; the rule names the channel.
    Groups,
    /// The channel of the sync output.
    Sync,
    /// The controlled joint; the rule names the point by its channel.
    Joint,
    /// The virtual wall; the rule names the channel.
    Wall,
    /// The arm whose hand exerts a wanted force.
    Limb,
    /// The line of action of a channel's muscle.
    Line(u8),
    /// A joint whose stimulation follows its angle, by its number; the rule names the channel.
    Modulation(u8),
}

/// A rule that a part of a setup can break.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Rule {
    /// A field is outside its range.
    Range(OutOfRange),
    /// A channel or a group breaks a limit.
    Setup(SetupError),
    /// A muscle cannot be modelled.
    Muscle(MuscleModelError),
    /// A joint cannot be controlled.
    Joint(SpecError),
    /// A virtual wall cannot be rendered.
    Wall(WallError),
    /// A joint's stimulation cannot follow its angle.
    Modulation(ModulationError),
    /// No channel is configured, so there is nothing to arm.
    NothingToArm,
    /// The part uses a channel without a train.
    NoTrain {
        /// The channel without a train, from 0.
        channel: u8,
    },
    /// The part may ask for an amplitude above its channel's limit.
    AboveLimit {
        /// The channel whose limit is exceeded, from 0.
        channel: u8,
        /// Name of the part's field that exceeds the limit.
        field: &'static str,
        /// The channel's limit, in the stage's thousandths.
        limit: Amplitude,
    },
    /// The setup has both a joint and a wall, but the device measures only one angle.
    JointAndWall {
        /// A channel that both use, from 0; `None` if there is none.
        shared: Option<u8>,
    },
    /// The pulse width may change on a channel with a muscle model, but the recruitment by
    /// amplitude holds for only one width.
    WidthChanges,
    /// A channel has force control but no muscle.
    NoMuscle,
    /// A channel has force control or a line of action, but another controller drives it.
    Controlled,
    /// A controller, whose amplitudes rise gradually, drives a channel whose train has a fixed
    /// number of pulses.
    CountedControlled,
    /// Lines of action are configured without an arm.
    NoLimb,
    /// The setup has an arm beside a joint or a wall, so that it would be ambiguous to which a
    /// measurement belongs.
    JointAndLimb,
    /// The setup has a joint whose stimulation follows its angle beside a joint, a wall or an arm,
    /// so that it would be ambiguous to which a measurement belongs.
    JointAndModulation,
    /// The joint that determines the phase is not part of the setup.
    NoPhaseJoint {
        /// Number of the missing joint.
        joint: u8,
    },
}

impl Mistake {
    /// Returns a function that converts an error of this part into a mistake.
    pub(super) fn in_part<R: Into<Rule>>(part: Part) -> impl FnOnce(R) -> Self {
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

impl From<MuscleModelError> for Rule {
    fn from(e: MuscleModelError) -> Self {
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
    /// Returns the part's name, for refusals without a field.
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
            Rule::NoTrain { channel } => named(Code::NoTrain).with_channel(channel),
            Rule::AboveLimit {
                channel,
                field,
                limit,
            } => {
                let max = i32::try_from(limit.get()).unwrap_or(i32::MAX);
                let refusal = Self::new(Code::AboveWearerLimit, field);
                refusal.with_channel(channel).with_range(0, max)
            }
            Rule::JointAndWall { shared } => {
                let refusal = named(Code::JointAndWall);
                shared.map_or(refusal, |channel| refusal.with_channel(channel))
            }
            Rule::WidthChanges => Self::new(Code::WidthChanges, "max_width_us"),
            Rule::NoMuscle => Self::new(Code::NoMuscle, "muscle"),
            Rule::Controlled => named(Code::Controlled),
            Rule::CountedControlled => Self::new(Code::CountedControlled, "repeats"),
            Rule::NoLimb => named(Code::NoLimb),
            Rule::JointAndLimb => named(Code::JointAndLimb),
            Rule::JointAndModulation => named(Code::JointAndModulation),
            Rule::NoPhaseJoint { joint } => {
                Self::new(Code::NoPhaseJoint, "phase_joint").with_range(joint.into(), joint.into())
            }
        };
        match part {
            Part::Channel(channel)
            | Part::Muscle(channel)
            | Part::Force(channel)
            | Part::Line(channel) => refusal.with_channel(channel),
            _ => refusal,
        }
    }
}
