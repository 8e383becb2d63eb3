//! Random ranges and claims of studies that simulate participants directly, and their results.

use super::claims::Share;
use super::decides::{DecidingClaim, LEAST_WEARERS, compare_fields};
use hal_sim::random;
use serde::Deserialize;

/// Range of a parameter that is randomly generated for each participant.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Name of the parameter; it includes the unit, if there is one.
    pub field: String,
    /// Lower end of the range, in the unit of the parameter.
    pub low: f64,
    /// Upper end of the range, in the unit of the parameter.
    pub high: f64,
    /// Whether values are uniform in the logarithm instead of uniform in the value.
    #[serde(default)]
    pub logarithm: bool,
    /// Source of the range: a publication, or "assumed".
    pub source: String,
}

impl Range {
    /// Returns the value at the fraction `part` of the range, 0 to 1, on a linear or logarithmic
    /// scale.
    #[must_use]
    pub fn at(&self, part: f64) -> f64 {
        match self.logarithm {
            true => self.low * libm::pow(self.high / self.low, part),
            false => self.low + part * (self.high - self.low),
        }
    }

    /// Generates the values of participant `index`, one for each of `ranges`. A value depends only
    /// on seed, index and the position of its range, so that appending a range does not change the
    /// others.
    #[must_use]
    pub fn draw_values(ranges: &[Self], seed: u64, index: u64) -> Vec<f64> {
        let stream = random::word(seed, index);
        let value = |(place, range): (u64, &Self)| range.at(random::unit(stream, place));
        (0..).zip(ranges).map(value).collect()
    }

    /// Returns the value of the parameter `field` among the values `drawn`, which are in the order
    /// of `ranges`; `None` if there is no such range.
    #[must_use]
    pub fn value(ranges: &[Self], drawn: &[f64], field: &str) -> Option<f64> {
        let place = ranges.iter().position(|range| range.field == field)?;
        drawn.get(place).copied()
    }
}

/// A statement that is judged for each simulated participant.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawClaim {
    /// Identifier of the claim in `result.json`.
    pub id: String,
    /// The claim as a sentence.
    pub says: String,
    /// What the paper says: `true` if the claim holds, `false` if it does not; `None` where the
    /// paper is silent.
    pub paper: Option<bool>,
}

impl DrawClaim {
    /// Returns the share of participants in whom the claim holds. `verdicts` has one entry per
    /// participant; `None` entries are not counted.
    #[must_use]
    pub fn share(&self, verdicts: &[Option<bool>]) -> Share {
        let known = verdicts.iter().flatten();
        let holds = known.clone().filter(|flag| **flag).count() as u64;
        let counts = (holds, known.count() as u64);
        Share::from_counts(self.id.clone(), self.says.clone(), self.paper, counts)
    }

    /// Finds the parameters that decide the claim. `verdicts` and the random values `drawn` have
    /// one entry per participant.
    #[must_use]
    pub fn deciding_fields(
        &self,
        ranges: &[Range],
        verdicts: &[Option<bool>],
        drawn: &[&[f64]],
    ) -> DecidingClaim {
        let known = verdicts.iter().zip(drawn);
        let known: Vec<(bool, &[f64])> = known
            .filter_map(|(verdict, drawn)| Some(((*verdict)?, *drawn)))
            .collect();
        let holds: Vec<bool> = known.iter().map(|pair| pair.0).collect();
        let count = |wanted: bool| holds.iter().filter(|hold| **hold == wanted).count();
        let enough = count(true).min(count(false)) >= LEAST_WEARERS;
        let fields = ranges.iter().enumerate().map(|(place, range)| {
            let own = known.iter().filter_map(|(_, drawn)| drawn.get(place));
            (&*range.field, own.copied().collect())
        });
        DecidingClaim {
            id: self.id.clone(),
            claim: self.says.clone(),
            holds: count(true),
            fails: count(false),
            enough,
            fields: match enough {
                true => compare_fields(&fields.collect::<Vec<_>>(), &holds),
                false => Vec::new(),
            },
        }
    }
}
