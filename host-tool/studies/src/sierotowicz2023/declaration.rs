//! Reads the preregistered declaration `host-tool/experiments/sierotowicz.toml`.

use super::error::EndpointError;
use serde::Deserialize;

/// Text of the declaration `host-tool/experiments/sierotowicz.toml`.
pub const DECLARED: &str = include_str!("../../../experiments/sierotowicz.toml");

/// Content of the declaration `sierotowicz.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Heading of the report page.
    pub title: String,
    /// Paper on which the study is based.
    pub source: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of studies with three participants each.
    pub replications: u64,
    /// Commands and timing of a condition.
    pub protocol: Protocol,
    /// Comfortable currents, as random fractions of the true ranges.
    pub comfort: Comfort,
    /// Twitches from which routing and gains are calibrated.
    pub calibration: Calibration,
    /// Accuracy of voluntary pushes.
    pub voluntary: Voluntary,
    /// Part of the study that a device plays.
    pub played: DeviceCheckSpec,
    /// Reference force that moves around a circle.
    pub walk: WalkSpec,
    /// Regression for table 1.
    pub regression: Regression,
    /// Rule by which sudden changes of the recruitment are counted.
    pub switching: Switching,
    /// Preregistered expectation, and confidence level of intervals.
    pub claims: Claims,
    /// Values that the paper prints.
    pub paper: Paper,
}

/// Commands and timing of a condition.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Magnitudes of the forces, as fractions of the reachable force.
    pub magnitudes: Vec<f64>,
    /// Number of repetitions of each command.
    pub repetitions: usize,
    /// Number of voluntary pushes in each direction.
    pub voluntary_repetitions: usize,
    /// Duration of a contraction, s.
    pub contraction_s: f64,
    /// Rest after a contraction, s.
    pub rest_s: f64,
    /// Pulse rate, Hz.
    pub frequency_hz: f64,
    /// Width of one phase, µs.
    pub width_us: u32,
    /// Pause between conditions, s.
    pub pause_s: f64,
}

/// Comfortable currents, as random fractions of the true ranges.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Comfort {
    /// Range of the smallest comfortable current, as fractions of the true threshold.
    pub least: [f64; 2],
    /// Range of the largest comfortable current, as fractions of the current of full recruitment.
    pub greatest: [f64; 2],
}

/// Twitches from which routing and gains are calibrated.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration {
    /// Duration of a twitch's train, s.
    pub twitch_s: f64,
    /// Number of twitches of each channel.
    pub twitches: usize,
    /// Wait from the end of [`Self::watched_s`] to the next twitch, s.
    pub wait_s: f64,
    /// Time from the start of a twitch in which its largest turning rate is searched, s.
    pub watched_s: f64,
    /// Largest number of substitutes for S1 if a channel of S1 does not twitch.
    pub substitutes: u64,
    /// Value of [`Self::wait_s`] in the variant in which the arm comes to rest between twitches, s.
    pub rested_s: f64,
}

/// Accuracy of voluntary pushes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Voluntary {
    /// Standard deviation of the direction, °.
    pub direction_deg: f64,
    /// Relative standard deviation of the magnitude.
    pub size: f64,
}

/// Part of the study that a device plays.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DeviceCheckSpec {
    /// Number of contractions that the device plays, from C3 of S2 in the first study.
    pub targets: usize,
}

/// Reference force that moves around a circle.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WalkSpec {
    /// Duration of one round, s.
    pub turn_s: f64,
}

/// Parameters of the regression for table 1, which predicts forces and torques from currents.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Regression {
    /// Number of random features.
    pub features: usize,
    /// Length scale of the features, as a fraction of the currents' ranges: the distance over which
    /// a force changes.
    pub length_scale: f64,
    /// Regularisation of the ridge regression.
    pub ridge: f64,
    /// Number of folds in the cross-validation.
    pub folds: usize,
}

/// Rule by which sudden changes of the recruitment are counted.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Switching {
    /// Smallest change that counts as a jump, as a fraction of a muscle's largest force.
    pub jump: f64,
}

/// Preregistered expectation, and confidence level of intervals.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claims {
    /// Share of wearers in which the calibration is expected to help.
    pub share: f64,
    /// Confidence level of the intervals.
    pub level: f64,
}

/// Values that the paper prints.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paper {
    /// Mean and standard deviation of the diagonal of C2's correlation matrices.
    pub c2: [f64; 2],
    /// Mean and standard deviation of the diagonal of C3's correlation matrices.
    pub c3: [f64; 2],
    /// Largest coefficient on the diagonal of a correlation matrix.
    pub best: f64,
    /// Cohen's d of C3's diagonal coefficients against those of C2.
    pub cohens_d: f64,
    /// R² and normalised RMSE of the wrench.
    pub wrench: [f64; 2],
    /// R² and normalised RMSE of the joint torques.
    pub joints: [f64; 2],
}

impl Study {
    /// Parses the declaration `sierotowicz.toml` that is part of the program.
    ///
    /// # Errors
    /// Returns E715 if the declaration cannot be parsed or has invalid values.
    pub fn load_embedded() -> Result<Self, EndpointError> {
        Self::parse(DECLARED)
    }

    /// Parses and checks the text of a declaration.
    ///
    /// # Errors
    /// Fails like [`Self::load_embedded`].
    pub fn parse(text: &str) -> Result<Self, EndpointError> {
        let study: Self =
            toml::from_str(text).map_err(|e| EndpointError::Declaration(e.to_string()))?;
        let wrong = study.mistakes();
        match wrong.is_empty() {
            true => Ok(study),
            false => Err(EndpointError::Declaration(wrong.join("; "))),
        }
    }

    /// Returns the study with a calibration in which each twitch waits until the arm is at rest.
    #[must_use]
    pub fn rested(&self) -> Self {
        let mut rested = self.clone();
        rested.calibration.wait_s = self.calibration.rested_s;
        rested
    }

    /// Describes all invalid values of the declaration; empty if there are none.
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
            .map(|(name, value)| format!("{name} is {value}; allowed: finite and above 0"))
            .collect();
        if protocol.magnitudes.is_empty()
            || !protocol
                .magnitudes
                .iter()
                .all(|magnitude| (0.0..=1.0).contains(magnitude))
        {
            wrong.push("protocol.magnitudes must be one or more fractions from 0 to 1".to_owned());
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
        wrong.extend(
            few.map(|(name, index, least)| format!("{name} is {index}; allowed: {least} or more")),
        );
        for (name, [low, high]) in [
            ("comfort.least", self.comfort.least),
            ("comfort.greatest", self.comfort.greatest),
        ] {
            if !(0.0 < low && low <= high && high <= 1.0) {
                wrong.push(format!(
                    "{name} must be two numbers [low, high] with 0 < low <= high <= 1"
                ));
            }
        }
        wrong
    }
}
