//! Structure of an experiment's declaration: protocol, factors, random fields, grid and claims, all
//! preregistered.

use super::protocol::Protocol;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Content of a declaration file, `host-tool/experiments/*.toml`. Every `result.json` of the
/// experiment contains the file's SHA-256.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// Name of the experiment on the command line.
    pub name: String,
    /// Heading of the report page.
    pub title: String,
    /// Paper, section and figure that the experiment replicates.
    pub source: String,
    /// Path of the session that the conditions change, relative to the declaration.
    pub session: String,
    /// Seed of wearers, noise and trial order, unless the command line states another.
    pub seed: u64,
    /// Number of random wearers, unless the command line states another.
    pub draws: u64,
    /// Measures that are computed from each trial: identifiers of [`super::measure::MEASURES`].
    pub measures: Vec<String>,
    /// Sentences with which the report begins: what is tried, and what its words mean.
    #[serde(default)]
    pub explained: Vec<String>,
    /// Assumptions of the experiment in words, for the report page. They include properties that
    /// the simulated body was given and that are therefore no results.
    #[serde(default)]
    pub assumed: Vec<String>,
    /// Order and repetition of the trials, rests and stop limits.
    #[serde(default)]
    pub protocol: Protocol,
    /// Factors whose levels distinguish the conditions; each combination of levels is a condition.
    #[serde(default, rename = "factor")]
    pub factors: Vec<Factor>,
    /// Session fields that are randomly generated for each wearer.
    #[serde(default, rename = "draw")]
    pub drawn: Vec<RandomField>,
    /// Session fields that are varied systematically. Every wearer is simulated at every point of
    /// this grid.
    #[serde(default, rename = "grid")]
    pub grid: Vec<Grid>,
    /// Statements that are judged for every wearer; the result is the share of wearers for whom
    /// each holds.
    #[serde(default, rename = "claim")]
    pub claims: Vec<Claim>,
    /// Values that the paper prints for a condition, shown beside ours.
    #[serde(default, rename = "printed")]
    pub printed: Vec<PrintedMeasure>,
}

/// A property in which the conditions of an experiment differ, such as the kind of wall.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// Readable name of the factor.
    pub name: String,
    /// The settings that the factor takes, at least one.
    #[serde(default, rename = "level")]
    pub levels: Vec<Level>,
}

/// One setting of a factor: the changes that it makes to the session.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// Readable name of the level. The names of its levels form the name of a condition.
    pub name: String,
    /// Path of a session that replaces the declaration's session in conditions with this level.
    pub session: Option<String>,
    /// New values of session fields, by dotted path. A number in a path is the `number` of a
    /// channel.
    #[serde(default)]
    pub set: toml::Table,
    /// Dotted paths of the session fields that this level removes.
    #[serde(default)]
    pub unset: Vec<String>,
}

/// A session field whose value is randomly generated for each wearer.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomField {
    /// Dotted path of the field in the session.
    pub field: String,
    /// Lower end of the range, in the unit of the field.
    pub low: f64,
    /// Upper end of the range, in the unit of the field.
    pub high: f64,
    /// Scale on which values are uniformly distributed between `low` and `high`.
    #[serde(default)]
    pub even: Uniformity,
    /// Source of the range: a publication, or "assumed".
    pub source: String,
}

/// Scale on which random values are uniformly distributed over their range.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Uniformity {
    /// All values of the range are equally likely.
    #[default]
    Value,
    /// All logarithms of the range are equally likely; the range must be positive.
    Logarithm,
    /// Uniform over the integers from the smallest to the largest value, both included.
    Whole,
}

/// A session field that takes each of a list of values, one after the other.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Dotted path of the field in the session.
    pub field: String,
    /// Values that the field takes, at least one.
    pub values: Vec<f64>,
    /// Reason for these values, or their source.
    pub source: String,
}

/// A statement that is judged for every wearer; the result is the share of cases in which it holds.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(try_from = "ClaimFields")]
pub struct Claim {
    /// Identifier of the claim in results and in combined claims.
    pub id: String,
    /// The claim as a sentence.
    pub says: String,
    /// What the paper says: `true` if the claim holds, `false` if it does not; `None` where the
    /// paper is silent.
    pub paper: Option<bool>,
    /// Rule by which the claim is judged.
    pub what: ClaimKind,
}

/// Rule by which a claim is judged.
#[derive(Clone, PartialEq, Debug)]
pub enum ClaimKind {
    /// The claim compares a measure between two levels of a factor, all other factors being equal.
    Compared(LevelComparison),
    /// The claim holds in a case in which all claims of `all` and no claim of `none` hold.
    Combined {
        /// Identifiers of the claims that must hold; the file defines them before this claim.
        all: Vec<String>,
        /// Identifiers of the claims that must not hold; the file defines them before this claim.
        none: Vec<String>,
    },
}

/// Fields of a claim as they are parsed, before the rule is known.
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
        let kind = match compared() {
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
            what: kind,
        })
    }
}

/// Comparison of a measure between two levels of a factor: `this` against `than`.
#[derive(Clone, PartialEq, Debug)]
pub struct LevelComparison {
    /// Identifier of the compared measure.
    pub measure: String,
    /// Name of the factor to which both levels belong.
    pub factor: String,
    /// Name of the level that the claim is about.
    pub this: String,
    /// Relation that the measure at level `this` must have to the measure at level `than`.
    pub is: Relation,
    /// Name of the level with which `this` is compared.
    pub than: String,
    /// Margin of the relation, in the measure's unit; see [`Relation`].
    pub by: f64,
    /// Levels of other factors, by the name of the factor; only conditions with these levels are
    /// compared.
    pub only: BTreeMap<String, String>,
}

/// Relation between two numbers, with a margin.
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
    /// Returns whether `this` has this relation to `reference`, with `by` as the margin.
    #[must_use]
    pub fn holds(self, this: f64, reference: f64, by: f64) -> bool {
        match self {
            Self::Less => this < reference - by,
            Self::More => this > reference + by,
            Self::NoMore => this <= reference + by,
            Self::NoLess => this >= reference - by,
        }
    }
}

/// Values of one measure that the paper prints.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedMeasure {
    /// Identifier of the measure, one of [`super::measure::MEASURES`].
    pub measure: String,
    /// Levels by the name of their factor; the values belong to all conditions that have one of the
    /// listed levels of each factor. Empty if they belong to all conditions.
    #[serde(default, rename = "where")]
    pub only: BTreeMap<String, Vec<String>>,
    /// One value, or one value per trial, in the measure's unit.
    pub values: Vec<f64>,
    /// Table or figure of the paper that contains the values.
    pub source: String,
}

impl PrintedMeasure {
    /// Returns the mean of the printed values, or `None` without values.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        let sum: f64 = self.values.iter().sum();
        (!self.values.is_empty()).then(|| sum / self.values.len() as f64)
    }
}

impl Declaration {
    /// Returns what the paper prints for the condition with these levels, which are one per factor.
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

    /// Returns the path of every session that the declaration names, once, with the indices of the
    /// factor and the level that name it. The declaration's own session comes first and has no
    /// level.
    #[must_use]
    pub fn sessions(&self) -> Vec<(&str, Option<(usize, usize)>)> {
        let mut sessions = vec![(&*self.session, None)];
        for (f, factor) in self.factors.iter().enumerate() {
            for (l, level) in factor.levels.iter().enumerate() {
                let named = level.session.as_deref();
                let new = named.filter(|text| !sessions.iter().any(|(known, _)| known == text));
                sessions.extend(new.map(|name| (name, Some((f, l)))));
            }
        }
        sessions
    }
}
