//! Compares the main result of an experiment with the paper's.

use super::numbers::digits;
use super::result::Outcome;
use serde::Serialize;

/// Definition of the main comparison of a study: which measure, in which levels of a factor.
struct ComparedMeasure {
    study: &'static str,
    /// Identifier and readable name of the measure, of which smaller values are better.
    measure: (&'static str, &'static str),
    /// Level of the first value of a pair.
    this: &'static str,
    /// Levels of which the one with the smallest value gives the second value of a pair.
    than: &'static [&'static str],
    /// Readable name for the best of the levels in `than`.
    best: &'static str,
}

const ABOUT: &[ComparedMeasure] = &[ComparedMeasure {
    study: "hamana-4",
    measure: ("rmse_deg", "RMSE"),
    this: "two points",
    than: &["one point, A", "one point, B"],
    best: "the better point alone",
}];

/// A measure compared between two levels of a factor, once for each combination of the other
/// factors' levels.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Comparison {
    /// Name of the compared measure, with a note if its values are medians over wearers.
    pub quantity: String,
    pub unit: String,
    /// Name of the factor's level whose value comes first in each pair.
    pub this: &'static str,
    /// Name of the factor's level whose value comes second in each pair.
    pub than: &'static str,
    /// One pair for each combination of the other factors' levels.
    pub pairs: Vec<Pair>,
    /// The first and the second value as the paper prints them; `None` if it does not print both.
    pub paper: Option<[f64; 2]>,
}

/// Two values of the measure under otherwise equal conditions.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Pair {
    /// Levels of the other factors, separated by commas; empty without other factors.
    pub levels: String,
    /// Value at the level of [`Comparison::this`].
    pub this: f64,
    /// Smallest value among the levels with which it is compared.
    pub than: f64,
    /// Name of the level that has the value `than`.
    pub best: &'static str,
}

/// Returns the main comparison of the study in `outcome`, or `None` if the study defines none or
/// values are missing.
#[must_use]
pub fn comparison(outcome: &Outcome) -> Option<Comparison> {
    let about = ABOUT.iter().find(|about| about.study == outcome.name)?;
    let row = |levels: &[String]| {
        let condition = outcome
            .conditions
            .iter()
            .find(|view| view.levels == levels)?;
        let id = format!("{}/{}", condition.name(), about.measure.0);
        outcome.rows.iter().find(|row| row.id == id)
    };
    let (mut pairs, mut paper, mut unit) = (Vec::new(), None, String::new());
    for condition in &outcome.conditions {
        let Some(place) = condition
            .levels
            .iter()
            .position(|level| level == about.this)
        else {
            continue;
        };
        let with = |level: &str| {
            let mut levels = condition.levels.clone();
            level.clone_into(&mut levels[place]);
            levels
        };
        let this = row(&condition.levels)?;
        let than = about
            .than
            .iter()
            .filter_map(|level| Some((*level, row(&with(level))?)))
            .filter_map(|(level, row)| Some((level, row, row.ours?)));
        let (best, than, value) = than.min_by(|a, b| a.2.total_cmp(&b.2))?;
        let mut others = condition.levels.clone();
        others.remove(place);
        paper = paper.or(this.paper.zip(than.paper).map(|(a, b)| [a, b]));
        unit.clone_from(&this.unit);
        pairs.push(Pair {
            levels: others.join(", "),
            this: this.ours?,
            than: value,
            best,
        });
    }
    (!pairs.is_empty()).then_some(Comparison {
        quantity: match outcome.declared.draws {
            0 => about.measure.1.to_owned(),
            draws => format!("Median {} of {draws} wearers,", about.measure.1),
        },
        unit,
        this: about.this,
        than: about.best,
        pairs,
        paper,
    })
}

impl Comparison {
    /// Returns the comparison as a sentence, for example "RMSE with two points against the better
    /// point alone: 5.92° against 9.55° (…); in the paper: 10.7° against 17.6°."
    #[must_use]
    pub fn sentence(&self) -> String {
        let phrase = |[this, than]: [f64; 2]| {
            let unit = match &*self.unit {
                "°" => "°".to_owned(),
                unit => format!(" {unit}"),
            };
            format!("{}{unit} against {}{unit}", digits(this), digits(than))
        };
        let pairs = self.pairs.iter().map(|pair| match &*pair.levels {
            "" => phrase([pair.this, pair.than]),
            levels => format!("{} ({levels})", phrase([pair.this, pair.than])),
        });
        let paper = self
            .paper
            .map(|paper| format!("; in the paper: {}", phrase(paper)));
        format!(
            "{} with {} against {}: {}{}.",
            self.quantity,
            self.this,
            self.than,
            pairs.collect::<Vec<_>>().join(", "),
            paper.unwrap_or_default()
        )
    }

    /// Returns the comparison as a text table for a terminal.
    #[must_use]
    pub fn in_columns(&self) -> String {
        let row = |name: &str, [this, than]: [&str; 2]| {
            format!("{name:<34} {this:>10} {than:>24}\n")
                .trim_end()
                .to_owned()
                + "\n"
        };
        let head = format!("{}, {}", self.quantity.trim_end_matches(','), self.unit);
        let mut text = row(&head, [self.this, self.than]);
        for pair in &self.pairs {
            let than = format!("{} ({})", digits(pair.than), pair.best);
            text += &row(&pair.levels, [&digits(pair.this), &than]);
        }
        if let Some([this, than]) = self.paper {
            text += &row("in the paper", [&digits(this), &digits(than)]);
        }
        text
    }
}
