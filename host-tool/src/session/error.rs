//! What can be wrong with a session file, and where in it.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, Severity, SourceCode};

/// Everything a session file is refused for. This is the only list of the
/// numbers E400–E499; they are stable. `field` is the path of the field in the
/// file, `given` what stands there, `allowed` what may stand there.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[expect(missing_docs, reason = "each message explains its fields")]
pub enum Problem {
    #[error("the session file cannot be read: {reason}")]
    Unreadable { reason: String },
    #[error("not valid TOML: {reason}")]
    Syntax { reason: String },
    #[error("there is no field `{field}`")]
    UnknownField {
        field: String,
        close: Option<String>,
        known: String,
    },
    #[error("`{field}` must be {expected}, not {given}")]
    WrongType {
        field: String,
        expected: &'static str,
        given: &'static str,
    },
    #[error("`{field}` is missing")]
    MissingField { field: String },
    #[error("`{field}` is {given}: the device counts in steps of {step}")]
    NotExact {
        field: String,
        given: String,
        step: String,
    },
    #[error("`{field}` is {given}, which is no finite number of at most 38 digits")]
    NotFinite { field: String, given: String },
    #[error("`{field}` is {given}, allowed is {allowed}")]
    OutOfRange {
        field: String,
        given: String,
        allowed: String,
    },
    #[error("`{field}` cannot be {given}")]
    UnknownChoice {
        field: String,
        given: String,
        close: Option<String>,
        known: String,
    },
    #[error("`{field}` and `{other}` say the same: give one of them")]
    SaidTwice { field: String, other: String },
    #[error("`{field}` is {given}, but it must come after {after}")]
    NotInOrder {
        field: String,
        given: String,
        after: String,
    },
    #[error("channel {channel} is named twice in `{field}`")]
    ChannelTwice { field: String, channel: u8 },
    #[error("`{field}` names channel {channel}, which the file does not have")]
    NoSuchChannel { field: String, channel: u8 },
    #[error("channel {channel} is in two groups")]
    TwoGroups { channel: u8 },
    #[error(
        "channels {channel} and {other} cannot isolate each other: their pulses overlap at some time"
    )]
    IsolationOverlaps { channel: u8, other: u8 },
    #[error(
        "channel {channel} has no time to ground: isolation interrupts it, and no unbroken \
         `ground_us` remains before its next pulse"
    )]
    NoTimeToGround { channel: u8 },
    #[error("pulses of a burst overlap: `{field}` must be at least {min_us} µs")]
    BurstOverlaps { field: String, min_us: u32 },
    #[error("a burst runs into the next one: the period must be at least {min_us} µs")]
    BurstTooLong { field: String, min_us: u32 },
    #[error("`{field}` = {given} is {current_ma} mA, allowed are {max_ma} mA")]
    CurrentLimit {
        field: String,
        given: String,
        current_ma: f64,
        max_ma: String,
    },
    #[error("at `{field}` = {given} ({current_ma} mA) one phase exceeds {max_uc} µC")]
    ChargeLimit {
        field: String,
        given: String,
        current_ma: f64,
        max_uc: String,
    },
    #[error("at `{field}` = {given} ({current_ma} mA) the train exceeds {max_ma} mA rms")]
    RmsLimit {
        field: String,
        given: String,
        current_ma: f64,
        max_ma: String,
    },
    #[error("`{field}` is {given}, above channel {channel}'s limit of {limit}")]
    AboveChannelLimit {
        field: String,
        given: String,
        channel: u8,
        limit: String,
    },
    #[error("`{field}` names channel {channel}, which the joint or the wall drives")]
    Controlled { field: String, channel: u8 },
    #[error("`{field}` names channel {channel}, which is under force control")]
    ForceControlled { field: String, channel: u8 },
    #[error("`{field}` names channel {channel}, which has no `force`")]
    NoForceControl { field: String, channel: u8 },
    #[error("channel {channel} has a `force` and no `muscle` to find it with")]
    NoMuscle { channel: u8 },
    #[error(
        "channel {channel} may change its pulse rate, and is in an isolated group, whose pulses \
         would then meet"
    )]
    RateChanges { channel: u8 },
    #[error(
        "`{field}` is {given} N: within its limits channel {channel} gives 0 N, and from {min_n} to \
         {max_n} N"
    )]
    OutOfReach {
        field: String,
        given: String,
        channel: u8,
        min_n: f64,
        max_n: f64,
    },
    #[error("{wanted} needs a `[joint]`, and the file has none")]
    NoJoint { wanted: &'static str },
    #[error("a `[joint]` and a `[wall]` cannot run together: the device measures one angle")]
    JointAndWall,
    #[error(
        "`{field}` is {given}: setpoints would be further apart than the {timeout_ms} ms of silence that end stimulation"
    )]
    TooSlow {
        field: String,
        given: String,
        timeout_ms: u16,
    },
    #[error("`{field}` is calcium-force-fatigue, but nothing says how the muscle tires")]
    NoFatigue { field: String },
    #[error("no channel has a `muscle`, so there is nothing to choose by")]
    NothingToFit,
    #[error("no channel waits for a trigger, so `[simulated_trigger]` would start nothing")]
    NothingTriggered,
}

impl Problem {
    /// The stable number, 400–499.
    #[must_use]
    pub const fn number(&self) -> u16 {
        match self {
            Self::Unreadable { .. } => 400,
            Self::Syntax { .. } => 401,
            Self::UnknownField { .. } => 402,
            Self::WrongType { .. } => 403,
            Self::MissingField { .. } => 404,
            Self::NotExact { .. } => 405,
            Self::NotFinite { .. } => 406,
            Self::OutOfRange { .. } => 407,
            Self::UnknownChoice { .. } => 408,
            Self::SaidTwice { .. } => 409,
            Self::NotInOrder { .. } => 410,
            Self::ChannelTwice { .. } => 420,
            Self::NoSuchChannel { .. } => 421,
            Self::TwoGroups { .. } => 430,
            Self::IsolationOverlaps { .. } => 431,
            Self::NoTimeToGround { .. } => 432,
            Self::BurstOverlaps { .. } => 440,
            Self::BurstTooLong { .. } => 441,
            Self::CurrentLimit { .. } => 450,
            Self::ChargeLimit { .. } => 451,
            Self::RmsLimit { .. } => 452,
            Self::AboveChannelLimit { .. } => 453,
            Self::Controlled { .. } => 460,
            Self::NoJoint { .. } => 461,
            Self::TooSlow { .. } => 462,
            Self::OutOfReach { .. } => 470,
            Self::NoForceControl { .. } => 471,
            Self::NoMuscle { .. } => 472,
            Self::RateChanges { .. } => 473,
            Self::ForceControlled { .. } => 474,
            Self::JointAndWall => 480,
            Self::NoFatigue { .. } => 463,
            Self::NothingToFit => 464,
            Self::NothingTriggered => 465,
        }
    }

    /// What to do about it, where the message does not say so.
    fn help(&self) -> Option<String> {
        Some(match self {
            Self::UnknownField { close, known, .. } | Self::UnknownChoice { close, known, .. } => {
                match close {
                    Some(close) => format!("did you mean `{close}`? Possible here: {known}"),
                    None => format!("possible here: {known}"),
                }
            }
            Self::IsolationOverlaps { .. } => {
                "give them the same period and offsets at least a pulse width apart, or set \
                 partner = \"conducted\""
                    .into()
            }
            Self::NoTimeToGround { .. } => {
                "move the offsets further apart, shorten `ground_us`, or give all members the same \
                 period"
                    .into()
            }
            Self::ChargeLimit { .. } => "lower the limit or the pulse width".into(),
            Self::RmsLimit { .. } => {
                "lower the limit, the pulse width, the frequency or the number of pulses in a burst"
                    .into()
            }
            Self::RateChanges { .. } => {
                "leave `force.max_frequency_hz` and `force.min_frequency_hz` out, or set partner = \
                 \"conducted\""
                    .into()
            }
            Self::OutOfReach { .. } => {
                "ask for less, or raise the channel's `limit` or its `force.max_frequency_hz`"
                    .into()
            }
            Self::JointAndWall => "keep one of them".into(),
            Self::NoFatigue { .. } => {
                "give the muscle `fatigue`; `fatigue = {}` takes the quadriceps' of Ding 2003"
                    .into()
            }
            Self::NothingToFit => "give the channels a `muscle`, or leave `[fidelity]` out".into(),
            Self::NothingTriggered => {
                "give a channel's train `triggered = true`, or leave `[simulated_trigger]` out"
                    .into()
            }
            Self::TooSlow { .. } => "raise it, or `wearer.host_timeout_ms`".into(),
            _ => return None,
        })
    }

    /// What is written under the place in the file.
    fn label(&self) -> String {
        match self {
            Self::UnknownField { .. } => "unknown".into(),
            Self::WrongType { expected, .. } => format!("expected {expected}"),
            Self::MissingField { .. } => "missing from here".into(),
            Self::OutOfRange { allowed, .. } => allowed.clone(),
            _ => "here".into(),
        }
    }
}

/// A refused session file: what is wrong, in which file, and where.
///
/// Rendered by `miette`; [`fmt::Display`] gives the bare message.
#[derive(Clone)]
pub struct SessionError(Box<Inner>);

#[derive(Clone)]
struct Inner {
    problem: Problem,
    code: String,
    file: Option<NamedSource<Arc<str>>>,
    label: Option<LabeledSpan>,
}

impl SessionError {
    /// A problem at `span` (bytes) of a file's text.
    pub(super) fn at(problem: Problem, name: &str, text: &Arc<str>, span: Range<usize>) -> Self {
        let label = LabeledSpan::new_primary_with_span(Some(problem.label()), span);
        Self(Box::new(Inner {
            code: format!("E{}", problem.number()),
            file: Some(NamedSource::new(name, Arc::clone(text))),
            label: Some(label),
            problem,
        }))
    }

    /// A problem that has no place in a text.
    pub(super) fn nowhere(problem: Problem) -> Self {
        Self(Box::new(Inner {
            code: format!("E{}", problem.number()),
            file: None,
            label: None,
            problem,
        }))
    }

    /// Number, file, line, column, problem and help in one line, for machines.
    #[must_use]
    pub fn one_line(&self) -> String {
        let Inner {
            problem,
            code,
            file,
            label,
        } = &*self.0;
        let place = file.as_ref().zip(label.as_ref()).map(|(file, label)| {
            let before = file.inner().get(..label.offset()).unwrap_or_default();
            let line = before.matches('\n').count() + 1;
            let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
            format!("{}:{line}:{column}: ", file.name())
        });
        let help = problem.help().map(|help| format!("; {help}"));
        format!(
            "{code} {}{problem}{}",
            place.unwrap_or_default(),
            help.unwrap_or_default()
        )
    }

    /// What is wrong.
    #[must_use]
    pub fn problem(&self) -> &Problem {
        &self.0.problem
    }
}

impl fmt::Display for SessionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.problem.fmt(f)
    }
}

impl fmt::Debug for SessionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {:?}", self.0.code, self.0.problem)
    }
}

impl std::error::Error for SessionError {}

impl Diagnostic for SessionError {
    fn code(&self) -> Option<Box<dyn fmt::Display + '_>> {
        Some(Box::new(&self.0.code))
    }

    fn severity(&self) -> Option<Severity> {
        Some(Severity::Error)
    }

    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        let help = self.0.problem.help()?;
        Some(Box::new(help))
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.file.as_ref().map(|file| file as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let label = self.0.label.clone()?;
        Some(Box::new(std::iter::once(label)))
    }
}
