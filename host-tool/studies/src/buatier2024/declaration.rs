//! Defines the study's declaration, `host-tool/experiments/buatier.toml`, committed before the
//! first run.

use super::error::LiftError;
use crate::laboratory::Range;
use serde::{Deserialize, Serialize};

/// Text of the built-in declaration.
pub const DECLARED: &str = include_str!("../../../experiments/buatier.toml");
/// Number of target heights.
pub const HEIGHTS: usize = 3;

/// Content of the declaration `buatier.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Heading of the page.
    pub title: String,
    /// The paper that the study replicates.
    pub source: String,
    /// Seed of every draw.
    pub seed: u64,
    /// Number of simulated studies.
    pub studies: u64,
    /// Number of participants and trials, stimulation, and significance level.
    pub protocol: Protocol,
    /// Positions of the hands.
    pub way: Places,
    /// Object update rate and added inertia of the exoskeleton.
    pub scene: ExoskeletonSpec,
    /// Settings of the device and of the activation model.
    pub model: Model,
    /// Sampling and filtering of the recorded movement.
    pub judged: MovementCriteria,
    /// Settings of the sensitivity analysis.
    pub deciding: Deciding,
    /// Random ranges of a participant's parameters.
    #[serde(rename = "range")]
    pub ranges: Vec<Range>,
    /// Statements of the paper that are judged.
    #[serde(rename = "claim")]
    pub claims: Vec<Claim>,
    /// Means that the paper prints.
    pub printed: Vec<PrintedMean>,
}

/// Number of participants and trials, stimulation, and significance level.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Number of participants in a study.
    pub persons: usize,
    /// Number of target sets in a condition; the first is not judged.
    pub target_sets: usize,
    /// Number of lifts in a target set.
    pub repetitions: usize,
    /// Pulse rate, Hz.
    pub frequency_hz: u32,
    /// Width of one phase of a pulse, µs.
    pub width_us: u32,
    /// Significance level of the tests.
    pub level: f64,
}

/// Positions of the hands, as fractions of the arm's reach.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Places {
    /// Start position on the table, forward and up from the shoulder.
    pub start: [f64; 2],
    /// Forward distance from the shoulder to the point above the target.
    pub over_x: f64,
    /// Height of the point [`Self::over_x`] above the target.
    pub over_z: f64,
    /// Forward distance from the shoulder to the target.
    pub target_x: f64,
    /// Target heights, as fractions of the reach.
    pub heights: [Height; HEIGHTS],
    /// Duration of the return to the table, s.
    pub return_s: f64,
}

/// A target height.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Height {
    pub name: String,
    /// Height above the shoulder, as a fraction of the reach.
    pub z: f64,
}

/// Properties of the exoskeleton and its virtual object.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExoskeletonSpec {
    /// Update rate of the object and of its god-objects, the points at which the hands hold it, Hz.
    pub object_hz: u32,
    /// Inertia that the exoskeleton adds at elbow and shoulder, kg m².
    pub added_inertia_kg_m2: [f64; 2],
}

/// Scaling that turns the activation k of static optimisation into the activation function C.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// k divided by its largest value along the trajectory.
    Peak,
    /// k without scaling.
    Raw,
}

/// Conversion of C to a current, where I_th is the threshold and I₀ the largest current.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// C·I₀.
    Scaled,
    /// I_th + C·(I₀ − I_th).
    AboveThreshold,
}

/// Settings of the device and of the activation model.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Mass of the object, kg.
    pub object_kg: f64,
    /// Duration of the lift to above the target, s.
    pub lift_s: f64,
    /// Duration of the drop onto the target, s.
    pub drop_s: f64,
    /// Fraction of the lift that overlaps with the drop.
    pub overlap: f64,
    /// Ratio of antagonist to agonist activation.
    pub co_contraction: f64,
    /// Scaling of the activation function C.
    pub scale: Scale,
    /// Conversion of the activation function C to a current.
    pub form: Form,
    /// Margin added at both ends of the joint ranges, degrees.
    pub margin_deg: f64,
    /// Velocity dead band of the phase detector, °/s.
    pub dead_band_deg_s: f64,
    /// Cut-off frequency of the differentiator in the phase detector, Hz.
    pub cutoff_hz: f64,
    /// Longest time for which an object may be held, s.
    pub longest_hold_s: f64,
}

/// Sampling and filtering of the recorded movement.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MovementCriteria {
    /// Sampling rate of the recordings, Hz.
    pub rate_hz: u32,
    /// Order of the low-pass filter.
    pub filter_order: usize,
    /// Cut-off frequency of the low-pass filter, Hz.
    pub filter_hz: f64,
}

/// Settings of the sensitivity analysis.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deciding {
    /// Number of nominal participants, who differ in their noise only.
    pub persons: usize,
    /// Number of target sets in a condition; the first is not judged.
    pub target_sets: usize,
}

/// Stimulation during a lift.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// No stimulation.
    None,
    /// Stimulation of the agonists.
    Assist,
    /// Stimulation of the antagonists.
    Resist,
}

impl Condition {
    /// All conditions, in the order of the paper's figure 4.
    pub const ALL: [Self; 3] = [Self::None, Self::Resist, Self::Assist];

    /// Returns the name in tables and files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Assist => "assist",
            Self::Resist => "resist",
        }
    }
}

/// Quantity in which conditions are compared.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Metabolic proxy: power of the arm muscles per body mass, W/kg.
    Power,
    /// Matching error: distance of the hands from their targets at the release, m.
    Error,
    /// SPARC, a dimensionless measure of smoothness: below 0, and closer to 0 for smoother
    /// movement.
    Smoothness,
}

impl Metric {
    /// Returns readable name and unit.
    #[must_use]
    pub const fn name_and_unit(self) -> (&'static str, &'static str) {
        match self {
            Self::Power => ("metabolic proxy", "W/kg"),
            Self::Error => ("matching error", "m"),
            Self::Smoothness => ("SPARC", ""),
        }
    }
}

/// Condition and target height on one side of a comparison.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Side {
    pub condition: Condition,
    /// Name of the target height; `None` for the mean over all heights.
    pub height: Option<String>,
}

/// Statement that one side is smaller than the other.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// Identifier in the results.
    pub id: String,
    /// The claim as a sentence.
    pub says: String,
    /// Compared quantity.
    pub metric: Metric,
    /// The side that should be smaller.
    pub lower: Side,
    /// The side that should be larger.
    pub higher: Side,
    /// Whether the paper says that the claim holds; `None` if it says nothing.
    pub paper: Option<bool>,
    /// Whether the paper calls the difference significant; `None` if it says nothing.
    pub significant: Option<bool>,
}

/// A mean that the paper prints.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedMean {
    /// Quantity whose mean is printed.
    pub metric: Metric,
    pub condition: Condition,
    /// Name of the target height; `None` for all heights.
    pub height: Option<String>,
    /// Mean value in the metric's unit.
    pub mean: f64,
    /// Standard error of the mean.
    pub error: f64,
}

impl Study {
    /// Parses the built-in declaration.
    ///
    /// # Errors
    /// Fails with E760 if the text cannot be parsed, or lists every invalid value.
    pub fn load_embedded() -> Result<Self, LiftError> {
        Self::parse(DECLARED)
    }

    /// Parses and checks the text of a declaration.
    ///
    /// # Errors
    /// Fails as [`Self::load_embedded`] does.
    pub fn parse(text: &str) -> Result<Self, LiftError> {
        let study: Self =
            toml::from_str(text).map_err(|e| LiftError::Declaration(e.to_string()))?;
        let wrong = study.mistakes();
        match wrong.is_empty() {
            true => Ok(study),
            false => Err(LiftError::Declaration(wrong.join("; "))),
        }
    }

    /// Returns a message for every invalid value.
    fn mistakes(&self) -> Vec<String> {
        let (protocol, model) = (&self.protocol, &self.model);
        let positive = [
            ("way.return_s", self.way.return_s),
            ("model.object_kg", model.object_kg),
            ("model.lift_s", model.lift_s),
            ("model.drop_s", model.drop_s),
            ("model.longest_hold_s", model.longest_hold_s),
            ("judged.filter_hz", self.judged.filter_hz),
        ];
        let mut wrong: Vec<String> = (positive.into_iter())
            .filter(|(_, value)| !(value.is_finite() && *value > 0.0))
            .map(|(name, value)| format!("{name} is {value}; allowed: above 0"))
            .collect();
        let counts = [
            ("protocol.persons", protocol.persons, 3),
            ("protocol.target_sets", protocol.target_sets, 2),
            ("deciding.persons", self.deciding.persons, 1),
            ("deciding.target_sets", self.deciding.target_sets, 2),
            ("studies", self.studies as usize, 1),
        ];
        let few = counts.into_iter().filter(|(_, index, least)| index < least);
        wrong.extend(
            few.map(|(name, index, least)| format!("{name} is {index}; allowed: {least} or more")),
        );
        if protocol.repetitions == 0 || !protocol.repetitions.is_multiple_of(HEIGHTS) {
            wrong.push(format!(
                "protocol.repetitions is {}; allowed: a multiple of {HEIGHTS} above 0",
                protocol.repetitions
            ));
        }
        for (name, value) in [
            ("scene.object_hz", self.scene.object_hz),
            ("judged.rate_hz", self.judged.rate_hz),
        ] {
            if value != 200 {
                wrong.push(format!(
                    "{name} is {value}; allowed: 200, the rate of object, wearer and record"
                ));
            }
        }
        if !(0.0..=0.9).contains(&model.overlap) || !(0.0..=1.0).contains(&model.co_contraction) {
            wrong.push(
                "model.overlap or model.co_contraction is out of range; allowed: 0 to 0.9 and 0 \
                 to 1"
                    .to_owned(),
            );
        }
        for range in &self.ranges {
            if !(range.low <= range.high && (!range.logarithm || range.low > 0.0)) {
                wrong.push(format!(
                    "the range of `{}` is invalid: low must not be above high, and a logarithmic \
                     range must begin above 0",
                    range.field
                ));
            }
        }
        let heights = || self.way.heights.iter().map(|height| &height.name);
        let sides = self
            .claims
            .iter()
            .flat_map(|claim| [&claim.lower, &claim.higher]);
        let named = sides.filter_map(|side| side.height.as_ref());
        let named = named.chain(
            self.printed
                .iter()
                .filter_map(|printed_value| printed_value.height.as_ref()),
        );
        for name in named.filter(|name| !heights().any(|height| height == *name)) {
            wrong.push(format!("no entry of way.heights is named `{name}`"));
        }
        wrong
    }

    /// Returns the index of the height with this name; `None` if there is none.
    #[must_use]
    pub fn height(&self, name: &str) -> Option<usize> {
        self.way
            .heights
            .iter()
            .position(|height| height.name == name)
    }

    /// Returns the pulse period in whole microseconds, rounded down.
    #[must_use]
    pub const fn period_us(&self) -> u64 {
        1_000_000 / self.protocol.frequency_hz as u64
    }
}
