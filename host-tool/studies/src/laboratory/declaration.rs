//! Structure of an experiment's declaration: protocol, factors, random fields, grid and claims, all
//! preregistered.

use super::protocol::Protocol;
use serde::Deserialize;
use std::collections::BTreeMap;

/// The declaration file, `host-tool/experiments/*.toml`. Every `result.json` of the experiment
/// contains its SHA-256.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// Name of the experiment on the command line.
    pub name: String,
    /// Heading of the report page.
    pub title: String,
    /// Paper, section and figure that the experiment replicates.
    pub source: String,
    /// Path of the session that the conditions modify, relative to the declaration.
    pub session: String,
    /// Default seed of wearers, noise and trial order; the command line can override it.
    pub seed: u64,
    /// Default number of random wearers; the command line can override it.
    pub draws: u64,
    /// Measures computed from each trial: identifiers of [`super::measure::MEASURES`].
    pub measures: Vec<String>,
    /// Assumptions, and properties that the simulated body was given.
    #[serde(default)]
    pub assumed: Vec<String>,
    /// Order and repetition of the trials, rests and stop limits.
    #[serde(default)]
    pub protocol: Protocol,
    /// The differences between conditions; the levels of all factors are crossed.
    #[serde(default, rename = "factor")]
    pub factors: Vec<Factor>,
    /// The fields that are randomly generated for each wearer.
    #[serde(default, rename = "draw")]
    pub drawn: Vec<RandomField>,
    /// The fields that are varied systematically; every wearer is simulated at every point.
    #[serde(default, rename = "grid")]
    pub grid: Vec<Grid>,
    /// The comparisons whose outcome is counted over wearers.
    #[serde(default, rename = "claim")]
    pub claims: Vec<Claim>,
    /// Values that a paper prints for a condition.
    #[serde(default, rename = "printed")]
    pub printed: Vec<PrintedMeasure>,
}

/// A property that differs between conditions.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// Readable name.
    pub name: String,
    /// At least one level.
    #[serde(default, rename = "level")]
    pub levels: Vec<Level>,
}

/// One setting of a factor.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Readable name; the names of its levels form the name of a condition.
    pub name: String,
    /// Session that replaces the declaration's session.
    pub session: Option<String>,
    /// New values by the dotted path of the session field. A number in a path is the `number` of a
    /// channel.
    #[serde(default)]
    pub set: toml::Table,
    /// Dotted paths of the session fields to remove.
    #[serde(default)]
    pub unset: Vec<String>,
}

/// A field of the session that is randomly generated for each wearer.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomField {
    /// Dotted path in the session.
    pub field: String,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Scale on which the values are distributed uniformly.
    #[serde(default)]
    pub even: Uniformity,
    /// Source of the range, or "assumed".
    pub source: String,
}

/// Scale on which a random value is distributed uniformly.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Uniformity {
    /// Uniform in the value.
    #[default]
    Value,
    /// Uniform in the logarithm.
    Logarithm,
    /// Uniform over the integers from the smallest to the largest value, both included.
    Whole,
}

/// A field of the session that takes each of a list of values.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Dotted path in the session.
    pub field: String,
    /// At least one value.
    pub values: Vec<f64>,
    /// Reason for these values.
    pub source: String,
}

/// A statement that is judged for every wearer; the result is the share in which it holds.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(try_from = "ClaimFields")]
pub struct Claim {
    /// Identifier in results and in combined claims.
    pub id: String,
    /// The claim as a sentence.
    pub says: String,
    /// Whether the paper says that the claim holds; `None` where the paper is silent.
    pub paper: Option<bool>,
    /// Condition under which the claim holds.
    pub what: ClaimKind,
}

/// Condition under which a claim holds.
#[derive(Clone, PartialEq, Debug)]
pub enum ClaimKind {
    /// Compares a measure between two levels of a factor; all other factors are equal.
    Compared(LevelComparison),
    /// All claims in `all` and no claim in `none` hold in the same case.
    Combined {
        /// Identifiers of claims that the file defines before this one.
        all: Vec<String>,
        /// Identifiers of claims that the file defines before this one.
        none: Vec<String>,
    },
}

/// The fields of a claim of either kind, as parsed.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ClaimFields {
    id: String,
    says: String,
    paper: Option<bool>,
    measure: Option<String>,
    factor: Option<String>,
    this: Option<String>,
    is: Option<Relation>,
    than: Option<String>,
    by: Option<f64>,
    #[serde(rename = "where")]
    only: Option<BTreeMap<String, String>>,
    all: Option<Vec<String>>,
    none: Option<Vec<String>>,
}

impl TryFrom<ClaimFields> for Claim {
    type Error = String;

    fn try_from(f: ClaimFields) -> Result<Self, String> {
        let id = f.id;
        let needed = [
            ("measure", f.measure.is_some()),
            ("factor", f.factor.is_some()),
            ("this", f.this.is_some()),
            ("is", f.is.is_some()),
            ("than", f.than.is_some()),
        ];
        let further = [("by", f.by.is_some()), ("where", f.only.is_some())];
        let compares = needed.iter().chain(&further).any(|(_, is_there)| *is_there);
        let combines = f.all.is_some() || f.none.is_some();
        let missing: Vec<_> = needed
            .iter()
            .filter(|pair| !pair.1)
            .map(|pair| pair.0)
            .collect();
        let compared = || {
            Some(LevelComparison {
                measure: f.measure?,
                factor: f.factor?,
                this: f.this?,
                is: f.is?,
                than: f.than?,
                by: f.by.unwrap_or(0.0),
                only: f.only.unwrap_or_default(),
            })
        };
        let what = match compared() {
            Some(_) if combines => {
                return Err(format!(
                    "claim `{id}` both compares levels and combines claims (`all`, `none`); do one"
                ));
            }
            Some(compared) => ClaimKind::Compared(compared),
            None if compares => {
                let missing = missing.join("`, `");
                let also = match combines {
                    true => ", and also has `all` or `none`",
                    false => "",
                };
                return Err(format!(
                    "claim `{id}` compares levels but lacks `{missing}`{also}"
                ));
            }
            None => ClaimKind::Combined {
                all: f.all.unwrap_or_default(),
                none: f.none.unwrap_or_default(),
            },
        };
        Ok(Self {
            id,
            says: f.says,
            paper: f.paper,
            what,
        })
    }
}

/// Comparison of a measure between two levels of a factor.
#[derive(Clone, PartialEq, Debug)]
pub struct LevelComparison {
    /// A measure of the declaration.
    pub measure: String,
    /// The factor whose levels are compared.
    pub factor: String,
    /// The level that the claim is about.
    pub this: String,
    /// How the measure of `this` relates to that of `than`.
    pub is: Relation,
    /// The level to compare with.
    pub than: String,
    /// Smallest difference, in the measure's unit.
    pub by: f64,
    /// Restricts the comparison to these levels of other factors.
    pub only: BTreeMap<String, String>,
}

/// Ordering of two numbers with a margin.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// `this` is smaller than `that` by more than the margin.
    Less,
    /// `this` is larger than `that` by more than the margin.
    More,
    /// `this` is at most `that` plus the margin.
    NoMore,
    /// `this` is at least `that` minus the margin.
    NoLess,
}

impl Relation {
    /// Returns whether `this` has the relation to `that` with the margin `by`.
    #[must_use]
    pub fn holds(self, this: f64, that: f64, by: f64) -> bool {
        match self {
            Self::Less => this < that - by,
            Self::More => this > that + by,
            Self::NoMore => this <= that + by,
            Self::NoLess => this >= that - by,
        }
    }
}

/// Values that the paper prints for a measure.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedMeasure {
    /// A measure of the declaration.
    pub measure: String,
    /// Restricts the values to conditions with one of these levels of each named factor; empty for
    /// all conditions.
    #[serde(default, rename = "where")]
    pub only: BTreeMap<String, Vec<String>>,
    /// One value, or the value of each trial, in the measure's unit.
    pub values: Vec<f64>,
    /// Table or figure of the paper.
    pub source: String,
}

impl PrintedMeasure {
    /// Returns the arithmetic mean, or `None` without values.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        let sum: f64 = self.values.iter().sum();
        (!self.values.is_empty()).then(|| sum / self.values.len() as f64)
    }
}

impl Declaration {
    /// Returns the values that the paper prints for the condition with these levels, one per
    /// factor.
    pub fn printed_of<'a>(
        &'a self,
        levels: &'a [String],
    ) -> impl Iterator<Item = &'a PrintedMeasure> {
        let has = move |(factor, wanted): (&String, &Vec<String>)| {
            let at = self.factors.iter().position(|item| item.name == *factor);
            let own = at.and_then(|at| levels.get(at));
            own.is_some_and(|own| wanted.contains(own))
        };
        self.printed
            .iter()
            .filter(move |printed_value| printed_value.only.iter().all(has))
    }

    /// Returns every session that the declaration names, once, with the factor and the level that
    /// name it. The declaration's own session comes first, without a level.
    #[must_use]
    pub fn sessions(&self) -> Vec<(&str, Option<(usize, usize)>)> {
        let mut all = vec![(&*self.session, None)];
        for (f, factor) in self.factors.iter().enumerate() {
            for (l, level) in factor.levels.iter().enumerate() {
                let named = level.session.as_deref();
                let new = named.filter(|text| !all.iter().any(|(known, _)| known == text));
                all.extend(new.map(|name| (name, Some((f, l)))));
            }
        }
        all
    }
}
