//! Reading a declaration: all that cannot be, at once.

use super::declaration::{Compared, Declaration, Drawn, Even, What};
use super::error::{LaboratoryError, Mistake};
use super::measure;
use std::collections::HashSet;

/// Most trials of a protocol, and wearers of a sweep.
const MOST_TRIALS: usize = 10_000;
/// Most wearers times points of the grid.
pub const MOST_DRAWS: u64 = 10_000_000;

impl Declaration {
    /// Reads and checks the text of the file called `file`.
    ///
    /// # Errors
    /// Everything that is wrong with it, each with a line where one is known.
    pub fn parse(file: &str, text: &str) -> Result<Self, LaboratoryError> {
        let told = |mistakes| LaboratoryError::Declaration {
            file: file.to_owned(),
            mistakes,
        };
        let read: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map(|span| line_of(text, span.start));
            told(vec![Mistake::at(line, error.message())])
        })?;
        let mistakes = mistakes(&read);
        match mistakes.is_empty() {
            true => Ok(read),
            false => Err(told(mistakes.into_iter().map(Mistake::nowhere).collect())),
        }
    }
}

fn line_of(text: &str, offset: usize) -> usize {
    let before = text.get(..offset).unwrap_or(text);
    before.matches('\n').count() + 1
}

/// Everything that is wrong with `d`, for people.
fn mistakes(d: &Declaration) -> Vec<String> {
    let mut told = Vec::new();
    names(d, &mut told);
    numbers(d, &mut told);
    for (at, claim) in d.claims.iter().enumerate() {
        let say = |what: String| format!("claim `{}`: {what}", claim.id);
        match &claim.what {
            What::Compared(compared) => {
                told.extend(compared_mistakes(d, compared).into_iter().map(say));
            }
            What::Combined { all, none } => {
                let before = d.claims.get(..at).unwrap_or_default();
                let is_known = |id: &&String| !before.iter().any(|other| other.id == **id);
                let unknown = all.iter().chain(none).filter(is_known);
                told.extend(unknown.map(|id| say(format!("no claim `{id}` before it"))));
                if all.is_empty() && none.is_empty() {
                    told.push(say(
                        "compares nothing: give `measure`, or `all` or `none`".into()
                    ));
                }
            }
        }
    }
    for printed in &d.printed {
        let say = |what: String| format!("printed {}: {what}", printed.source);
        told.extend(unknown_measure(d, &printed.measure).map(say));
        if !is_condition(d, &printed.condition) {
            let levels = printed.condition.join(", ");
            told.push(say(format!("`{levels}` is not a level of each factor")));
        }
    }
    told.extend(d.protocol.mistakes());
    told
}

fn names(d: &Declaration, told: &mut Vec<String>) {
    let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if d.name.is_empty() || !d.name.chars().all(is_plain) {
        let name = &d.name;
        told.push(format!("name is `{name}`, allowed are a–z, 0–9 and -"));
    }
    let known = || measure::MEASURES.iter().map(|m| m.id);
    for name in d
        .measures
        .iter()
        .filter(|name| measure::named(name).is_none())
    {
        let all: Vec<_> = known().collect();
        told.push(format!("no measure `{name}`; there are {}", all.join(", ")));
    }
    if d.measures.is_empty() {
        told.push("measures is empty: nothing would come out".into());
    }
    for factor in &d.factors {
        if factor.levels.is_empty() {
            told.push(format!("factor `{}` has no level", factor.name));
        }
        let levels = factor.levels.iter().map(|level| &*level.name);
        twice(&format!("level of `{}`", factor.name), levels, told);
    }
    twice("measure", d.measures.iter().map(|m| &**m), told);
    twice("factor", d.factors.iter().map(|factor| &*factor.name), told);
    twice("claim", d.claims.iter().map(|claim| &*claim.id), told);
    let fields = d.drawn.iter().map(|drawn| &*drawn.field);
    let fields = fields.chain(d.grid.iter().map(|grid| &*grid.field));
    twice("drawn field", fields, told);
}

fn twice<'a>(what: &str, names: impl Iterator<Item = &'a str>, told: &mut Vec<String>) {
    let mut seen = HashSet::new();
    let again = names.filter(|name| !seen.insert(*name));
    told.extend(again.map(|name| format!("{what} `{name}` stands there twice")));
}

fn numbers(d: &Declaration, told: &mut Vec<String>) {
    let conditions: usize = d.factors.iter().map(|factor| factor.levels.len()).product();
    let trials = conditions.saturating_mul(d.protocol.rounds());
    if trials > MOST_TRIALS {
        told.push(format!(
            "{trials} trials, at most {MOST_TRIALS} are allowed"
        ));
    }
    for drawn in d.drawn.iter().filter(|drawn| !can_be(drawn)) {
        let Drawn {
            field, low, high, ..
        } = drawn;
        told.push(format!(
            "`{field}` is drawn from {low} to {high}: give a least below the most, above 0 for a \
             logarithm, whole for whole numbers"
        ));
    }
    for grid in &d.grid {
        if grid.values.is_empty() || !grid.values.iter().all(|value| value.is_finite()) {
            told.push(format!("grid `{}` has no finite value", grid.field));
        }
    }
    let points = d.grid.iter().map(|grid| grid.values.len() as u64);
    let points = points.fold(1_u64, u64::saturating_mul);
    if points.saturating_mul(d.draws) > MOST_DRAWS || d.draws == 0 {
        let draws = d.draws;
        told.push(format!(
            "{draws} draws at {points} points, allowed are 1 to {MOST_DRAWS}"
        ));
    }
}

fn can_be(drawn: &Drawn) -> bool {
    let is_range = drawn.low.is_finite() && drawn.high.is_finite() && drawn.low < drawn.high;
    is_range
        && match drawn.even {
            Even::Value => true,
            Even::Logarithm => drawn.low > 0.0,
            Even::Whole => drawn.low.fract() == 0.0 && drawn.high.fract() == 0.0,
        }
}

fn unknown_measure(d: &Declaration, name: &str) -> Option<String> {
    let is_known = d.measures.iter().any(|known| known == name);
    (!is_known).then(|| format!("`{name}` is none of the declaration's measures"))
}

fn compared_mistakes(d: &Declaration, c: &Compared) -> Vec<String> {
    let mut told: Vec<String> = unknown_measure(d, &c.measure).into_iter().collect();
    let mut level = |factor: &str, level: &str| {
        let found = d.factors.iter().find(|known| known.name == factor);
        let has = found.map(|factor| factor.levels.iter().any(|known| known.name == level));
        match has {
            None => told.push(format!("no factor `{factor}`")),
            Some(false) => told.push(format!("no level `{level}` of `{factor}`")),
            Some(true) => {}
        }
    };
    level(&c.factor, &c.this);
    level(&c.factor, &c.than);
    for (factor, name) in &c.only {
        level(factor, name);
    }
    if c.this == c.than || c.only.contains_key(&c.factor) {
        told.push(format!("compares `{}` with itself", c.this));
    }
    if !c.by.is_finite() || c.by < 0.0 {
        told.push(format!("by is {}, wanted is 0 or more", c.by));
    }
    told
}

fn is_condition(d: &Declaration, levels: &[String]) -> bool {
    let fits = |(factor, level): (&super::declaration::Factor, &String)| {
        factor.levels.iter().any(|known| known.name == *level)
    };
    levels.len() == d.factors.len() && d.factors.iter().zip(levels).all(fits)
}
