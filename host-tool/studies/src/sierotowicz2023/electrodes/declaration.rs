//! What is declared: `endpoint/electrodes.toml`, committed before it was run.

use crate::sierotowicz2023::EndpointError;
use serde::Deserialize;

/// The declaration, as the program has it.
pub const DECLARED: &str = include_str!("../../../../experiments/electrode-choice.toml");

/// All of it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// The page's heading.
    pub title: String,
    /// Whose protocol.
    pub source: String,
    /// Of every draw.
    pub seed: u64,
    /// Wearers.
    pub draws: u64,
    /// What is wanted.
    pub wanted: WantedForces,
    /// What counts.
    pub judged: ForceCriteria,
    /// What was expected.
    pub expected: Expected,
}

/// What is wanted.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WantedForces {
    /// In each direction, N.
    pub sizes_n: Vec<f64>,
}

/// What counts.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceCriteria {
    /// Part missed of a force that is made.
    pub made: f64,
    /// Part missed beyond the best.
    pub within: f64,
    /// Electrodes of the sets that are shown.
    pub shown: u32,
}

/// What was expected, as parts.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Of what ten make four make.
    pub four_of_ten: f64,
    /// Of wearers one set of six on another's arm does for.
    pub one_set_of_six: f64,
}

impl Study {
    /// The program's own.
    ///
    /// # Errors
    /// E732: it cannot be read, or all that cannot be of it.
    pub fn load_embedded() -> Result<Self, EndpointError> {
        Self::parse(DECLARED)
    }

    /// Of this text.
    ///
    /// # Errors
    /// As [`Self::load_embedded`].
    pub fn parse(text: &str) -> Result<Self, EndpointError> {
        let study: Self =
            toml::from_str(text).map_err(|e| EndpointError::Electrodes(e.to_string()))?;
        let mut wrong = Vec::new();
        let sizes = &study.wanted.sizes_n;
        if sizes.is_empty() || !sizes.iter().all(|value| value.is_finite() && *value > 0.0) {
            wrong.push("wanted.sizes_n must be forces above zero".to_owned());
        }
        for (name, part) in [
            ("judged.made", study.judged.made),
            ("judged.within", study.judged.within),
            ("expected.four_of_ten", study.expected.four_of_ten),
            ("expected.one_set_of_six", study.expected.one_set_of_six),
        ] {
            if !(0.0..=1.0).contains(&part) {
                wrong.push(format!("{name} is {part}, must lie between 0 and 1"));
            }
        }
        if !(1..=9).contains(&study.judged.shown) {
            let shown = study.judged.shown;
            wrong.push(format!("judged.shown is {shown}, allowed is 1 to 9"));
        }
        if study.draws < 2 {
            let draws = study.draws;
            wrong.push(format!(
                "draws is {draws}, at least 2: one chooses for another"
            ));
        }
        match wrong.is_empty() {
            true => Ok(study),
            false => Err(EndpointError::Electrodes(wrong.join("; "))),
        }
    }
}
