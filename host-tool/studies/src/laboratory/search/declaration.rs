//! The declaration of a threshold search, preregistered before it runs.

use super::milli::Milli;
use host_core::statistics::Detector;
use serde::Deserialize;

/// Quantity that a search determines.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Lowest level that moves the joint beyond its noise.
    Threshold,
    /// Lowest level that moves the joint visibly, by at least `visible_deg`.
    Visible,
    /// Lowest fraction of all channels' `max`, applied together, that moves the joint: r_th of
    /// Hamana 2022 §III-C1.
    Ratio,
    /// Highest level that the wearer rates `rating` or less; a higher rating is asked for again.
    Comfort,
    /// Highest level that the wearer tolerates, by the same rating; a level that was too high is
    /// never repeated.
    Maximum,
}

impl Kind {
    /// Returns whether the wearer rates each level.
    #[must_use]
    pub const fn is_rated(self) -> bool {
        matches!(self, Self::Comfort | Self::Maximum)
    }

    /// Returns the name as written in the declaration.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Threshold => "threshold",
            Self::Visible => "visible",
            Self::Ratio => "ratio",
            Self::Comfort => "comfort",
            Self::Maximum => "maximum",
        }
    }
}

/// Source of the decision whether the joint moved.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observer {
    /// The angle sensor, evaluated by the detector.
    #[default]
    Sensor,
    /// The operator, who watches the joint.
    Eye,
}

/// Channel of a ratio search, and the level to which the ratio applies.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Share {
    /// Number of the channel, from 1.
    pub channel: u8,
    /// Level at ratio 1, in the channel's unit.
    pub max: f64,
}

/// Ratings of a simulated wearer, linear from 0 at one level to 10 at another, and rounded.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rating {
    /// Level rated 0, in the channel's unit.
    pub none: f64,
    /// Level rated 10, in the channel's unit.
    pub ten: f64,
    /// Standard deviation of one rating, 0 to 10.
    pub noise: f64,
}

impl Rating {
    /// Returns the rating of a level, 0 to 10, given a standard normal deviate.
    #[must_use]
    pub fn rate(&self, level: Milli, deviate: f64) -> u8 {
        let even = 10.0 * (level.units() - self.none) / (self.ten - self.none);
        (even + self.noise * deviate).round().clamp(0.0, 10.0) as u8
    }
}

/// A `[[search]]` table as written in a file.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchDeclaration {
    /// Quantity to determine.
    pub kind: Kind,
    /// Stimulated channel, from 1; none for a ratio.
    pub channel: Option<u8>,
    /// Stimulated channels of a ratio.
    #[serde(default)]
    pub of: Vec<Share>,
    /// First level, in the channel's unit; for a ratio, as a fraction of `max`.
    pub start: f64,
    /// Difference between successive levels.
    pub step: f64,
    /// Upper bound of the levels.
    pub limit: f64,
    /// Number of windows per presentation, 1 to 100.
    #[serde(default = "five")]
    pub windows: u32,
    /// Length of each window, ms, 10 to 1000.
    #[serde(default = "hundred")]
    pub window_ms: u32,
    /// Number of windows of the rest before a presentation, 5 to 100.
    #[serde(default = "ten")]
    pub baseline_windows: u32,
    /// Threshold of the detector in standard deviations of the baseline, 1 to 20.
    #[serde(default = "four")]
    pub k_sigma: f64,
    /// Number of successive windows beyond the threshold, 1 to `windows`.
    #[serde(default = "three")]
    pub consecutive: u32,
    /// Number of times that the result must recur at the same level, 0 to 5; not for a maximum.
    #[serde(default = "one")]
    pub confirm: u32,
    /// Time from setting a level to its first window, ms, 0 to 5000: ramp and rise of force.
    #[serde(default = "four_hundred")]
    pub settle_ms: u32,
    /// Rest before each presentation, s, 0 to 600, baseline included.
    #[serde(default = "two")]
    pub rest_s: f64,
    /// Resolution of the sensor, 0 to 10°.
    #[serde(default = "tenth")]
    pub resolution_deg: f64,
    /// Smallest visible movement, above 0 to 90°.
    pub visible_deg: Option<f64>,
    /// Source of the decision about movement; ignored if a simulated joint has a sensor.
    #[serde(default)]
    pub observer: Observer,
    /// Highest rating that is still comfortable or tolerated, 0 to 9.
    pub rating: Option<u8>,
    /// Ratings of a simulated wearer, if there is no real one.
    pub simulated_rating: Option<Rating>,
}

/// Defines default values of [`SearchDeclaration`] as functions, as serde requires.
macro_rules! defaults {
    ($($name:ident: $type:ty = $value:expr;)*) => {
        $(const fn $name() -> $type { $value })*
    };
}
defaults! {
    one: u32 = 1; three: u32 = 3; five: u32 = 5; ten: u32 = 10; hundred: u32 = 100;
    four_hundred: u32 = 400; tenth: f64 = 0.1; two: f64 = 2.0; four: f64 = 4.0;
}

impl SearchDeclaration {
    /// Returns the detector, with these settings, that decides whether the joint moved.
    #[must_use]
    pub fn detector(&self) -> Detector {
        Detector {
            windows: self.windows,
            baseline: self.baseline_windows,
            k_sigma: self.k_sigma,
            consecutive: self.consecutive,
            visible: self.visible_deg.unwrap_or(0.0),
            resolution: self.resolution_deg,
        }
    }

    /// Returns whether the search needs the sensor's noise at rest.
    #[must_use]
    pub fn needs_baseline(&self) -> bool {
        !self.kind.is_rated()
    }
}
