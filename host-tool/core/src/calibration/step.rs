//! The steps of the procedure at one electrode, in their order.

use serde::{Deserialize, Serialize};

/// Step of the calibration of one electrode.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// Test pulses, so that the electrode can be moved until the right muscle contracts (Lee 2020,
    /// step 2).
    #[default]
    Placement,
    /// Search for the lowest level that causes movement, by small steps, twice (Lee 2020, step 3).
    Threshold,
    /// Search for the highest level that the person accepts.
    Comfort,
    /// Choice of the smallest level in use, set by hand (Sierotowicz 2023, comfort levels).
    Minimum,
    /// Choice of the largest level in use, set by hand.
    Maximum,
    /// Naming of the movements that the point causes.
    Points,
}

impl Step {
    /// All steps, in their order.
    pub const ALL: [Self; 6] = [
        Self::Placement,
        Self::Threshold,
        Self::Comfort,
        Self::Minimum,
        Self::Maximum,
        Self::Points,
    ];

    /// Returns the name of the step in files and lines of JSON.
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

    /// Returns the question that is asked after each presentation.
    #[must_use]
    pub const fn question(self) -> &'static str {
        match self {
            Self::Placement => "does the right muscle contract clearly?",
            Self::Threshold => "did you see a movement?",
            Self::Comfort => "does the wearer accept this?",
            Self::Minimum => "is this the lowest level to use?",
            Self::Maximum => "is this the highest level to use?",
            Self::Points => "what moved? (names, separated by commas)",
        }
    }

    /// Returns the task of the step, addressed to the operator.
    #[must_use]
    pub const fn task(self) -> &'static str {
        match self {
            Self::Placement => "move the electrode until the right muscle contracts",
            Self::Threshold => "raise until you see the first movement",
            Self::Comfort => "raise until the wearer does not want a higher level",
            Self::Minimum => "choose the lowest level to use",
            Self::Maximum => "choose the highest level to use",
            Self::Points => "give the level once more and name what moves",
        }
    }

    /// Returns the following step; `None` after the last.
    #[must_use]
    pub fn next(self) -> Option<Self> {
        Self::ALL.into_iter().find(|step| *step > self)
    }
}
