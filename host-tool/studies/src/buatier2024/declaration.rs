//! What is declared: `lift/study.toml`, committed before it was run.

use super::error::LiftError;
use crate::laboratory::Range;
use serde::{Deserialize, Serialize};

/// The declaration, as the program has it.
pub const DECLARED: &str = include_str!("../../../experiments/buatier.toml");
/// Heights of a target.
pub const HEIGHTS: usize = 3;

/// All of it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// The page's heading.
    pub title: String,
    /// The paper.
    pub source: String,
    /// Of every draw.
    pub seed: u64,
    /// Studies.
    pub studies: u64,
    /// What is done.
    pub protocol: Protocol,
    /// Where hands go.
    pub way: Places,
    /// The exoskeleton.
    pub scene: ExoskeletonSpec,
    /// What a device is told.
    pub model: Model,
    /// How movement is judged.
    pub judged: MovementCriteria,
    /// How it is asked which assumption decides.
    pub deciding: Deciding,
    /// What is drawn of a person.
    #[serde(rename = "range")]
    pub ranges: Vec<Range>,
    /// What is asked.
    #[serde(rename = "claim")]
    pub claims: Vec<Claim>,
    /// What is printed.
    pub printed: Vec<PrintedMean>,
}

/// What is done.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Protocol {
    /// Of a study.
    pub persons: usize,
    /// Of a condition, the first of which is not judged.
    pub target_sets: usize,
    /// Of a target set.
    pub repetitions: usize,
    /// Of pulses.
    pub frequency_hz: u32,
    /// Of a phase.
    pub width_us: u32,
    /// Of tests.
    pub level: f64,
}

/// Where hands go, in parts of the reach.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Places {
    /// On the table, forward and up.
    pub start: [f64; 2],
    /// How far forward before the target.
    pub over_x: f64,
    /// How far above the target.
    pub over_z: f64,
    /// How far forward the target is.
    pub target_x: f64,
    /// Heights of the target.
    pub heights: [Height; HEIGHTS],
    /// Back to the table, s.
    pub return_s: f64,
}

/// A height.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Height {
    /// Its name.
    pub name: String,
    /// Above the shoulder, in parts of the reach.
    pub z: f64,
}

/// The exoskeleton.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExoskeletonSpec {
    /// Of the object and the god-object.
    pub object_hz: u32,
    /// Added to elbow and shoulder.
    pub added_inertia_kg_m2: [f64; 2],
}

/// What of C there is.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// k over its largest along the way.
    Peak,
    /// k itself.
    Raw,
}

/// How C makes an intensity.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Form {
    /// C·I₀.
    Scaled,
    /// I_th + C·(I₀ − I_th).
    AboveThreshold,
}

/// What a device is told.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Of the object, kg.
    pub object_kg: f64,
    /// To above the target, s.
    pub lift_s: f64,
    /// From there, s.
    pub drop_s: f64,
    /// Part of the lift in which the drop has begun.
    pub overlap: f64,
    /// Antagonists against agonists.
    pub co_contraction: f64,
    /// Of C.
    pub scale: Scale,
    /// Of intensities.
    pub form: Form,
    /// Of ranges, degrees.
    pub margin_deg: f64,
    /// Of the phase, °/s.
    pub dead_band_deg_s: f64,
    /// Of its differentiator, Hz.
    pub cutoff_hz: f64,
    /// An object is held at most so long, s.
    pub longest_hold_s: f64,
}

/// How movement is judged.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MovementCriteria {
    /// Of records.
    pub rate_hz: u32,
    /// Of the filter.
    pub filter_order: usize,
    /// Where it ends.
    pub filter_hz: f64,
}

/// How it is asked which assumption decides.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deciding {
    /// Persons in the middle of all ranges, who differ in noise.
    pub persons: usize,
    /// Of a condition, the first of which is not judged.
    pub target_sets: usize,
}

/// What is stimulated.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// Nothing.
    None,
    /// Agonists.
    Assist,
    /// Antagonists.
    Resist,
}

impl Condition {
    /// In the order of the paper's figure 4.
    pub const ALL: [Self; 3] = [Self::None, Self::Resist, Self::Assist];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Assist => "assist",
            Self::Resist => "resist",
        }
    }
}

/// What is measured.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Metabolic proxy, W/kg.
    Power,
    /// Matching error, m.
    Error,
    /// SPARC.
    Smoothness,
}

impl Metric {
    /// Name and unit.
    #[must_use]
    pub const fn name_and_unit(self) -> (&'static str, &'static str) {
        match self {
            Self::Power => ("metabolic proxy", "W/kg"),
            Self::Error => ("matching error", "m"),
            Self::Smoothness => ("SPARC", ""),
        }
    }
}

/// One side of a comparison.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Side {
    /// Of which condition.
    pub condition: Condition,
    /// At which height; the mean of all without.
    pub height: Option<String>,
}

/// What is asked: whether one side is less than the other.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Claim {
    /// For machines.
    pub id: String,
    /// For people.
    pub says: String,
    /// Of what.
    pub metric: Metric,
    /// What is less.
    pub lower: Side,
    /// Than what.
    pub higher: Side,
    /// Whether the paper says so.
    pub paper: Option<bool>,
    /// Whether the paper calls it significant.
    pub significant: Option<bool>,
}

/// A printed mean.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedMean {
    /// Of what.
    pub metric: Metric,
    /// Where.
    pub condition: Condition,
    /// At which height.
    pub height: Option<String>,
    /// Mean.
    pub mean: f64,
    /// Standard error.
    pub error: f64,
}

impl Study {
    /// The program's own.
    ///
    /// # Errors
    /// E760: it cannot be read, or what of it cannot be.
    pub fn load_embedded() -> Result<Self, LiftError> {
        Self::parse(DECLARED)
    }

    /// Of this text.
    ///
    /// # Errors
    /// As [`Self::load_embedded`].
    pub fn parse(text: &str) -> Result<Self, LiftError> {
        let study: Self =
            toml::from_str(text).map_err(|e| LiftError::Declaration(e.to_string()))?;
        let wrong = study.mistakes();
        match wrong.is_empty() {
            true => Ok(study),
            false => Err(LiftError::Declaration(wrong.join("; "))),
        }
    }

    /// Everything that cannot be.
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
            .map(|(name, value)| format!("{name} is {value}, must be above zero"))
            .collect();
        let counts = [
            ("protocol.persons", protocol.persons, 3),
            ("protocol.target_sets", protocol.target_sets, 2),
            ("deciding.persons", self.deciding.persons, 1),
            ("deciding.target_sets", self.deciding.target_sets, 2),
            ("studies", self.studies as usize, 1),
        ];
        let few = counts.into_iter().filter(|(_, index, least)| index < least);
        wrong
            .extend(few.map(|(name, index, least)| format!("{name} is {index}, at least {least}")));
        if protocol.repetitions == 0 || !protocol.repetitions.is_multiple_of(HEIGHTS) {
            wrong.push(format!(
                "protocol.repetitions is {}, must be a multiple of {HEIGHTS}",
                protocol.repetitions
            ));
        }
        for (name, value) in [
            ("scene.object_hz", self.scene.object_hz),
            ("judged.rate_hz", self.judged.rate_hz),
        ] {
            if value != 200 {
                wrong.push(format!(
                    "{name} is {value}: object, person and record go at 200 Hz"
                ));
            }
        }
        if !(0.0..=0.9).contains(&model.overlap) || !(0.0..=1.0).contains(&model.co_contraction) {
            wrong.push("model.overlap goes to 0.9, model.co_contraction to 1".to_owned());
        }
        for range in &self.ranges {
            if !(range.low <= range.high && (!range.logarithm || range.low > 0.0)) {
                wrong.push(format!(
                    "the range of `{}` must rise, in the logarithm from above 0",
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
            wrong.push(format!("there is no height `{name}`"));
        }
        wrong
    }

    /// Place of the height of this name.
    #[must_use]
    pub fn height(&self, name: &str) -> Option<usize> {
        self.way
            .heights
            .iter()
            .position(|height| height.name == name)
    }

    /// Pulse period, µs.
    #[must_use]
    pub const fn period_us(&self) -> u64 {
        1_000_000 / self.protocol.frequency_hz as u64
    }
}
