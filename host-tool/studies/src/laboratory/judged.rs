//! What a study that draws persons declares: ranges and claims; and what comes of the claims.

use super::claims::Share;
use super::decides::{DecidingClaim, LEAST_WEARERS, compare_fields};
use hal_sim::random;
use serde::Deserialize;

/// A parameter that is drawn.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// Its name, with its unit.
    pub field: String,
    /// Least.
    pub low: f64,
    /// Greatest.
    pub high: f64,
    /// Even in the logarithm.
    #[serde(default)]
    pub logarithm: bool,
    /// Where from.
    pub source: String,
}

impl Range {
    /// So far of the way from least to greatest, 0 to 1.
    #[must_use]
    pub fn at(&self, part: f64) -> f64 {
        match self.logarithm {
            true => self.low * (self.high / self.low).powf(part),
            false => self.low + part * (self.high - self.low),
        }
    }

    /// What is drawn for person `index`, a number for each range in their order: every one of
    /// the same seed has the same numbers, whatever is drawn beside.
    #[must_use]
    pub fn draw_values(ranges: &[Self], seed: u64, index: u64) -> Vec<f64> {
        let stream = random::word(seed, index);
        let value = |(place, range): (u64, &Self)| range.at(random::unit(stream, place));
        (0..).zip(ranges).map(value).collect()
    }

    /// What is `draw_values` for the range of this field; nothing where there is none.
    #[must_use]
    pub fn value(ranges: &[Self], drawn: &[f64], field: &str) -> Option<f64> {
        let place = ranges.iter().position(|range| range.field == field)?;
        drawn.get(place).copied()
    }
}

/// What is judged of each person.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrawClaim {
    /// For machines.
    pub id: String,
    /// For people.
    pub says: String,
    /// What the paper says of it.
    pub paper: Option<bool>,
}

impl DrawClaim {
    /// In how many of those it can be judged of it holds.
    #[must_use]
    pub fn share(&self, verdicts: &[Option<bool>]) -> Share {
        let known = verdicts.iter().flatten();
        let holds = known.clone().filter(|flag| **flag).count() as u64;
        let counts = (holds, known.count() as u64);
        Share::from_counts(self.id.clone(), self.says.clone(), self.paper, counts)
    }

    /// Which of what was `draw_values` of each person decides it.
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
        let of = |wanted: bool| holds.iter().filter(|hold| **hold == wanted).count();
        let enough = of(true).min(of(false)) >= LEAST_WEARERS;
        let fields = ranges.iter().enumerate().map(|(place, range)| {
            let own = known.iter().filter_map(|(_, drawn)| drawn.get(place));
            (&*range.field, own.copied().collect())
        });
        DecidingClaim {
            id: self.id.clone(),
            claim: self.says.clone(),
            holds: of(true),
            fails: of(false),
            enough,
            fields: match enough {
                true => compare_fields(&fields.collect::<Vec<_>>(), &holds),
                false => Vec::new(),
            },
        }
    }
}
