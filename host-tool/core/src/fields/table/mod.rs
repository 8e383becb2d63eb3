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

/// One table of the file.
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
    /// Value of the field; `None` if it has an error.
    value: Option<Value<'a>>,
}

enum Value<'a> {
    Text(&'a str),
    Texts(Vec<&'a str>),
    Flag(bool),
    Word(&'static str),
    /// Number in the device's steps.
    Whole(i64),
    Real(f64),
    /// Numbers in the device's steps, each with its place.
    Wholes(Vec<(i64, Range<usize>)>),
    /// Places of the numbers of each pair.
    Pairs(Vec<[Range<usize>; 2]>),
    Table(Table<'a>),
    Tables(Vec<Table<'a>>),
}

/// Access to the values of a table without errors.
impl<'a> Table<'a> {
    /// Returns whether no field of the table has an error by itself; tables within it count
    /// separately.
    pub(crate) const fn is_valid(&self) -> bool {
        self.sound
    }

    /// Returns whether the file has this field.
    pub(crate) fn has(&self, name: &str) -> bool {
        self.entries.contains_key(name)
    }

    fn get(&self, name: &str) -> Option<&Value<'a>> {
        self.entries.get(name)?.value.as_ref()
    }

    /// Returns the declaration of a field that applies in this table.
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

    /// Returns the number in this field, or its default. If there is neither, or it does not fit in
    /// `T`, returns the largest value of `T`, which no rule of the firmware accepts.
    pub(crate) fn integer<T: WholeNumber>(&self, name: &str) -> T {
        self.integer_or(name, T::TOP)
    }

    /// Returns the number in this field, with `default` if it is left out; otherwise as
    /// [`Self::integer`].
    pub(crate) fn integer_or<T: WholeNumber>(&self, name: &str, default: T) -> T {
        self.find_integer(name)
            .map_or(default, |value| T::try_from(value).unwrap_or(T::TOP))
    }

    /// Returns the number in this field, which need not be whole; `None` if it is left out.
    pub(crate) fn real(&self, name: &str) -> Option<f64> {
        match self.get(name) {
            Some(Value::Real(value)) => Some(*value),
            _ => None,
        }
    }

    /// Returns the number in this field times 10^`power`, as exactly as it is written; `None` if it
    /// is left out.
    pub(crate) fn decimal(&self, name: &str, power: i32) -> Option<f64> {
        match self.entries.get(name)? {
            Entry {
                span,
                value: Some(Value::Real(_)),
            } => self.number_at(span, power),
            _ => None,
        }
    }

    /// Returns the pairs of numbers in this field times 10^`power`, as exactly as they are written.
    pub(crate) fn pairs(&self, name: &str, power: i32) -> Vec<[f64; 2]> {
        let Some(Value::Pairs(pairs)) = self.get(name) else {
            return Vec::new();
        };
        let read = |[one, two]: &[Range<usize>; 2]| {
            Some([self.number_at(one, power)?, self.number_at(two, power)?])
        };
        pairs.iter().filter_map(read).collect()
    }

    fn number_at(&self, span: &Range<usize>, power: i32) -> Option<f64> {
        parse_scaled(self.doc.text.get(span.clone())?, power)
    }

    /// Returns the list of numbers in this field, in the device's steps, each with its place.
    pub(crate) fn integers(&self, name: &str) -> &[(i64, Range<usize>)] {
        match self.get(name) {
            Some(Value::Wholes(values)) => values,
            _ => &[],
        }
    }

    /// Returns whether this field is true.
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

    /// Returns the word in this field or its default; an empty text if there is neither.
    pub(crate) fn word(&self, name: &str) -> &'static str {
        self.word_of(name).unwrap_or_default()
    }

    /// Returns the value that `choices` gives for the word in this field.
    pub(crate) fn choice<T: Copy>(&self, name: &str, choices: &[(&str, T)]) -> Option<T> {
        let word = self.word(name);
        choices
            .iter()
            .find(|(known, _)| *known == word)
            .map(|(_, value)| *value)
    }

    /// Returns the text in this field; `None` if it is left out.
    pub(crate) fn text(&self, name: &str) -> Option<&'a str> {
        match self.get(name) {
            Some(Value::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// Returns the list of texts in this field; an empty list if it is left out.
    pub(crate) fn texts(&self, name: &str) -> &[&'a str] {
        match self.get(name) {
            Some(Value::Texts(texts)) => texts,
            _ => &[],
        }
    }

    /// Returns the table in this field; `None` if it is left out.
    pub(crate) fn table(&self, name: &str) -> Option<&Self> {
        match self.get(name) {
            Some(Value::Table(table)) => Some(table),
            _ => None,
        }
    }

    /// Returns the result of `read` for the table in this field: `Some(None)` if the table is left
    /// out, `None` if it has errors.
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

    /// Returns the list of tables in this field; an empty list if it is left out.
    pub(crate) fn tables(&self, name: &str) -> &[Self] {
        match self.get(name) {
            Some(Value::Tables(tables)) => tables,
            _ => &[],
        }
    }
}

/// Reports of rules that several fields break together.
impl Table<'_> {
    /// Returns the path of the field in the file.
    pub(crate) fn field_path(&self, name: &str) -> String {
        if self.path.is_empty() {
            name.into()
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// Returns the place of a field, or of the table if the field is left out.
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

    /// Reports a problem at this field, or at the table if the field is left out.
    pub(crate) fn report(&self, name: &str, problem: Problem) {
        self.doc.report(problem, self.field_place(name));
    }

    /// Reports that the field is outside the range `allowed`.
    pub(crate) fn report_out_of_range(&self, name: &str, allowed: String) {
        self.report(name, Problem::OutOfRange { allowed });
    }

    /// Reports that the field must come after `after`.
    pub(crate) fn report_not_after(&self, name: &str, after: String) {
        self.report(name, Problem::NotInOrder { after });
    }

    /// Returns a time, µs, from `least` to the end of the session; reports any other time.
    pub(crate) fn time(&self, name: &str, least: i64, duration_us: u64) -> Option<u64> {
        let time = self.integer(name);
        self.within(time, self.field_place(name), least, duration_us)
    }

    /// Returns a list of times, µs, from `least` to the end of the session, which rise by at least
    /// `apart`; reports any other list.
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

    /// Reports the firmware's refusal at the field concerned, in this table or in one within it.
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
                    let allowed = number.map(|number| number.format_bounds(bounds.0, bounds.1));
                    table.report_out_of_range(found.name, allowed.unwrap_or_default());
                }
            }
            None => self.report_out_of_range(field, format!("{min} to {max}")),
        }
    }

    /// Returns the table and field that hold a quantity of the firmware, or would hold it.
    fn find_quantity(&self, device: &str) -> Option<(&Self, &'static Field)> {
        let is = |field: &&Field| field.number().is_some_and(|number| number.device == device);
        let mut own = self.section.iter().filter(is);
        let told = own.clone().find(|field| self.has(field.name));
        let found = told.or_else(|| own.find(|field| self.applies(field)));
        found.map(|field| (self, field)).or_else(|| {
            let mut entries = self.entries.values();
            entries.find_map(|entry| match &entry.value {
                Some(Value::Table(table)) => table.find_quantity(device),
                _ => None,
            })
        })
    }
}

/// An integer type of the link.
pub(crate) trait WholeNumber: TryFrom<i64> {
    /// The largest value of the type.
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
