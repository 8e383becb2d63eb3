//! Compares the main result of an experiment with the paper's.

use super::numbers::digits;
use super::result::Outcome;
use serde::Serialize;

/// The experiment and the measure to compare.
struct ComparedMeasure {
    study: &'static str,
    /// Identifier and readable name of the measure. Smaller values are better.
    measure: (&'static str, &'static str),
    /// The level whose value comes first.
    this: &'static str,
    /// The levels of which the best value comes second.
    than: &'static [&'static str],
    /// Readable name of the best of those levels.
    best: &'static str,
}

const ABOUT: &[ComparedMeasure] = &[ComparedMeasure {
    study: "hamana-4",
    measure: ("rmse_deg", "RMSE"),
    this: "two points",
    than: &["one point, A", "one point, B"],
    best: "the better point alone",
}];

/// One measure in two levels of a factor, for each combination of the other factors.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Comparison {
    /// The compared measure, and whether its values are medians over wearers.
    pub quantity: String,
    /// Unit of both values.
    pub unit: String,
    /// Label of the first value.
    pub this: &'static str,
    /// Label of the second value.
    pub than: &'static str,
    /// One pair for each combination of the other factors' levels.
    pub pairs: Vec<Pair>,
    /// Both values as the paper prints them.
    pub paper: Option<[f64; 2]>,
}

/// Two values that are compared.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Pair {
    /// The levels of the other factors, joined as text.
    pub levels: String,
    /// The first value.
    pub this: f64,
    /// The best of the second values.
    pub than: f64,
    /// The level that has the best second value.
    pub best: &'static str,
}

/// Returns the comparison for `outcome`, or `None` if its study has none or values are missing.
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
    /// Returns one sentence: "RMSE with two points against the better point alone: 5.92° against
    /// 9.55° (…); in the paper: 10.7° against 17.6°."
    #[must_use]
    pub fn sentence(&self) -> String {
        let both = |[this, than]: [f64; 2]| {
            let unit = match &*self.unit {
                "°" => "°".to_owned(),
                unit => format!(" {unit}"),
            };
            format!("{}{unit} against {}{unit}", digits(this), digits(than))
        };
        let pairs = self.pairs.iter().map(|pair| match &*pair.levels {
            "" => both([pair.this, pair.than]),
            levels => format!("{} ({levels})", both([pair.this, pair.than])),
        });
        let paper = self
            .paper
            .map(|paper| format!("; in the paper: {}", both(paper)));
        format!(
            "{} with {} against {}: {}{}.",
            self.quantity,
            self.this,
            self.than,
            pairs.collect::<Vec<_>>().join(", "),
            paper.unwrap_or_default()
        )
    }

    /// Returns the same values as a text table for a terminal.
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
