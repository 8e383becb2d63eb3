//! A TOML table that knows its place in the file, checked against its declared fields.
//!
//! `read` reports every error that a field has by itself. The code after it therefore reads only
//! tables without errors, and checks what the fields mean together.

mod read;

use std::collections::BTreeMap;
use std::ops::Range;

use firmware::link::Refusal;

use super::decimal::{format_range, parse_scaled};
use super::document::Document;
use super::error::{Place, Problem};
use super::field::{Condition, Field, Need, Section};

/// One table of a TOML file, with the fields that were read from it.
pub(crate) struct Table<'a> {
    doc: &'a Document,
    path: String,
    span: Range<usize>,
    section: &'static Section,
    entries: BTreeMap<&'static str, Entry<'a>>,
    sound: bool,
}

/// A field that is present in the file.
struct Entry<'a> {
    span: Range<usize>,
    /// Value of the field; `None` if it has an error, which was reported.
    value: Option<Value<'a>>,
}

enum Value<'a> {
    Text(&'a str),
    Texts(Vec<&'a str>),
    Flag(bool),
    Word(&'static str),
    /// Number of the device's steps.
    Whole(i64),
    Real(f64),
    /// Numbers of the device's steps, each with its place in the text.
    Wholes(Vec<(i64, Range<usize>)>),
    /// Places in the text of the two numbers of each pair.
    Pairs(Vec<[Range<usize>; 2]>),
    Table(Table<'a>),
    Tables(Vec<Table<'a>>),
}

/// Access to the values of a table whose fields were checked.
impl<'a> Table<'a> {
    /// Returns whether each field of the table is valid by itself. Tables within this table are not
    /// considered.
    pub(crate) const fn is_valid(&self) -> bool {
        self.sound
    }

    /// Returns whether the file has this field in this table, with or without an error.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.entries.contains_key(name)
    }

    fn get(&self, name: &str) -> Option<&Value<'a>> {
        self.entries.get(name)?.value.as_ref()
    }

    /// Returns the declaration of the field `name` that applies in this table. A name may have
    /// several declarations with different conditions.
    fn field(&self, name: &str) -> Option<&'static Field> {
        let mut same = self.section.iter().filter(|field| field.name == name);
        same.find(|field| self.applies(field))
    }

    fn applies(&self, field: &Field) -> bool {
        match field.when {
            Some(Condition::Is(tag, words)) => {
                self.word_of(tag).is_none_or(|word| words.contains(&word))
            }
            _ => true,
        }
    }

    fn find_integer(&self, name: &str) -> Option<i64> {
        match (self.get(name), self.field(name).map(|field| &field.need)) {
            (Some(Value::Whole(value)), _) => Some(*value),
            (None, Some(Need::Or(value))) => Some(*value),
            _ => None,
        }
    }

    /// Returns the number of the device's steps in the field `name`, or its default. If there is
    /// neither, or the number does not fit in `T`, returns the largest value of `T`, which no rule
    /// of the firmware accepts.
    pub(crate) fn integer<T: WholeNumber>(&self, name: &str) -> T {
        self.integer_or(name, T::TOP)
    }

    /// Returns the number of the device's steps in the field `name`, or `default` if the field is
    /// left out and declares no default of its own. A number that does not fit in `T` becomes the
    /// largest value of `T`.
    pub(crate) fn integer_or<T: WholeNumber>(&self, name: &str, default: T) -> T {
        self.find_integer(name)
            .map_or(default, |value| T::try_from(value).unwrap_or(T::TOP))
    }

    /// Returns the number in the field `name`, which need not be a whole number of steps; `None` if
    /// it is left out.
    pub(crate) fn real(&self, name: &str) -> Option<f64> {
        match self.get(name) {
            Some(Value::Real(value)) => Some(*value),
            _ => None,
        }
    }

    /// Returns the number in the field `name` times 10^`power`, without rounding error; `None` if
    /// it is left out.
    pub(crate) fn decimal(&self, name: &str, power: i32) -> Option<f64> {
        match self.entries.get(name)? {
            Entry {
                span,
                value: Some(Value::Real(_)),
            } => self.number_at(span, power),
            _ => None,
        }
    }

    /// Returns the pairs of numbers in the field `name` times 10^`power`, without rounding errors;
    /// none if it is left out.
    pub(crate) fn pairs(&self, name: &str, power: i32) -> Vec<[f64; 2]> {
        let Some(Value::Pairs(pairs)) = self.get(name) else {
            return Vec::new();
        };
        let read = |[first, second]: &[Range<usize>; 2]| {
            Some([
                self.number_at(first, power)?,
                self.number_at(second, power)?,
            ])
        };
        pairs.iter().filter_map(read).collect()
    }

    fn number_at(&self, span: &Range<usize>, power: i32) -> Option<f64> {
        parse_scaled(self.doc.text.get(span.clone())?, power)
    }

    /// Returns the list of numbers in the field `name`, in the device's steps, each with its place
    /// in the text. The list is empty if the field is left out.
    pub(crate) fn integers(&self, name: &str) -> &[(i64, Range<usize>)] {
        match self.get(name) {
            Some(Value::Wholes(values)) => values,
            _ => &[],
        }
    }

    /// Returns whether the field `name` is true; false if it is left out.
    pub(crate) fn flag(&self, name: &str) -> bool {
        matches!(self.get(name), Some(Value::Flag(true)))
    }

    fn word_of(&self, name: &str) -> Option<&'static str> {
        match self.entries.get(name).map(|entry| &entry.value) {
            Some(Some(Value::Word(word))) => Some(word),
            Some(_) => None,
            None => self
                .section
                .iter()
                .find(|f| f.name == name)
                .and_then(|f| match f.need {
                    Need::OrWord(word) => Some(word),
                    _ => None,
                }),
        }
    }

    /// Returns the word in the field `name`, or its default. Returns an empty text if there is
    /// neither.
    pub(crate) fn word(&self, name: &str) -> &'static str {
        self.word_of(name).unwrap_or_default()
    }

    /// Returns the value that `choices` pairs with the word in the field `name`; `None` if the word
    /// is not in `choices`.
    pub(crate) fn choice<T: Copy>(&self, name: &str, choices: &[(&str, T)]) -> Option<T> {
        let word = self.word(name);
        choices
            .iter()
            .find(|(known, _)| *known == word)
            .map(|(_, value)| *value)
    }

    /// Returns the text in the field `name`; `None` if it is left out.
    pub(crate) fn text(&self, name: &str) -> Option<&'a str> {
        match self.get(name) {
            Some(Value::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// Returns the list of texts in the field `name`; an empty list if it is left out.
    pub(crate) fn texts(&self, name: &str) -> &[&'a str] {
        match self.get(name) {
            Some(Value::Texts(texts)) => texts,
            _ => &[],
        }
    }

    /// Returns the table in the field `name`; `None` if it is left out.
    pub(crate) fn table(&self, name: &str) -> Option<&Self> {
        match self.get(name) {
            Some(Value::Table(table)) => Some(table),
            _ => None,
        }
    }

    /// Passes the table in the field `name` to `read` and returns the result. Returns `Some(None)`
    /// if the table is left out, and `None` if it or `read` has an error.
    pub(crate) fn optional_table<T>(
        &self,
        name: &str,
        read: impl FnOnce(&Self) -> Option<T>,
    ) -> Option<Option<T>> {
        match self.table(name) {
            None => (!self.has(name)).then_some(None),
            Some(table) if table.sound => read(table).map(Some),
            Some(_) => None,
        }
    }

    /// Returns the list of tables in the field `name`; an empty list if it is left out.
    pub(crate) fn tables(&self, name: &str) -> &[Self] {
        match self.get(name) {
            Some(Value::Tables(tables)) => tables,
            _ => &[],
        }
    }
}

/// Reports of errors that the meaning of the fields shows, after each field was checked by itself.
impl Table<'_> {
    /// Returns the path of the field `name` in the file, for example "channel.train.width_us".
    pub(crate) fn field_path(&self, name: &str) -> String {
        if self.path.is_empty() {
            name.into()
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// Returns the place of the field `name` in the text, or of the table if the field is left out.
    pub(crate) fn field_place(&self, name: &str) -> Place {
        let entry = self.entries.get(name);
        Place {
            field: self.field_path(name),
            given: entry.map_or_else(|| "left out".into(), |entry| self.doc.excerpt(&entry.span)),
            span: entry.map_or_else(|| self.span.clone(), |entry| entry.span.clone()),
        }
    }

    fn place(&self, name: &str, span: Range<usize>) -> Place {
        Place {
            field: self.field_path(name),
            given: self.doc.excerpt(&span),
            span,
        }
    }

    /// Reports a problem at the field `name`, or at the table if the field is left out.
    pub(crate) fn report(&self, name: &str, problem: Problem) {
        self.doc.report(problem, self.field_place(name));
    }

    /// Reports that the value of the field `name` is not allowed. `allowed` describes the values
    /// that are.
    pub(crate) fn report_out_of_range(&self, name: &str, allowed: String) {
        self.report(name, Problem::OutOfRange { allowed });
    }

    /// Reports that the value of the field `name` must be greater than `after`, a description of
    /// the other value.
    pub(crate) fn report_not_after(&self, name: &str, after: String) {
        self.report(name, Problem::NotInOrder { after });
    }

    /// Returns the time in the field `name`, µs, which must be between `least` and `duration_us`.
    /// Otherwise reports it and returns `None`.
    pub(crate) fn time(&self, name: &str, least: i64, duration_us: u64) -> Option<u64> {
        let time = self.integer(name);
        self.within(time, self.field_place(name), least, duration_us)
    }

    /// Returns the list of times in the field `name`, µs. They must be between `least` and
    /// `duration_us`, and each must be at least `apart` after the one before. Otherwise reports the
    /// first wrong time and returns `None`.
    pub(crate) fn times(
        &self,
        name: &str,
        least: i64,
        apart: u64,
        duration_us: u64,
    ) -> Option<Vec<u64>> {
        let mut times: Vec<u64> = Vec::new();
        for (at, span) in self.integers(name) {
            let place = self.place(name, span.clone());
            let at = self.within(*at, place.clone(), least, duration_us)?;
            if let Some(before) = times.last().filter(|before| at < *before + apart) {
                let (before, apart) = (*before as f64 * 1e-6, apart as f64 * 1e-6);
                let after = format!("{before} s, by at least {apart} s");
                self.doc.report(Problem::NotInOrder { after }, place);
                return None;
            }
            times.push(at);
        }
        Some(times)
    }

    fn within(&self, at: i64, place: Place, least: i64, duration_us: u64) -> Option<u64> {
        let end = duration_us as i64; // at most a day
        if (least..=end).contains(&at) {
            return Some(at as u64); // not negative
        }
        let allowed = format_range(least, end, 6);
        self.doc.report(Problem::OutOfRange { allowed }, place);
        None
    }

    /// Reports a refusal by the firmware at the field that holds the refused quantity, in this
    /// table or in a table within it.
    pub(crate) fn report_refusal(&self, e: impl Into<Refusal<'static>>) {
        let Refusal {
            field, min, max, ..
        } = e.into();
        match self.find_quantity(field) {
            Some((table, found)) => {
                let bounds = (min.into(), max.into());
                let number = found.number();
                // The field's own error message is more precise.
                let own = number.filter(|n| !n.bound.is_empty() && n.range == Some(bounds));
                if own.is_none() || !table.has(found.name) {
                    let allowed = number.map(|number| {
                        let range = number.format_bounds(bounds.0, bounds.1);
                        format!("{range} {}", number.display_unit())
                    });
                    let allowed = allowed.unwrap_or_default();
                    table.report_out_of_range(found.name, allowed.trim_end().to_owned());
                }
            }
            None => self.report_out_of_range(field, format!("{min} to {max}")),
        }
    }

    /// Returns the field that holds the firmware's quantity `device` or, if the file leaves it out,
    /// that could hold it, and the table of this field.
    fn find_quantity(&self, device: &str) -> Option<(&Self, &'static Field)> {
        let is = |field: &&Field| field.number().is_some_and(|number| number.device == device);
        let mut own = self.section.iter().filter(is);
        let given = own.clone().find(|field| self.has(field.name));
        let found = given.or_else(|| own.find(|field| self.applies(field)));
        found.map(|field| (self, field)).or_else(|| {
            let mut entries = self.entries.values();
            entries.find_map(|entry| match &entry.value {
                Some(Value::Table(table)) => table.find_quantity(device),
                _ => None,
            })
        })
    }
}

/// Integer type to which a number in a file can be converted.
pub(crate) trait WholeNumber: TryFrom<i64> {
    /// Largest value of the type. It stands for a number that is missing or does not fit.
    const TOP: Self;
}

macro_rules! whole {
    ($($t:ty),*) => {$(
        impl WholeNumber for $t {
            const TOP: Self = <$t>::MAX;
        }
    )*};
}
whole!(u8, u16, u32, u64, i16, i32, i64);
