//! What a search is to look for, and how: written before it runs.

use super::milli::Milli;
use host_core::statistics::Detector;
use serde::Deserialize;

/// What is looked for.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The lowest level that moves the joint beyond its noise.
    Threshold,
    /// The lowest level that moves it visibly, by at least `visible_deg`.
    Visible,
    /// The lowest part of all channels' `max`, given together, that moves the joint:
    /// r_th of Hamana 2022 §III-C1.
    Ratio,
    /// The highest level that the person rates `rating` or less; a higher rating is
    /// asked for again.
    Comfort,
    /// The same of what the person bears; what was too much is never given again.
    Maximum,
}

impl Kind {
    /// Whether the person rates each level.
    #[must_use]
    pub const fn is_rated(self) -> bool {
        matches!(self, Self::Comfort | Self::Maximum)
    }

    /// As declared.
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

/// Who says whether the joint moved.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observer {
    /// The angle sensor, by the detector.
    #[default]
    Sensor,
    /// The operator, who watches it.
    Eye,
}

/// Channel of a ratio, and the level that its part is of.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Share {
    /// From 1.
    pub channel: u8,
    /// In the channel's unit.
    pub max: f64,
}

/// How a simulated person rates: evenly from 0 at one level to 10 at another, rounded.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rating {
    /// Level rated 0, in the channel's unit.
    pub none: f64,
    /// Level rated 10.
    pub ten: f64,
    /// Standard deviation of one rating, 0 to 10.
    pub noise: f64,
}

impl Rating {
    /// The rating of a level, 0 to 10, with this normal deviate.
    #[must_use]
    pub fn rate(&self, level: Milli, deviate: f64) -> u8 {
        let even = 10.0 * (level.units() - self.none) / (self.ten - self.none);
        (even + self.noise * deviate).round().clamp(0.0, 10.0) as u8
    }
}

/// A `[[search]]` as its file has it.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchDeclaration {
    /// What is looked for.
    pub kind: Kind,
    /// The channel, from 1; not for a ratio.
    pub channel: Option<u8>,
    /// The channels of a ratio.
    #[serde(default)]
    pub of: Vec<Share>,
    /// First level, in the channel's unit; in a ratio, part of `max`.
    pub start: f64,
    /// From level to level.
    pub step: f64,
    /// No level is above it.
    pub limit: f64,
    /// Windows of a presentation, 1 to 100.
    #[serde(default = "five")]
    pub windows: u32,
    /// Length of each, ms, 10 to 1000.
    #[serde(default = "hundred")]
    pub window_ms: u32,
    /// Windows of the rest before, 5 to 100.
    #[serde(default = "ten")]
    pub baseline_windows: u32,
    /// Standard deviations of the baseline, 1 to 20.
    #[serde(default = "four")]
    pub k_sigma: f64,
    /// Windows in a row beyond them, 1 to `windows`.
    #[serde(default = "three")]
    pub consecutive: u32,
    /// How often what is found must come again at the same level, 0 to 5; not for a
    /// maximum.
    #[serde(default = "one")]
    pub confirm: u32,
    /// From a level to its first window, ms, 0 to 5000: ramp and rise of force.
    #[serde(default = "four_hundred")]
    pub settle_ms: u32,
    /// Rest before each presentation, s, 0 to 600, baseline included.
    #[serde(default = "two")]
    pub rest_s: f64,
    /// The sensor's step, 0 to 10°.
    #[serde(default = "tenth")]
    pub resolution_deg: f64,
    /// Least visible movement, above 0 to 90°.
    pub visible_deg: Option<f64>,
    /// Who sees it; not asked where a simulated joint has a sensor.
    #[serde(default)]
    pub observer: Observer,
    /// Highest rating that is still comfortable, or borne, 0 to 9.
    pub rating: Option<u8>,
    /// Who rates where there is no person.
    pub simulated_rating: Option<Rating>,
}

/// Defaults of [`SearchDeclaration`]: serde wants functions.
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
    /// When a movement counts.
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

    /// Whether the sensor's noise at rest counts.
    #[must_use]
    pub fn needs_baseline(&self) -> bool {
        !self.kind.is_rated()
    }
}
