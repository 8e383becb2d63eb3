//! The steps of the procedure at one electrode, in their order.

use serde::{Deserialize, Serialize};

/// A step at one electrode.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// A test pulse, so that the electrode can be moved until the right muscle
    /// contracts (Lee 2020, step 2).
    #[default]
    Placement,
    /// The lowest level that moves it, by small steps, twice (Lee 2020, step 3).
    Threshold,
    /// The highest level that the person accepts.
    Comfort,
    /// The least level in use, set by hand (Sierotowicz 2023, comfort levels).
    Minimum,
    /// The largest level in use, set by hand.
    Maximum,
    /// What the point moves.
    Points,
}

impl Step {
    /// All of them, in order.
    pub const ALL: [Self; 6] = [
        Self::Placement,
        Self::Threshold,
        Self::Comfort,
        Self::Minimum,
        Self::Maximum,
        Self::Points,
    ];

    /// As files and lines have it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Placement => "placement",
            Self::Threshold => "threshold",
            Self::Comfort => "comfort",
            Self::Minimum => "minimum",
            Self::Maximum => "maximum",
            Self::Points => "points",
        }
    }

    /// What is asked after each presentation.
    #[must_use]
    pub const fn question(self) -> &'static str {
        match self {
            Self::Placement => "does the right muscle contract clearly?",
            Self::Threshold => "did it move?",
            Self::Comfort => "does the wearer accept this?",
            Self::Minimum => "is this the minimum to work with?",
            Self::Maximum => "is this the maximum to work with?",
            Self::Points => "what did it move? (names, separated by commas)",
        }
    }

    /// What is done in it, for the operator.
    #[must_use]
    pub const fn task(self) -> &'static str {
        match self {
            Self::Placement => "move the electrode until the right muscle contracts",
            Self::Threshold => "raise until it moves for the first time",
            Self::Comfort => "raise until the wearer wants no more",
            Self::Minimum => "choose the least level to work with",
            Self::Maximum => "choose the largest level to work with",
            Self::Points => "give it once more and name what it moves",
        }
    }

    /// The step after it.
    #[must_use]
    pub fn next(self) -> Option<Self> {
        Self::ALL.into_iter().find(|step| *step > self)
    }
}
