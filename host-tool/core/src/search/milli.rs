//! Represents levels of a staircase exactly.

use serde::{Serialize, Serializer};
use std::fmt;

/// A level in thousandths of a channel's unit (mA or V), or of 1 for a ratio.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct Milli(pub u32);

impl Milli {
    /// Converts a number in the channel's unit; returns `None` if it is negative, above 4 · 10⁶, or
    /// not a whole number of thousandths.
    #[must_use]
    pub fn exactly(value: f64) -> Option<Self> {
        let thousandths = (value * 1e3).round();
        let is_whole = (0.0..=4e9).contains(&thousandths) && thousandths / 1e3 == value;
        is_whole.then_some(Self(thousandths as u32))
    }

    /// Returns the level in the channel's unit, or a ratio as a fraction.
    #[must_use]
    pub fn units(self) -> f64 {
        f64::from(self.0) / 1e3
    }

    /// Returns `whole` multiplied by this ratio, rounded down.
    #[must_use]
    pub fn fraction_of(self, whole: Self) -> Self {
        let part = u64::from(self.0) * u64::from(whole.0) / 1000;
        Self(u32::try_from(part).unwrap_or(u32::MAX))
    }
}

impl fmt::Display for Milli {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.units(), f)
    }
}

impl Serialize for Milli {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.units())
    }
}

#[cfg(test)]
mod tests {
    use super::Milli;

    #[test]
    fn what_is_written_is_what_is_meant() {
        for milli in (0..200_000).step_by(7) {
            let text = format!("{}.{:03}", milli / 1000, milli % 1000);
            assert_eq!(Milli::exactly(text.parse().unwrap()), Some(Milli(milli)));
        }
        for value in [-0.1, 0.0005, 28.1001, f64::NAN, f64::INFINITY, 5e6] {
            assert_eq!(Milli::exactly(value), None, "{value}");
        }
        assert_eq!(Milli(28_100).to_string(), "28.1");
        assert_eq!(Milli(700).fraction_of(Milli(28_100)), Milli(19_670));
    }
}
