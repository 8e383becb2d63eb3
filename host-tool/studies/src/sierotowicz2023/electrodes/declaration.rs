//! Reads the preregistered declaration `host-tool/experiments/electrode-choice.toml`.

use crate::sierotowicz2023::EndpointError;
use serde::Deserialize;

/// Text of the declaration `host-tool/experiments/electrode-choice.toml`.
pub const DECLARED: &str = include_str!("../../../../experiments/electrode-choice.toml");

/// Content of the declaration `electrode-choice.toml`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Heading of the report page.
    pub title: String,
    /// Paper whose protocol the study follows.
    pub source: String,
    /// Seed of all draws.
    pub seed: u64,
    /// Number of random wearers.
    pub draws: u64,
    /// Reference forces at the hand.
    pub wanted: WantedForces,
    /// Criteria for a sufficient force.
    pub judged: ForceCriteria,
    /// Expectations that were written down beforehand.
    pub expected: Expected,
}

/// Reference forces at the hand.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WantedForces {
    /// Magnitudes in each direction, N.
    pub sizes_n: Vec<f64>,
}

/// Criteria for a sufficient force.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ForceCriteria {
    /// Largest relative error of a force that counts as reached.
    pub made: f64,
    /// A set of electrodes is good enough if its relative error exceeds that of the best set by at
    /// most this much.
    pub within: f64,
    /// Number of electrodes of the sets that the matrices show.
    pub shown: u32,
}

/// Expectations that were written down beforehand, as fractions.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expected {
    /// Smallest number of forces that four electrodes reach, as a fraction of the number that ten
    /// reach.
    pub four_of_ten: f64,
    /// Fraction of wearers for whom a set of six electrodes is good enough that is the best one on
    /// another wearer's arm.
    pub one_set_of_six: f64,
}

impl Study {
    /// Parses the declaration `electrode-choice.toml` that is part of the program.
    ///
    /// # Errors
    /// Returns E732 if the declaration cannot be parsed or has invalid values.
    pub fn load_embedded() -> Result<Self, EndpointError> {
        Self::parse(DECLARED)
    }

    /// Parses and checks the text of a declaration.
    ///
    /// # Errors
    /// Fails like [`Self::load_embedded`].
    pub fn parse(text: &str) -> Result<Self, EndpointError> {
        let study: Self =
            toml::from_str(text).map_err(|e| EndpointError::Electrodes(e.to_string()))?;
        let mut wrong = Vec::new();
        let sizes = &study.wanted.sizes_n;
        if sizes.is_empty() || !sizes.iter().all(|value| value.is_finite() && *value > 0.0) {
            wrong.push("wanted.sizes_n must be one or more forces above 0 N".to_owned());
        }
        for (name, part) in [
            ("judged.made", study.judged.made),
            ("judged.within", study.judged.within),
            ("expected.four_of_ten", study.expected.four_of_ten),
            ("expected.one_set_of_six", study.expected.one_set_of_six),
        ] {
            if !(0.0..=1.0).contains(&part) {
                wrong.push(format!("{name} is {part}; allowed: 0 to 1"));
            }
        }
        if !(1..=9).contains(&study.judged.shown) {
            let shown = study.judged.shown;
            wrong.push(format!("judged.shown is {shown}; allowed: 1 to 9"));
        }
        if study.draws < 2 {
            let draws = study.draws;
            wrong.push(format!(
                "draws is {draws}; allowed: 2 or more, because one wearer's electrodes are tried \
                 on another"
            ));
        }
        match wrong.is_empty() {
            true => Ok(study),
            false => Err(EndpointError::Electrodes(wrong.join("; "))),
        }
    }
}
