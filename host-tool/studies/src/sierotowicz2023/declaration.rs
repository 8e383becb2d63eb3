//! What is declared: `endpoint/study.toml`, committed before it was run.

use super::error::EndpointError;
use serde::Deserialize;

/// The declaration, as the program has it.
pub const DECLARED: &str = include_str!("../../../experiments/sierotowicz.toml");

/// All of it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// The page's heading.
    pub title: String,
    /// The paper.
    pub source: String,
    /// Of every draw.
    pub seed: u64,
    /// Studies of three participants each.
    pub replications: u64,
    /// What is done.
    pub protocol: Protocol,
    /// How currents' ranges are found.
    pub comfort: Comfort,
    /// How routing and gains are found.
    pub calibration: Calibration,
    /// How people aim.
    pub voluntary: Voluntary,
    /// What a device plays.
    pub played: DeviceCheckSpec,
    /// How a wanted force goes around.
    pub walk: WalkSpec,
    /// What predicts.
    pub regression: Regression,
    /// How switching is counted.
    pub switching: Switching,
    /// What is asked.
    pub claims: Claims,
    /// What is printed.
    pub paper: Paper,
}

/// What is done.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Sizes, as parts of what can be reached.
    pub magnitudes: Vec<f64>,
    /// Of each target.
    pub repetitions: usize,
    /// Of each direction by will.
    pub voluntary_repetitions: usize,
    /// How long a contraction lasts, s.
    pub contraction_s: f64,
    /// Then nothing, s.
    pub rest_s: f64,
    /// Of pulses.
    pub frequency_hz: f64,
    /// Of a phase.
    pub width_us: u32,
    /// Between conditions.
    pub pause_s: f64,
}

/// How currents' ranges are found, as parts of the true ones.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Comfort {
    /// Of the threshold.
    pub least: [f64; 2],
    /// Of full recruitment.
    pub greatest: [f64; 2],
}

/// How routing and gains are found.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// A twitch's train lasts so long, s.
    pub twitch_s: f64,
    /// Of each channel.
    pub twitches: usize,
    /// Between them, s.
    pub wait_s: f64,
    /// How long the greatest rate is looked for, s.
    pub watched_s: f64,
    /// How often at most another S1 is drawn where a channel of S1's does not twitch.
    pub substitutes: u64,
    /// Between twitches where the arm is waited for to rest, s.
    pub rested_s: f64,
}

/// How people aim.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Voluntary {
    /// Deviation of direction, degrees.
    pub direction_deg: f64,
    /// Of size, as a part.
    pub size: f64,
}

/// What a device plays.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceCheckSpec {
    /// Contractions of C3 of the first study's S2.
    pub targets: usize,
}

/// How a wanted force goes around.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkSpec {
    /// Once, s.
    pub turn_s: f64,
}

/// What predicts.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regression {
    /// Random features.
    pub features: usize,
    /// Over what distance of currents (parts of their ranges) a force changes.
    pub length_scale: f64,
    /// Of the ridge.
    pub ridge: f64,
    /// Parts of the cross-validation.
    pub folds: usize,
}

/// How switching is counted.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Switching {
    /// A jump, as a part of a channel's range.
    pub jump: f64,
}

/// What is asked.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claims {
    /// Of wearers.
    pub share: f64,
    /// Of intervals.
    pub level: f64,
}

/// What is printed.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paper {
    /// Diagonal of C2's matrices: mean and deviation.
    pub c2: [f64; 2],
    /// Of C3's.
    pub c3: [f64; 2],
    /// The best.
    pub best: f64,
    /// C3 against C2.
    pub cohens_d: f64,
    /// R² and normalised RMSE of the wrench.
    pub wrench: [f64; 2],
    /// Of joint torques.
    pub joints: [f64; 2],
}

impl Study {
    /// The program's own.
    ///
    /// # Errors
    /// E715: it cannot be read, or what of it cannot be.
    pub fn load_embedded() -> Result<Self, EndpointError> {
        Self::parse(DECLARED)
    }

    /// Of this text.
    ///
    /// # Errors
    /// As [`Self::load_embedded`].
    pub fn parse(text: &str) -> Result<Self, EndpointError> {
        let study: Self =
            toml::from_str(text).map_err(|e| EndpointError::Declaration(e.to_string()))?;
        let wrong = study.mistakes();
        match wrong.is_empty() {
            true => Ok(study),
            false => Err(EndpointError::Declaration(wrong.join("; "))),
        }
    }

    /// The same, but that each twitch of the calibration waits until the arm rests.
    #[must_use]
    pub fn rested(&self) -> Self {
        let mut rested = self.clone();
        rested.calibration.wait_s = self.calibration.rested_s;
        rested
    }

    /// Everything that cannot be.
    fn mistakes(&self) -> Vec<String> {
        let protocol = &self.protocol;
        let times = [
            ("protocol.contraction_s", protocol.contraction_s),
            ("protocol.rest_s", protocol.rest_s),
            ("protocol.frequency_hz", protocol.frequency_hz),
            ("calibration.twitch_s", self.calibration.twitch_s),
            ("calibration.watched_s", self.calibration.watched_s),
            ("calibration.rested_s", self.calibration.rested_s),
            ("walk.turn_s", self.walk.turn_s),
            ("regression.length_scale", self.regression.length_scale),
            ("regression.ridge", self.regression.ridge),
        ];
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        let mut wrong: Vec<String> = times
            .into_iter()
            .filter(|(_, value)| !is_positive(*value))
            .map(|(name, value)| format!("{name} is {value}, must be above zero"))
            .collect();
        if protocol.magnitudes.is_empty()
            || !protocol
                .magnitudes
                .iter()
                .all(|magnitude| (0.0..=1.0).contains(magnitude))
        {
            wrong.push("protocol.magnitudes must be parts of one".to_owned());
        }
        let counts = [
            ("replications", self.replications as usize, 1),
            ("protocol.repetitions", protocol.repetitions, 1),
            (
                "protocol.voluntary_repetitions",
                protocol.voluntary_repetitions,
                1,
            ),
            ("played.targets", self.played.targets, 1),
            ("calibration.twitches", self.calibration.twitches, 1),
            ("regression.features", self.regression.features, 1),
            ("regression.folds", self.regression.folds, 2),
        ];
        let few = counts.into_iter().filter(|(_, index, least)| index < least);
        wrong
            .extend(few.map(|(name, index, least)| format!("{name} is {index}, at least {least}")));
        for (name, [low, high]) in [
            ("comfort.least", self.comfort.least),
            ("comfort.greatest", self.comfort.greatest),
        ] {
            if !(0.0 < low && low <= high && high <= 1.0) {
                wrong.push(format!("{name} must rise within 0 to 1"));
            }
        }
        wrong
    }
}
