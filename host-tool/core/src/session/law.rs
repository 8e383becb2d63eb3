//! The control laws by name.

use firmware::control::{JointSpec, LawSpec};

pub(super) const LAWS: [(&str, LawName); 3] = [
    ("recommended", LawName::Recommended),
    ("paper", LawName::Paper),
    ("pid", LawName::Pid),
];

/// The control laws by name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LawName {
    /// Super-twisting with the wearer's model, or alone where the file has none.
    Recommended,
    /// Super-twisting as Hamana 2022 prints it, its sign corrected.
    Paper,
    /// Proportional, integral, derivative.
    Pid,
}

impl LawName {
    /// Its name in session files.
    #[must_use]
    pub fn name(self) -> &'static str {
        let found = LAWS.iter().find(|(_, law)| *law == self);
        found.map_or("", |(name, _)| name)
    }

    /// What it is, in a few words.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Recommended => {
                "Super-twisting with the wearer's model, or alone where the file has none"
            }
            Self::Paper => "Super-twisting as Hamana 2022 prints it, its sign corrected",
            Self::Pid => "Proportional, integral, derivative",
        }
    }

    /// All of them.
    pub const ALL: [Self; 3] = [Self::Recommended, Self::Paper, Self::Pid];

    /// The law of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let found = LAWS.iter().find(|(known, _)| *known == name);
        found.map(|(_, law)| *law)
    }

    /// The law with its default gains.
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

/// `spec` under another law, with that law's default gains, period and cutoff.
pub(super) fn with_law(spec: JointSpec, law: LawName) -> JointSpec {
    let law = law.spec(spec.wearer.is_some());
    let law = spec.wearer.map_or(law, |wearer| law.for_wearer(&wearer));
    JointSpec {
        law_period_ms: law.default_period_ms(),
        cutoff_mhz: law.default_cutoff_mhz(),
        law,
        ..spec
    }
}
