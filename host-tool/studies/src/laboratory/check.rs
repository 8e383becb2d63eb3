//! Parses a declaration and reports every mistake in it at once.

use super::declaration::{ClaimKind, Declaration, Level, LevelComparison, RandomField, Uniformity};
use super::error::{LaboratoryError, Mistake};
use super::measure;
use super::written::DeclarationText;
use std::collections::HashSet;
use toml::Value;

/// Largest number of trials in a protocol.
const MOST_TRIALS: usize = 10_000;
/// Largest product of wearers and grid points in a sweep.
pub const MOST_DRAWS: u64 = 10_000_000;

impl Declaration {
    /// Parses and checks the text of a declaration; `file` names it in messages.
    ///
    /// # Errors
    /// Returns every mistake in the declaration, with its line where that is known.
    pub fn parse(file: &str, text: &str) -> Result<Self, LaboratoryError> {
        match Self::read_and_check(text) {
            (Some(read), mistakes) if mistakes.is_empty() => Ok(read),
            (_, mistakes) => Err(LaboratoryError::declaration(file, mistakes)),
        }
    }

    /// Returns the declaration and every mistake in it; `None` in place of the declaration if the
    /// text cannot be parsed.
    pub(super) fn read_and_check(text: &str) -> (Option<Self>, Vec<Mistake>) {
        let mut written = DeclarationText::new(text);
        let (read, mut mistakes) = written.read();
        if let Some(read) = &read {
            let mut collector = DeclarationMistakes {
                written: &written,
                all: mistakes,
            };
            collector.check_all(read);
            mistakes = collector.all;
        }
        (read, mistakes)
    }
}

/// Collects the mistakes of a declaration, each with its line number.
struct DeclarationMistakes<'w> {
    written: &'w DeclarationText<'w>,
    all: Vec<Mistake>,
}

impl DeclarationMistakes<'_> {
    /// Adds a mistake in `field` of element `nth` of `list`.
    fn add_in_list(&mut self, (list, nth, field): (&str, usize, &str), message: &str) {
        let line = self.written.line(list, nth, field);
        self.all.push(Mistake::at(line, message));
    }

    /// Adds a mistake in a top-level field.
    fn add_in_root(&mut self, field: &str, message: &str) {
        let line = self.written.line_of(field);
        self.all.push(Mistake::at(line, message));
    }

    fn check_all(&mut self, d: &Declaration) {
        self.check_names(d);
        self.check_factors(d);
        self.check_numbers(d);
        self.check_overwritten(d);
        for nth in 0..d.claims.len() {
            self.claim(d, nth);
        }
        for nth in 0..d.printed.len() {
            self.printed(d, nth);
        }
        for message in d.protocol.mistakes() {
            self.add_in_root("protocol", &message);
        }
        if self.written.is_empty("protocol", "stop") {
            self.add_in_root(
                "protocol",
                "stop has no criterion; give at least one, or remove stop",
            );
        }
    }

    fn claim(&mut self, d: &Declaration, nth: usize) {
        let Some(claim) = d.claims.get(nth) else {
            return;
        };
        let say = |text: &str| format!("claim `{}`: {text}", claim.id);
        match &claim.what {
            ClaimKind::Compared(compared) => {
                for (field, message) in compared_mistakes(d, compared) {
                    self.add_in_list(("claim", nth, field), &say(&message));
                }
            }
            ClaimKind::Combined { all, none } => {
                let before = d.claims.get(..nth).unwrap_or_default();
                for (field, ids) in [("all", all), ("none", none)] {
                    for id in ids {
                        let is_known = before.iter().any(|other| other.id == *id);
                        if !is_known && !self.written.is_unread_claim(id) {
                            let message = say(&format!("there is no claim `{id}` before this one"));
                            self.add_in_list(("claim", nth, field), &message);
                        }
                    }
                }
                if all.is_empty() && none.is_empty() {
                    let message = say("has nothing to judge; give `measure`, `all` or `none`");
                    self.add_in_list(("claim", nth, "id"), &message);
                }
            }
        }
    }

    fn printed(&mut self, d: &Declaration, nth: usize) {
        let Some(printed) = d.printed.get(nth) else {
            return;
        };
        let say = |text: &str| format!("printed value ({}): {text}", printed.source);
        if let Some(message) = unknown_measure(d, &printed.measure) {
            self.add_in_list(("printed", nth, "measure"), &say(&message));
        }
        for (factor, levels) in &printed.only {
            for message in levels
                .iter()
                .filter_map(|level| unknown_level(d, factor, level))
            {
                self.add_in_list(("printed", nth, "where"), &say(&message));
            }
            if levels.is_empty() {
                let message = say(&format!("`where` lists no level of `{factor}`"));
                self.add_in_list(("printed", nth, "where"), &message);
            }
        }
        if printed.values.is_empty() || !printed.values.iter().all(|value| value.is_finite()) {
            let message = say("`values` is empty or contains a number that is not finite");
            self.add_in_list(("printed", nth, "values"), &message);
        }
    }

    fn check_names(&mut self, d: &Declaration) {
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if d.name.is_empty() || !d.name.chars().all(is_plain) {
            let message = format!("name is `{}`; allowed: a–z, 0–9 and -", d.name);
            self.add_in_root("name", &message);
        }
        let known: Vec<_> = measure::MEASURES.iter().map(|measure| measure.id).collect();
        for name in d
            .measures
            .iter()
            .filter(|text| measure::find_measure(text).is_none())
        {
            let message = format!("no measure `{name}`; available: {}", known.join(", "));
            self.add_in_root("measures", &message);
        }
        if d.measures.is_empty() {
            self.add_in_root("measures", "measures is empty; name at least one measure");
        }
        for (_, message) in find_duplicates("measure", d.measures.iter().map(|measure| &**measure))
        {
            self.add_in_root("measures", &message);
        }
        for (nth, message) in find_duplicates("claim", d.claims.iter().map(|claim| &*claim.id)) {
            self.add_in_list(("claim", nth, "id"), &message);
        }
        let drawn = d.drawn.iter().map(|draw| &*draw.field);
        let fields = drawn.chain(d.grid.iter().map(|grid| &*grid.field));
        for (nth, message) in find_duplicates("field", fields) {
            match nth.checked_sub(d.drawn.len()) {
                None => self.add_in_list(("draw", nth, "field"), &message),
                Some(nth) => self.add_in_list(("grid", nth, "field"), &message),
            }
        }
    }

    fn check_factors(&mut self, d: &Declaration) {
        for (nth, message) in
            find_duplicates("factor", d.factors.iter().map(|factor| &*factor.name))
        {
            self.add_in_list(("factor", nth, "name"), &message);
        }
        for (nth, factor) in d.factors.iter().enumerate() {
            if factor.levels.is_empty() {
                let name = &factor.name;
                let message = format!(
                    "factor `{name}` has no level; give at least one, or remove the factor"
                );
                self.add_in_list(("factor", nth, "name"), &message);
            }
            let levels = factor.levels.iter().map(|level| &*level.name);
            for (at, message) in find_duplicates(&format!("level of `{}`", factor.name), levels) {
                let line = self.written.line_of_level(nth, at);
                self.all.push(Mistake::at(line, &message));
            }
        }
        let names_session = |(_, factor): &(usize, &super::declaration::Factor)| {
            factor.levels.iter().any(|level| level.session.is_some())
        };
        let mut naming = d.factors.iter().enumerate().filter(names_session);
        if let Some((_, first)) = naming.next() {
            for (nth, factor) in naming {
                let (first_name, other) = (&first.name, &factor.name);
                let message = format!(
                    "`{first_name}` and `{other}` both name sessions, but a condition has only one; name \
                     all sessions in one factor"
                );
                self.add_in_list(("factor", nth, "name"), &message);
            }
        }
    }

    /// Reports levels of a factor that set a field which a draw or a grid overwrites, because the
    /// conditions would then not differ in that field.
    fn check_overwritten(&mut self, d: &Declaration) {
        let drawn = d
            .drawn
            .iter()
            .map(|draw| ("draw", &*draw.field))
            .enumerate();
        let grids = d.grid.iter().map(|grid| ("grid", &*grid.field)).enumerate();
        for (nth, (list, field)) in drawn.chain(grids) {
            for (at, factor) in d.factors.iter().enumerate() {
                // If every level gives the field the same value, the draw or the grid just changes
                // this common base, which is allowed.
                let mut values = factor.levels.iter().map(|level| value_within(level, field));
                let first = values.next().flatten();
                let is_base = first.is_some() && values.all(|value| value == first);
                for (place, level) in factor.levels.iter().enumerate() {
                    let set = level.set.keys().chain(&level.unset);
                    let above = |own: &str| is_within(field, own) && !is_base;
                    for own in set.filter(|own| is_within(own, field) || above(own)) {
                        let name = &level.name;
                        let by = self.written.line(list, nth, "field");
                        let by = by.map_or(String::new(), |line| format!(", line {line},"));
                        let message = format!(
                            "level `{name}` changes `{own}`, but the {list} of `{field}`{by} would \
                             overwrite it; remove one of the two"
                        );
                        let line = self.written.line_of_level(at, place);
                        self.all.push(Mistake::at(line, &message));
                    }
                }
            }
        }
    }

    fn check_numbers(&mut self, d: &Declaration) {
        let conditions = d.factors.iter().map(|factor| factor.levels.len());
        let conditions = conditions.fold(1, usize::saturating_mul);
        let trials = conditions.saturating_mul(d.protocol.rounds());
        if trials > MOST_TRIALS {
            let message = format!("{trials} trials; allowed: at most {MOST_TRIALS}");
            self.add_in_root("protocol", &message);
        }
        for (nth, drawn) in d
            .drawn
            .iter()
            .enumerate()
            .filter(|(_, draw)| !is_valid_range(draw))
        {
            let RandomField {
                field, low, high, ..
            } = drawn;
            let message = format!(
                "draw `{field}` goes from {low} to {high}; low must be below high, above 0 for a \
                 logarithm, and both must be whole for whole numbers"
            );
            self.add_in_list(("draw", nth, "low"), &message);
        }
        for (nth, grid) in d.grid.iter().enumerate() {
            if grid.values.is_empty() || !grid.values.iter().all(|value| value.is_finite()) {
                let message = format!(
                    "grid `{}`: `values` is empty or contains a number that is not finite",
                    grid.field
                );
                self.add_in_list(("grid", nth, "values"), &message);
            }
        }
        let points = d.grid.iter().map(|grid| grid.values.len() as u64);
        let points = points.fold(1_u64, u64::saturating_mul);
        if points.saturating_mul(d.draws) > MOST_DRAWS || d.draws == 0 {
            let draws = d.draws;
            let message = format!(
                "{draws} draws at each of {points} grid points; allowed: 1 to {MOST_DRAWS} in all"
            );
            self.add_in_root("draws", &message);
        }
    }
}

/// Returns the index of every name that occurred before, with a message; `noun` is the noun for it.
fn find_duplicates<'a>(noun: &str, names: impl Iterator<Item = &'a str>) -> Vec<(usize, String)> {
    let mut seen = HashSet::new();
    let again = names.enumerate().filter(|(_, name)| !seen.insert(*name));
    let messages = again.map(|(nth, name)| (nth, format!("{noun} `{name}` appears twice")));
    messages.collect()
}

/// Returns whether the dotted path `field` equals `table` or continues it.
fn is_within(field: &str, table: &str) -> bool {
    let rest = field.strip_prefix(table);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

/// Returns the value that `level` gives to the dotted path `field` by setting a table that contains
/// it, or `None` if it does not.
fn value_within<'l>(level: &'l Level, field: &str) -> Option<&'l Value> {
    level.set.iter().find_map(|(table, value)| {
        let rest = field.strip_prefix(&**table)?.strip_prefix('.')?;
        rest.split('.').try_fold(value, |at, part| at.get(part))
    })
}

fn is_valid_range(drawn: &RandomField) -> bool {
    let is_range = drawn.low.is_finite() && drawn.high.is_finite() && drawn.low < drawn.high;
    is_range
        && match drawn.even {
            Uniformity::Value => true,
            Uniformity::Logarithm => drawn.low > 0.0,
            Uniformity::Whole => drawn.low.fract() == 0.0 && drawn.high.fract() == 0.0,
        }
}

fn unknown_measure(d: &Declaration, name: &str) -> Option<String> {
    let is_known = d.measures.iter().any(|known| known == name);
    (!is_known).then(|| format!("`{name}` is not in the declaration's `measures`"))
}

fn unknown_level(d: &Declaration, factor: &str, level: &str) -> Option<String> {
    match d.factors.iter().find(|known| known.name == factor) {
        None => Some(format!("no factor `{factor}`")),
        Some(known) if known.levels.iter().any(|item| item.name == level) => None,
        Some(_) => Some(format!("no level `{level}` of `{factor}`")),
    }
}

/// Returns the mistakes of a comparison between levels, each with the field that is wrong.
fn compared_mistakes(d: &Declaration, c: &LevelComparison) -> Vec<(&'static str, String)> {
    let measure = unknown_measure(d, &c.measure).map(|message| ("measure", message));
    let mut mistakes: Vec<_> = measure.into_iter().collect();
    match d.factors.iter().any(|known| known.name == c.factor) {
        false => mistakes.push(("factor", format!("no factor `{}`", c.factor))),
        true => {
            for (field, level) in [("this", &c.this), ("than", &c.than)] {
                let unknown = unknown_level(d, &c.factor, level);
                mistakes.extend(unknown.map(|message| (field, message)));
            }
        }
    }
    for (factor, level) in &c.only {
        let unknown = unknown_level(d, factor, level);
        mistakes.extend(unknown.map(|message| ("where", message)));
    }
    if c.this == c.than {
        mistakes.push(("than", format!("compares `{}` with itself", c.this)));
    }
    if c.only.contains_key(&c.factor) {
        let message = format!(
            "`where` fixes `{}`, the factor that the claim compares",
            c.factor
        );
        mistakes.push(("where", message));
    }
    if !c.by.is_finite() || c.by < 0.0 {
        mistakes.push(("by", format!("by is {}; allowed: 0 or more", c.by)));
    }
    mistakes
}
