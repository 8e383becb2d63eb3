//! Amplitudes in the resolution of files and link.

use firmware::units::Amplitude;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Amplitude in thousandths of the channel's unit, mA or V: exactly the number that the protocol
/// transmits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize)]
#[serde(into = "f64", try_from = "f64")]
pub struct Level(pub u32);

impl Level {
    /// Returns the level of this many mA or V, or `None` if the number is not between 0 and 100 or
    /// not a whole number of thousandths.
    #[must_use]
    pub fn from_units(units: f64) -> Option<Self> {
        let milli = (units * 1e3).round();
        let is_whole = (milli - units * 1e3).abs() < 1e-6;
        (is_whole && (0.0..=1e5).contains(&milli)).then_some(Self(milli as u32))
    }

    /// Returns the level as a number of mA or V.
    #[must_use]
    pub fn units(self) -> f64 {
        f64::from(self.0) / 1e3
    }

    /// Returns the sum of this level and `step`.
    #[must_use]
    pub const fn saturating_add(self, step: Self) -> Self {
        Self(self.0.saturating_add(step.0))
    }

    /// Returns this level minus `step`, or 0 if the difference would be negative.
    #[must_use]
    pub const fn saturating_sub(self, step: Self) -> Self {
        Self(self.0.saturating_sub(step.0))
    }

    /// Returns the level in the type of the protocol.
    #[must_use]
    pub const fn amplitude(self) -> Amplitude {
        Amplitude::new(self.0)
    }
}

impl From<Level> for f64 {
    fn from(level: Level) -> Self {
        level.units()
    }
}

impl TryFrom<f64> for Level {
    type Error = String;

    fn try_from(units: f64) -> Result<Self, String> {
        Self::from_units(units)
            .ok_or_else(|| format!("a level is {units}; allowed: 0 to 100 in steps of 0.001"))
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.units())
    }
}
