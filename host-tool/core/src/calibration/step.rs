//! The steps of the procedure at one electrode, in their order.

use serde::{Deserialize, Serialize};

/// Step of the calibration of one electrode. The steps are carried out in this order.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Step {
    /// Placement: test pulses, while the electrode is moved until the right muscle contracts (Lee
    /// 2020, step 2).
    #[default]
    Placement,
    /// Search for the motor threshold, the lowest level that causes a movement. The level rises in
    /// small steps, and a movement must be seen twice (Lee 2020, step 3).
    Threshold,
    /// Search for the highest level that the wearer accepts.
    Comfort,
    /// Choice of the smallest level to use in sessions, by the operator (Sierotowicz 2023, comfort
    /// levels).
    Minimum,
    /// Choice of the largest level to use in sessions, by the operator.
    Maximum,
    /// Naming of the movements that the electrode causes.
    Points,
}

impl Step {
    /// All steps, in the order in which they are carried out.
    pub const ALL: [Self; 6] = [
        Self::Placement,
        Self::Threshold,
        Self::Comfort,
        Self::Minimum,
        Self::Maximum,
        Self::Points,
    ];

    /// Returns the name of the step in journals and JSON, for example "placement".
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

    /// Returns the question that the operator must answer after each presentation of the step.
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

    /// Returns what the operator has to do in the step, as an instruction.
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

    /// Returns the step after this one; `None` after the last step.
    #[must_use]
    pub fn next(self) -> Option<Self> {
        Self::ALL.into_iter().find(|step| *step > self)
    }
}
