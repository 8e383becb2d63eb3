//! The declaration of a threshold search, preregistered before it runs.

use super::milli::Milli;
use crate::statistics::Detector;
use serde::Deserialize;

/// Quantity that a search determines. A level is an amplitude or, for a ratio, a fraction.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Lowest level at which the joint moves by more than its noise at rest.
    Threshold,
    /// Lowest level at which the joint moves visibly, by at least `visible_deg`.
    Visible,
    /// Lowest fraction of the channels' `max` amplitudes, applied to all channels together, that
    /// moves the joint: r_th of Hamana 2022 §III-C1.
    Ratio,
    /// Highest level that the wearer finds comfortable, with a rating of at most `rating`. A level
    /// that is rated higher is repeated for confirmation.
    Comfort,
    /// Highest level that the wearer tolerates, with a rating of at most `rating`. A level that is
    /// rated higher is never repeated.
    Maximum,
}

impl Kind {
    /// Returns whether the wearer rates each level, so that no movement is judged.
    #[must_use]
    pub const fn is_rated(self) -> bool {
        matches!(self, Self::Comfort | Self::Maximum)
    }

    /// Returns the name as the declaration writes it.
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

/// Who or what decides whether the joint moved.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observer {
    /// The angle sensor, whose readings the detector judges.
    #[default]
    Sensor,
    /// The operator, who watches the joint and answers.
    Eye,
}

/// A channel of a ratio search.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Share {
    /// Number of the channel, from 1.
    pub channel: u8,
    /// Amplitude at ratio 1, in the channel's unit.
    pub max: f64,
}

/// Ratings of a simulated wearer. They rise linearly with the level, from 0 at `none` to 10 at
/// `ten`, with random noise, and are rounded.
#[derive(Clone, Copy, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rating {
    /// Level that is rated 0, in the channel's unit.
    pub none: f64,
    /// Level that is rated 10, in the channel's unit.
    pub ten: f64,
    /// Standard deviation of a rating, in points of the scale from 0 to 10.
    pub noise: f64,
}

impl Rating {
    /// Returns the rating of a level, 0 to 10; `deviate` is a standard normal random number that
    /// determines the noise.
    #[must_use]
    pub fn rate(&self, level: Milli, deviate: f64) -> u8 {
        let even = 10.0 * (level.units() - self.none) / (self.ten - self.none);
        (even + self.noise * deviate).round().clamp(0.0, 10.0) as u8
    }
}

/// A search as a `[[search]]` table of a file declares it.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SearchDeclaration {
    /// Quantity that the search determines.
    pub kind: Kind,
    /// Number of the stimulated channel, from 1; `None` for a ratio.
    pub channel: Option<u8>,
    /// Stimulated channels of a ratio; empty for other quantities.
    #[serde(default)]
    pub of: Vec<Share>,
    /// First level, in the channel's unit; for a ratio, as a fraction of `max`.
    pub start: f64,
    /// Difference between successive levels, in the unit of `start`.
    pub step: f64,
    /// Largest allowed level, in the unit of `start`.
    pub limit: f64,
    /// Number of measuring windows in a presentation, 1 to 100.
    #[serde(default = "five")]
    pub windows: u32,
    /// Length of a measuring window, ms, 10 to 1000.
    #[serde(default = "hundred")]
    pub window_ms: u32,
    /// Number of windows at the end of a rest that form the baseline, 5 to 100.
    #[serde(default = "ten")]
    pub baseline_windows: u32,
    /// Deviation from the baseline's mean that counts as movement, in standard deviations of the
    /// baseline, 1 to 20.
    #[serde(default = "four")]
    pub k_sigma: f64,
    /// Number of successive windows that must show movement, 1 to `windows`.
    #[serde(default = "three")]
    pub consecutive: u32,
    /// Number of times that a positive answer must recur at the same level, 0 to 5; ignored for a
    /// maximum.
    #[serde(default = "one")]
    pub confirm: u32,
    /// Time from setting a level to its first measuring window, ms, 0 to 5000. It covers the ramp
    /// of the amplitude and the rise of the force.
    #[serde(default = "four_hundred")]
    pub settle_ms: u32,
    /// Rest before each presentation, s, 0 to 600; the baseline is measured at its end.
    #[serde(default = "two")]
    pub rest_s: f64,
    /// Resolution of the angle sensor, °, 0 to 10.
    #[serde(default = "tenth")]
    pub resolution_deg: f64,
    /// Smallest movement that counts as visible, °, above 0 to 90; `None` if the search does not
    /// need it.
    pub visible_deg: Option<f64>,
    /// Who or what decides whether the joint moved. A simulated joint with a sensor always uses the
    /// sensor.
    #[serde(default)]
    pub observer: Observer,
    /// Highest rating that still counts as comfortable or tolerated, 0 to 9; `None` if nothing is
    /// rated.
    pub rating: Option<u8>,
    /// Ratings of the simulated wearer; `None` if a person rates.
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
    /// Returns the movement detector with the settings of this declaration.
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

    /// Returns whether the sensor must be read at rest before each presentation, to know its noise.
    #[must_use]
    pub fn needs_baseline(&self) -> bool {
        !self.kind.is_rated()
    }
}
