//! What an experiment asks, of whom, and what it compares: written before looking.

use super::protocol::Protocol;
use serde::Deserialize;
use std::collections::BTreeMap;

/// An experiment's file, `host-tool/experiments/*.toml`. Its SHA-256 stands in the
/// `result.json` of everything that came of it.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Declaration {
    /// As on the command line.
    pub name: String,
    /// Heading of its page.
    pub title: String,
    /// The paper, section and figure that it repeats.
    pub source: String,
    /// The session that its conditions change, beside the declaration.
    pub session: String,
    /// Of wearers, noise and order, unless the command line says another.
    pub seed: u64,
    /// Wearers drawn, unless the command line says otherwise.
    pub draws: u64,
    /// What is computed of each trial: names of [`super::measure::MEASURES`].
    pub measures: Vec<String>,
    /// What is assumed and what the simulated body has been given.
    #[serde(default)]
    pub assumed: Vec<String>,
    /// How the trials follow each other.
    #[serde(default)]
    pub protocol: Protocol,
    /// What differs between conditions; each level of one meets each of the others.
    #[serde(default, rename = "factor")]
    pub factors: Vec<Factor>,
    /// What differs between wearers, drawn at random.
    #[serde(default, rename = "draw")]
    pub drawn: Vec<RandomField>,
    /// What is tried value by value; every wearer meets every point.
    #[serde(default, rename = "grid")]
    pub grid: Vec<Grid>,
    /// What is compared.
    #[serde(default, rename = "claim")]
    pub claims: Vec<Claim>,
    /// What a paper printed of a condition.
    #[serde(default, rename = "printed")]
    pub printed: Vec<PrintedMeasure>,
}

/// Something that differs between conditions.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// For people.
    pub name: String,
    /// At least one.
    #[serde(default, rename = "level")]
    pub levels: Vec<Level>,
}

/// What a factor can be.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Level {
    /// For people; the condition is named by its levels.
    pub name: String,
    /// Another session than the declaration's.
    pub session: Option<String>,
    /// Fields of the session by their dotted path, and what they become. A number
    /// in a path is the `number` of a channel.
    #[serde(default)]
    pub set: toml::Table,
    /// Fields taken out.
    #[serde(default)]
    pub unset: Vec<String>,
}

/// A number of the wearer drawn at random.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RandomField {
    /// Dotted path of the field.
    pub field: String,
    /// Least.
    pub low: f64,
    /// Most.
    pub high: f64,
    /// Over what it is even.
    #[serde(default)]
    pub even: Uniformity,
    /// Where the range is from, or "assumed".
    pub source: String,
}

/// Over what a drawn number is even.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Uniformity {
    /// Its value.
    #[default]
    Value,
    /// Its logarithm.
    Logarithm,
    /// The whole numbers from the least to the most.
    Whole,
}

/// A number tried value by value.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Dotted path of the field.
    pub field: String,
    /// At least one.
    pub values: Vec<f64>,
    /// Why these.
    pub source: String,
}

/// Something compared in every wearer; its share is what is told.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(try_from = "ClaimFields")]
pub struct Claim {
    /// For machines and other claims.
    pub id: String,
    /// For people.
    pub says: String,
    /// What the paper says of it; nothing where it says nothing.
    pub paper: Option<bool>,
    /// What makes it hold.
    pub what: ClaimKind,
}

/// What makes a claim hold.
#[derive(Clone, PartialEq, Debug)]
pub enum ClaimKind {
    /// A measure in two levels of a factor, all else alike.
    Compared(LevelComparison),
    /// All of these claims and none of those hold in the same case.
    Combined {
        /// Claims before this one.
        all: Vec<String>,
        /// Claims before this one.
        none: Vec<String>,
    },
}

/// A claim as it stands in the file: either kind.
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
                return Err(format!("claim `{id}` both compares and combines"));
            }
            Some(compared) => ClaimKind::Compared(compared),
            None if compares => {
                let missing = missing.join("`, `");
                let also = match combines {
                    true => ", and combines as well",
                    false => "",
                };
                return Err(format!("claim `{id}` compares without `{missing}`{also}"));
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

/// A measure in two levels of a factor.
#[derive(Clone, PartialEq, Debug)]
pub struct LevelComparison {
    /// One of the declaration's.
    pub measure: String,
    /// The factor whose levels are compared.
    pub factor: String,
    /// The level that the claim is about.
    pub this: String,
    /// What is said of its measure.
    pub is: Relation,
    /// The level that it is held against.
    pub than: String,
    /// By at least so much, in the measure's unit.
    pub by: f64,
    /// Only in these levels of other factors.
    pub only: BTreeMap<String, String>,
}

/// A relation of two numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Relation {
    /// Less than.
    Less,
    /// More than.
    More,
    /// Not more than.
    NoMore,
    /// Not less than.
    NoLess,
}

impl Relation {
    /// Whether `this` is so related to `that`, by `by`.
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

/// What the paper prints of a measure.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrintedMeasure {
    /// One of the declaration's.
    pub measure: String,
    /// Of the conditions with one of these levels of each factor named; of all without.
    #[serde(default, rename = "where")]
    pub only: BTreeMap<String, Vec<String>>,
    /// One number, or that of each trial; in the measure's unit.
    pub values: Vec<f64>,
    /// Table or figure.
    pub source: String,
}

impl PrintedMeasure {
    /// Arithmetic mean; nothing of nothing.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        let sum: f64 = self.values.iter().sum();
        (!self.values.is_empty()).then(|| sum / self.values.len() as f64)
    }
}

impl Declaration {
    /// What the paper prints of the condition with these levels, one of each factor.
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

    /// Every session that it names, once, with the factor and the level that names it;
    /// its own, which no level names, first.
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
