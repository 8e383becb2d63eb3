//! Control laws of a joint, and their names in session files.

use firmware::control::{Joint, JointSpec, LawSpec, SpecError, WearerModel};
use firmware::range::OutOfRange;

use crate::fields::decimal::{format_range, format_scaled};
use crate::fields::{Problem, SessionError};

pub(super) const LAWS: [(&str, LawName); 3] = [
    ("recommended", LawName::Recommended),
    ("paper", LawName::Paper),
    ("pid", LawName::Pid),
];

/// Control law of a joint, by its name in session files.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LawName {
    /// Super-twisting with the project's gains. The gains depend on whether the file has a model of
    /// the wearer.
    Recommended,
    /// Super-twisting as printed in Hamana 2022, with its sign corrected.
    Paper,
    /// Proportional, integral and derivative control.
    Pid,
}

impl LawName {
    /// Returns the name of the control law in session files, for example "pid".
    #[must_use]
    pub fn name(self) -> &'static str {
        let found = LAWS.iter().find(|(_, law)| *law == self);
        found.map_or("", |(name, _)| name)
    }

    /// Returns the name of the controller in tables, charts and sentences, for example "PID
    /// controller".
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::Recommended => "default controller",
            Self::Paper => "paper's controller",
            Self::Pid => "PID controller",
        }
    }

    /// Returns a short description of the control law for legends and headings.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Recommended => "Default controller: super-twisting",
            Self::Paper => "Paper's controller: Hamana 2022, sign corrected",
            Self::Pid => "PID controller",
        }
    }

    /// All control laws, the recommended one first.
    pub const ALL: [Self; 3] = [Self::Recommended, Self::Paper, Self::Pid];

    /// Returns the control law that has this name in session files, or `None` if the name is
    /// unknown.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let found = LAWS.iter().find(|(known, _)| *known == name);
        found.map(|(_, law)| *law)
    }

    /// Returns the control law with its default gains. `has_wearer` is whether the session has a
    /// model of the wearer, on which the gains may depend.
    #[must_use]
    pub const fn spec(self, has_wearer: bool) -> LawSpec {
        match self {
            Self::Recommended if has_wearer => LawSpec::RECOMMENDED,
            Self::Recommended => LawSpec::ALONE,
            Self::Paper => LawSpec::PAPER,
            Self::Pid => LawSpec::PID,
        }
    }
}

/// Returns `spec` with another control law, and with the default gains, period and cutoff of that
/// law. Fails if the device refuses the new law for the wearer model of `spec`.
pub(super) fn with_law(spec: JointSpec, law: LawName) -> Result<JointSpec, SessionError> {
    let law = law.spec(spec.wearer.is_some());
    let law = spec.wearer.map_or(law, |wearer| law.for_wearer(&wearer));
    let spec = JointSpec {
        law_period_ms: law.default_period_ms(),
        cutoff_mhz: law.default_cutoff_mhz(),
        law,
        ..spec
    };
    let flexion_unm = spec.wearer.map_or(0, |wearer| wearer.flexion_unm);
    let refused = match Joint::new(&spec) {
        Err(SpecError::Range(e)) => untried_stiffness(e, flexion_unm),
        _ => None, // nothing else depends on the law
    };
    refused.map_or(Ok(spec), |problem| {
        Err(SessionError::without_place(problem))
    })
}

/// Returns the problem of a stiffness that is allowed by itself, but not together with the flexion
/// torque `flexion_unm`. Returns `None` if `e` is about another value.
pub(super) fn untried_stiffness(e: OutOfRange, flexion_unm: u32) -> Option<Problem> {
    let own = WearerModel::STIFFNESS_UNM_PER_RAD;
    let is_its = e.field == own.field && (e.min, e.max) != (own.min, own.max);
    is_its.then(|| Problem::NeverTried {
        flexion_nm: format_scaled(flexion_unm.into(), 6),
        stiffness: format_scaled(e.value, 6),
        allowed: format_range(e.min.into(), e.max.into(), 6),
    })
}
